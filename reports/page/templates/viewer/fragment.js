// The view as the fragment of the address, which can be sent to somebody else.

/**
 * @typedef {object} View
 * @property {string} scene       the id of a scene; empty for the overview
 * @property {string} mode        split, flicker, side or error
 * @property {string} map         a map's name
 * @property {string} tone        a tone map's name
 * @property {number} ev          exposure in stops, relative to the comparison's
 * @property {number | null} zoom screen pixels per image pixel; null to fit
 * @property {number | null} x    the centre of a zoomed view, in pixels of the image
 * @property {number | null} y
 * @property {number} split       place of the divide, 0 to 1
 * @property {number[] | null} pixel the marked pixel
 * @property {boolean} boxes      whether regions are boxed
 * @property {number | null} top  end of the map's colours; null for the automatic range
 * @property {boolean} best       whether the textbook has its best exposure
 * @property {number[] | null} box  the selected rectangle: left, top, width and height in pixels of the image
 * @property {number[] | null} band the values that are lit up: from, and up to
 */

/** @type {View} */
const DEFAULT_VIEW = Object.freeze({
  scene: "", mode: "split", map: page.maps[0].name, tone: "clip", ev: 0, zoom: null, x: null, y: null, split: 0.5,
  pixel: null, boxes: true, top: null, best: false, box: null, band: null,
});

/** The allowed values of properties that have few. @type {Record<string, string[]>} */
const ALLOWED = {
  mode: ["split", "flicker", "side", "error"],
  tone: ["clip", "reinhard", "filmic", "false"],
};

/** Functions that read properties; null if the text makes no sense. @type {Record<string, (text: string) => any>} */
const READERS = {
  ev: numberIn(-16, 16), zoom: numberIn(1e-3, 1e3), x: numberIn(0, 1e6), y: numberIn(0, 1e6), split: numberIn(0, 1),
  boxes: (text) => text !== "0", best: (text) => text === "1", top: numberIn(1e-6, 1e6),
  box: (text) => (/^\d+,\d+,[1-9]\d*,[1-9]\d*$/.test(text) ? text.split(",").map(Number) : null),
  band: bandIn,
  pixel: (text) => (/^\d+,\d+$/.test(text) ? text.split(",").map(Number) : null),
};

/** @param {number} low @param {number} high */
function numberIn(low, high) {
  return (/** @type {string} */ text) => {
    const value = text.trim() ? Number(text) : NaN;
    return value >= low && value <= high ? value : null;
  };
}

/** Two values in order; either may be infinite. @param {string} text */
function bandIn(text) {
  const ends = text.split(",").map((part) => (part.trim() ? Number(part) : NaN));
  return ends.length === 2 && ends[0] < ends[1] ? ends : null;
}

/** The view of a fragment; missing or wrong properties have their defaults. @param {string} text @returns {View} */
function parseFragment(text) {
  /** @type {any} */
  const view = { ...DEFAULT_VIEW };
  for (const [key, value] of new URLSearchParams(text.replace(/^#/, ""))) {
    if (!Object.hasOwn(DEFAULT_VIEW, key)) continue;
    const read = READERS[key] ? READERS[key](value) : value;
    if (read !== null && (!ALLOWED[key] || ALLOWED[key].includes(read))) view[key] = read;
  }
  return view;
}

/** The fragment of a view, without defaults. @param {View} view */
function fragmentOf(view) {
  const parts = new URLSearchParams();
  for (const [key, value] of Object.entries(view)) {
    if (String(value) === String(DEFAULT_VIEW[/** @type {keyof View} */ (key)])) continue;
    parts.set(key, typeof value === "boolean" ? (value ? "1" : "0") : rounded(value));
  }
  return `#${String(parts).replaceAll("%2C", ",")}`;
}

/** @param {unknown} value */
function rounded(value) {
  return typeof value === "number" ? String(Number(value.toFixed(3))) : String(value);
}
