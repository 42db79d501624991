// The first screen at a threshold: headline, order, pictures, bars and what to do.

/** Show all scenes at a threshold; Python made the sentences for each. @param {number} t */
function showOverview(t) {
  const place = placeOf(t);
  byId("headline").textContent = textAt(page.headlines, place);
  byId("missing").textContent = textAt(page.missing, place);
  for (const list of document.querySelectorAll("[data-list]")) {
    const items = /** @type {HTMLElement[]} */ ([...list.children]);
    const known = new Map(page.scenes.map(scene => [scene.id, scene]));
    const sizeOf = (/** @type {HTMLElement} */ item) => {
      const scene = known.get(item.dataset.scene ?? "");
      return scene && !scene.failed ? scene.shares[place] : -1;
    };
    items
      .sort((a, b) => sizeOf(b) - sizeOf(a))
      .forEach(item => {
        const scene = known.get(item.dataset.scene ?? "");
        if (scene && !scene.failed) showScene(item, scene, place);
      });
    list.append(...items);
  }
}

/** @param {HTMLElement} item @param {Scene} scene @param {number} place */
function showScene(item, scene, place) {
  for (const part of item.querySelectorAll("[data-show=share]"))
    part.textContent = percentText(scene.shares[place]);
  for (const part of item.querySelectorAll("[data-show=advice]")) {
    const advice = textAt(scene.advice, place);
    part.replaceChildren(
      ...coded(part.hasAttribute("data-own") ? advice.replace(page.find, "") : advice),
    );
  }
  item.dataset.verdict = scene.verdicts[place];
  item.style.setProperty("--share", String(scene.shares[place]));
}

/** Text in which `…` is code. @param {string} text */
function coded(text) {
  return text
    .split("`")
    .map((part, place) =>
      place % 2 ? Object.assign(document.createElement("code"), { textContent: part }) : part,
    );
}
