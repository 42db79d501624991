// The page's data: its scenes, and its maps in order. A test compares these types with what is written.

/**
 * @typedef {{name: string, title: string, kind: string, top: number}} Legend of a map
 * @typedef {{factor: number, mean: number, after: number}} Exposure
 * @typedef {{x: number, y: number, width: number, height: number, share: number, mean_dE2000: number, effect: string | null, nearest: object | null}} Region
 * @typedef {{name: string, k_i: number[], k_a: number[], k_d: number[], k_s: number[], n: number, form: string, ambient: number[]}} Material
 * @typedef {{name: string, intensity: number[]}} Lamp
 */

/**
 * @typedef {object} Terms
 * @property {Manifest | null} grid
 * @property {Record<string, number>} tops of the named planes of values ≥ 0
 * @property {Material[]} materials
 * @property {Lamp[]} lights
 * @property {string} missing        why there is no grid
 */

/**
 * @typedef {object} Scene
 * @property {string} id
 * @property {string} name
 * @property {number} width
 * @property {number} height
 * @property {number} exposure
 * @property {{subject: string, title: string, name: string}} judged   the names of the first half
 * @property {Region[]} regions
 * @property {Record<string, Exposure>} best by map: the first half's exposure that lowers the mean most
 * @property {Manifest} images
 * @property {Effects | null} effects
 * @property {Terms | null} terms
 * @property {undefined} [failed]
 */

/**
 * @typedef {Omit<Scene, "images"> & {images: null}} Unpictured
 * @typedef {{id: string, name: string, failed: true, images?: undefined}} Failed
 * @typedef {Scene | Unpictured | Failed} Listed
 */

/**
 * @typedef {object} Page
 * @property {Listed[]} scenes
 * @property {Legend[]} maps
 * @property {string} noEffect
 * @property {Record<string, string>} colours   256 of each map, as "rrggbb"
 * @property {number[][]} mask   colours of pixels: marked, unmarked, not counted, undetermined
 * @property {number[][]} xyz
 * @property {Record<string, string>} terms   meanings, from the glossary
 * @property {number} epsilon
 */

/** @type {Page} */
const page = JSON.parse(document.getElementById("page-data")?.textContent ?? "{}");

/** The exposure of the textbook that lowers a map's mean most: its factor (1: unchanged), and both means. @param {Scene} scene @param {string} map */
function bestOf(scene, map) {
  return scene.best[map] ?? scene.best[page.maps[0].name];
}

/** The factor on the textbook's image in a view. @param {Scene} scene @param {View} view */
function gainOf(scene, view) {
  return view.best ? bestOf(scene, view.map).factor : 1;
}

/** A factor on the textbook's image, in words. @param {number} gain */
function gainText(gain) {
  const rounded = plainly(Number(gain.toPrecision(3)));
  return rounded === "1" ? "at the same exposure" : `× ${rounded}`;
}

/** The map with a known name. @param {Page} page @param {string} name @returns {Legend} */
function mapOf(page, name) {
  return /** @type {Legend} */ (page.maps.find((map) => map.name === name));
}
