// The first screen at a threshold: headline, order, pictures, prices, and the table of scenes.

const comparedScenes = /** @type {Scene[]} */ (page.scenes.filter(scene => !scene.failed));
/** The scenes whose comparison did not fail, by their ids. */
const compared = new Map(comparedScenes.map(scene => [scene.id, scene]));

/** Show all scenes at a threshold; Python made the sentences for each. @param {number} t */
function showOverview(t) {
  const place = placeOf(t);
  byId("headline").textContent = textAt(page.headlines, place);
  byId("missing").textContent = textAt(page.missing, place);
  const sizeOf = (/** @type {HTMLElement} */ item) =>
    compared.get(item.dataset.scene ?? "")?.shares[place] ?? -1;
  const list = document.querySelector(".bars tbody");
  const items = /** @type {HTMLElement[]} */ ([...(list?.children ?? [])]);
  list?.append(...items.sort((a, b) => sizeOf(b) - sizeOf(a)));
  for (const row of elementsIn("#overview [data-scene]")) {
    const scene = compared.get(row.dataset.scene ?? "");
    if (scene) showScene(row, scene, place);
  }
  showPrices(place);
}

/** Put each scene of known price in the chart, and name the others. @param {number} place */
function showPrices(place) {
  const sentence = document.getElementById("costs-sentence");
  if (!sentence) return;
  sentence.textContent = textAt(page.costs, place);
  const {low, high} = page.axis;
  const points = elementsIn("[data-price]");
  const labelled = /** @type {{from: number, to: number, y: number}[]} */ ([]);
  const plot = points[0]?.parentElement?.clientWidth || 1;
  const unknown = /** @type {string[]} */ ([]);
  const spots = points.flatMap(point => {
    const scene = /** @type {Scene} */ (compared.get(point.dataset.price ?? ""));
    const price = scene.prices[place];
    point.hidden = price === null;
    if (price === null) {
      unknown.push(scene.name);
      return [];
    }
    const steps = clamp(Math.log10(price) - low, 0, high - low);
    const time = `${significant(price, 2)} times the time`;
    const link = /** @type {HTMLElement} */ (point.firstElementChild);
    link.title = `${scene.name}: ${percentText(scene.shares[place])} differ, ${time}`;
    return [{point, x: steps / (high - low), y: scene.shares[place]}];
  });
  byId("unpriced").textContent = unknown.length ? `Not known of ${unknown.join(", ")}.` : "";
  // The names of those that differ most, as far as they do not overlap.
  spots.sort((a, b) => b.y - a.y);
  for (const {point, x, y} of spots) {
    point.style.setProperty("--x", String(x));
    point.style.setProperty("--y", String(y));
    // About 7 pixels for each letter, and the distance from the point.
    const width = (18 + 7 * (point.textContent ?? "").trim().length) / plot;
    const isLeft = x + width > 1;
    const from = isLeft ? x - width : x;
    const to = from + width;
    const overlaps = labelled.some(
      label => Math.abs(label.y - y) < 0.07 && label.from < to && from < label.to,
    );
    point.classList.toggle("named", !overlaps);
    point.classList.toggle("left", isLeft);
    if (!overlaps) labelled.push({from, to, y});
  }
}

/** @param {HTMLElement} item @param {Scene} scene @param {number} place */
function showScene(item, scene, place) {
  for (const part of item.querySelectorAll("[data-show=share]"))
    part.textContent = percentText(scene.shares[place]);
  for (const part of item.querySelectorAll("[data-show=advice]")) {
    part.replaceChildren(...coded(textAt(scene.advice, place)));
  }
  for (const cell of elementsIn("[data-cell]", item))
    cell.textContent = textAt(scene.cells[cell.dataset.cell ?? ""], place);
  for (const part of item.querySelectorAll("[data-command]"))
    part.textContent = (part.textContent ?? "").replace(
      /--within \S+/,
      `--within ${page.thresholds[place]}`,
    );
  item.dataset.verdict = scene.verdicts[place];
  item.style.setProperty("--share", String(scene.shares[place]));
}

document.addEventListener("click", event => {
  const button = /** @type {HTMLElement} */ (event.target).closest("[data-copy]");
  if (!button) return;
  const command = button.parentElement?.querySelector("code")?.textContent ?? "";
  void navigator.clipboard.writeText(command).then(() => (button.textContent = "Copied"));
});

/** Text in which `…` is code. @param {string} text */
function coded(text) {
  return text
    .split("`")
    .map((part, place) =>
      place % 2 ? Object.assign(document.createElement("code"), { textContent: part }) : part,
    );
}
