// The page's data, and how numbers are printed. A test compares these types with what is written.

/**
 * @typedef {[number, string][]} Runs   texts by the place of the threshold from which each holds
 * @typedef {{name: string, title: string, kind: string, top: number}} MapOf
 * @typedef {{x: number, y: number, width: number, height: number, effect: string | null}} Region
 * @typedef {{width: number, height: number, names: string[], colours: string[],
 *   parts: number[], map: string}}
 * Effects
 * @typedef {{on: number[], mean: string}} Hybrid
 * @typedef {{images: Manifest, hybrids: Hybrid[]}} Board
 * @typedef {{name: string, k_i: number[], k_a: number[], k_d: number[], k_s: number[], n: number,
 * form: string, ambient: number[]}} Material
 * @typedef {{name: string, intensity: number[], specular_intensity: number[]}} Lamp
 * @typedef {{grid: null, missing: string}} NoPoints
 * @typedef {{grid: Manifest, columns: number[], rows: number[],
 * tops: Record<string, number>, materials: Material[], lights: Lamp[], missing: string}} Terms
 */

/**
 * @typedef {object} Scene
 * @property {string} id
 * @property {string} name
 * @property {number} width
 * @property {number} height
 * @property {number} exposure
 * @property {{subject: string, title: string, name: string}} judged   the names of the first half
 * @property {{subject: string, title: string, name: string}} truth   those of the second half
 * @property {boolean} arePictures    whether there is no scene
 * @property {boolean} isNoiseKnown   whether passes or repeats show it
 * @property {string} mean       of ΔE2000
 * @property {{pixel: number[], error: string}} worst   where the error is largest, and its ΔE2000
 * @property {number[]} shares   of the pixels that differ visibly, by threshold
 * @property {string} verdicts   a letter by threshold: p(ass), f(ail) or u(ndecided)
 * @property {Runs} advice
 * @property {Record<string, Runs>} cells   of the table of scenes, by heading
 * @property {(number | null)[]} prices   over the textbook's time, by threshold
 * @property {Region[]} regions
 * @property {Manifest | null} images
 * @property {Effects | null} effects
 * @property {Board | null} board
 * @property {Terms | NoPoints | null} terms
 * @property {Live | NoPoints | null} live
 * @property {undefined} [failed]
 */

/**
 * @typedef {Scene & {images: Manifest}} Pictured
 * @typedef {{id: string, name: string, failed: true, images?: undefined}} Failed
 */

/**
 * @typedef {object} Page
 * @property {(Scene | Failed)[]} scenes
 * @property {number | null} written     of a page that grows: milliseconds since 1970
 * @property {number[]} thresholds
 * @property {number} usual              the threshold shown first
 * @property {Runs} headlines
 * @property {Runs} missing
 * @property {Runs} costs
 * @property {{low: number, high: number, marks: number[]}} axis   of prices: powers of ten
 * @property {MapOf[]} maps
 * @property {string} noEffect
 * @property {number} dark               the greatest grey of a difference that is not visible
 * @property {Record<string, string>} colours   256 of each map, as "rrggbb"
 * @property {number[][]} mask  colours of pixels: marked, unmarked, not counted, undetermined
 * @property {number[][]} xyz            the matrix from linear RGB; white has Y = 1
 * @property {Record<string, string>} terms   meanings, from the glossary
 * @property {number} epsilon
 */

/** @type {Page} */
const page = JSON.parse(document.getElementById("page-data")?.textContent ?? "{}");

/** @param {string} id @returns {HTMLElement} */
const byId = id => /** @type {HTMLElement} */ (document.getElementById(id));

/** @param {string} selector @param {ParentNode} part of the page */
const elementsIn = (selector, part = document) =>
  /** @type {HTMLElement[]} */ ([...part.querySelectorAll(selector)]);

/** @param {number} value @param {number} low @param {number} high */
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** The text at a threshold's place. @param {Runs} runs @param {number} place */
const textAt = (runs, place) => runs.filter(([from]) => from <= place).at(-1)?.[1] ?? "";

/** The place of a threshold in the lists. @param {number} t */
const placeOf = t => page.thresholds.indexOf(t);

/** A value with significant digits, in human form. @param {number} value */
function significant(value, digits = 3) {
  if (!value) return "0";
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const exponent = Number(power);
  const isPlain = exponent >= -3 && exponent < Math.max(digits, 3);
  const raised = [...String(exponent)]
    .map(sign => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)]))
    .join("");
  return (
    isPlain ? value.toFixed(Math.max(0, digits - 1 - exponent)) : `${mantissa} × 10${raised}`
  ).replace("-", "−");
}

/** A colour difference; a hundredth is invisible. @param {number} value */
const differenceText = value => (value > 0 && value < 0.01 ? "< 0.01" : significant(value));

/** @param {number} part of 1 */
function percentText(part) {
  const value = 100 * part;
  return value > 0 && value < 0.1
    ? "< 0.1 %"
    : `${value >= 99.95 ? "100" : value.toPrecision(value < 1 ? 1 : value < 10 ? 2 : 3)} %`;
}
