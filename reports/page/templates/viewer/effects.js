// The dominating effect of each pixel: one letter per pixel, at the size of the study.

/** @typedef {{width: number, height: number, names: string[], colours: string[], map: string}} Effects */

/** Letters of pixels without an effect: none dominates, and not counted. */
const NO_EFFECT = ".", NOT_COUNTED = "-";

/** The letter at a place of the image, from 0 to 1. @param {Effects | null} effects @param {number} x @param {number} y */
function letterAt(effects, x, y) {
  if (!effects) return NOT_COUNTED;
  const column = clamp(Math.floor(x * effects.width), 0, effects.width - 1);
  const row = clamp(Math.floor(y * effects.height), 0, effects.height - 1);
  return effects.map[row * effects.width + column];
}

/** The name of a letter's effect; empty if unknown. @param {Effects | null} effects @param {string} letter */
function effectName(effects, letter) {
  if (letter === NO_EFFECT) return "none visible";
  return effects?.names[Number(letter)] ?? "";
}

/** The canvas colour of each letter. @param {Effects | null} effects @param {Page} page @returns {Record<string, number>} */
function effectColours(effects, page) {
  const parts = (/** @type {string} */ css) => [1, 3, 5].map((place) => parseInt(css.slice(place, place + 2), 16));
  const pixel = (/** @type {number[]} */ [r, g, b]) => rgba(r, g, b);
  const own = (effects?.colours ?? []).map((css, place) => [String(place), pixel(parts(css))]);
  return Object.fromEntries([...own, [NO_EFFECT, pixel(parts(page.noEffect))], [NOT_COUNTED, pixel(page.mask[2])]]);
}

/** Fills the legend with the effects of a scene. @param {HTMLElement} legend @param {Effects} effects @param {Page} page */
function listEffects(legend, effects, page) {
  const keys = effects.names.map((name, place) => [name, effects.colours[place]]);
  const line = /** @type {HTMLElement} */ (legend.querySelector(".keys"));
  line.replaceChildren(
    ...[...keys, ["none visible", page.noEffect]].map(([name, colour]) => {
      const key = Object.assign(document.createElement("span"), { className: "key" });
      const swatch = document.createElement("i");
      swatch.style.background = colour;
      key.append(swatch, name);
      return key;
    }),
  );
}
