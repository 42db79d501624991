// The effect switchboard: which effects are on, and the preview of that hybrid.

/**
 * @typedef {{on: number[], error: string, time: string}} Hybrid
 * @typedef {{sheet: string, width: number, height: number, columns: number, hybrids: Hybrid[]}} Board
 */

/** Make the switchboard of a scene live when the scene is first opened. @param {HTMLElement} section */
async function makeSwitchboard(section) {
  const element = /** @type {HTMLElement | null} */ (section.querySelector(".switchboard"));
  if (!element || element.dataset.ready) return;
  element.dataset.ready = "soon";
  /** @type {Board} */
  const board = JSON.parse(element.querySelector("script")?.textContent ?? "{}");
  const sheet = Object.assign(new Image(), { src: board.sheet });
  await sheet.decode();
  const buttons = [.../** @type {NodeListOf<HTMLElement>} */ (element.querySelectorAll("[data-effect]"))];
  const names = buttons.map((button) => button.textContent?.trim() ?? "");
  const places = new Map(board.hybrids.map((hybrid, place) => [hybrid.on.join(), place]));
  const refused = /** @type {HTMLElement} */ (element.querySelector("[data-board=refused]"));
  /** @type {Set<number>} */
  const on = new Set();

  /** @param {string} name @returns {HTMLElement} */
  const part = (name) => /** @type {HTMLElement} */ (element.querySelector(`[data-board=${name}]`));
  const subject = part("name").textContent;
  /** The effects after switching one of them. @param {number} effect */
  const switched = (effect) => [...on].filter((one) => one !== effect).concat(on.has(effect) ? [] : [effect]).sort((a, b) => a - b);
  /** @param {number[]} effects */
  const inWords = (effects) => [subject, ...effects.map((effect) => names[effect])].join(" + ");

  /** @param {string} name @param {number} place */
  function draw(name, place) {
    const { width, height, columns } = board;
    const context = /** @type {HTMLCanvasElement} */ (part(name)).getContext("2d");
    const from = [(place % columns) * width, Math.floor(place / columns) * height];
    context?.drawImage(sheet, from[0], from[1], width, height, 0, 0, width, height);
  }

  function show() {
    const effects = [...on].sort((a, b) => a - b);
    const place = places.get(effects.join()) ?? 0;
    const [none, seen] = [board.hybrids[0], board.hybrids[place]];
    draw("seen", place);
    part("name").textContent = inWords(effects);
    part("seen").setAttribute("aria-label", `Preview: ${inWords(effects)}`);
    buttons.forEach((button, effect) => {
      button.setAttribute("aria-pressed", String(on.has(effect)));
      button.setAttribute("aria-disabled", String(!places.has(switched(effect).join())));
    });
    refused.hidden = true;
    const gain = /** @type {HTMLElement} */ (element?.querySelector(".remains"));
    gain.replaceChildren("ΔE2000 ", ...change(none.error, seen.error), ", ", ...change(none.time, seen.time));
  }

  /** A value before and after. @param {string} before @param {string} after */
  function change(before, after) {
    const strong = Object.assign(document.createElement("strong"), { textContent: after });
    return on.size ? [`${before} → `, strong] : [strong];
  }

  /** @param {number} effect */
  function press(effect) {
    const wanted = switched(effect);
    if (!places.has(wanted.join())) {
      refused.textContent = `${inWords(wanted)} was not rendered. Switch another effect first.`;
      refused.hidden = false;
      return;
    }
    on.clear();
    for (const one of wanted) on.add(one);
    show();
  }

  buttons.forEach((button, effect) => button.addEventListener("click", () => press(effect)));
  draw("whole", board.hybrids.length - 1);
  show();
  element.dataset.ready = "yes";
}
