// The view is kept in the fragment of the address: it can be sent, and the browser's arrows work.

/**
 * @typedef {object} View
 * @property {string} scene       the id of a scene; empty for the overview
 * @property {number} t           the threshold of visible differences
 * @property {string} mode        side, split or error
 * @property {string} map
 * @property {number} ev          exposure in stops, relative to the comparison's
 * @property {number | null} zoom screen pixels per image pixel; null to fit
 * @property {number | null} x    the centre of a zoomed view, in pixels of the image
 * @property {number | null} y
 * @property {number} split       place of the divide, 0 to 1
 * @property {number[] | null} pixel the marked pixel; null for the worst
 * @property {number[] | null} box  the selection: left, top, width and height in pixels of the
 * image
 * @property {number[] | null} on    the effects that are switched on
 * @property {string} live   the numbers that were moved by hand, as `Numbers` writes them
 */

/** @type {View} */
const DEFAULT_VIEW = Object.freeze({
  scene: "",
  t: page.usual,
  mode: "side",
  map: "dE2000",
  ev: 0,
  zoom: null,
  x: null,
  y: null,
  split: 0.5,
  pixel: null,
  box: null,
  on: null,
  live: "",
});

/**
 * Functions that read properties; null if the text makes no sense.
 * @type {Record<string, (text: string) => any>}
 */
const READERS = {
  t: text => (page.thresholds.includes(Number(text)) ? Number(text) : null),
  mode: text => (["side", "split", "error"].includes(text) ? text : null),
  map: text => (page.maps.some(map => map.name === text) ? text : null),
  ev: numberIn(-8, 8),
  zoom: numberIn(1e-3, 1e3),
  x: numberIn(0, 1e6),
  y: numberIn(0, 1e6),
  split: numberIn(0, 1),
  pixel: numbersOf(/^\d+,\d+$/),
  box: numbersOf(/^\d+,\d+,[1-9]\d*,[1-9]\d*$/),
  on: numbersOf(/^\d+(,\d+)*$/),
};

/** @param {number} low @param {number} high */
function numberIn(low, high) {
  return (/** @type {string} */ text) =>
    text.trim() && Number(text) >= low && Number(text) <= high ? Number(text) : null;
}

/** @param {RegExp} form */
function numbersOf(form) {
  return (/** @type {string} */ text) => (form.test(text) ? text.split(",").map(Number) : null);
}

/**
 * The view of a fragment; missing or wrong properties have their defaults.
 * @param {string} text
 * @returns {View}
 */
function parseFragment(text) {
  /** @type {any} */
  const view = { ...DEFAULT_VIEW };
  for (const [key, value] of new URLSearchParams(text.replace(/^#/, ""))) {
    if (!Object.hasOwn(DEFAULT_VIEW, key)) continue;
    view[key] = (READERS[key] ? READERS[key](value) : value) ?? view[key];
  }
  return view;
}

/** The fragment of a view, without defaults. @param {View} view */
function fragmentOf(view) {
  const parts = new URLSearchParams();
  for (const [key, value] of Object.entries(view)) {
    if (String(value) === String(DEFAULT_VIEW[/** @type {keyof View} */ (key)])) continue;
    parts.set(key, typeof value === "number" ? String(Number(value.toFixed(3))) : String(value));
  }
  return `#${String(parts).replaceAll("%2C", ",").replaceAll("%3A", ":")}`;
}

/**
 * `go` shows another view, from which the browser's back button returns; `replace` makes no entry
 * in
 * the history. A notebook's frame must not change the notebook's address, and keeps its own.
 * @typedef {{read: () => string, go: (next: string) => void, replace: (next: string) => void,
 * listen: (seen: () => void) => void}} Address
 */

/** @returns {Address} */
function makeAddress() {
  if (location.protocol !== "about:") {
    history.scrollRestoration = "manual"; // the view knows its places
    return {
      read: () => location.hash,
      go: fragment => {
        location.hash = fragment;
      },
      replace: fragment => history.replaceState(null, "", fragment),
      listen: seen => window.addEventListener("hashchange", seen),
    };
  }
  let fragment = "";
  /** @type {() => void} */
  let tell = () => {};
  const go = (/** @type {string} */ next) => {
    fragment = next;
    tell();
  };
  document.addEventListener("click", event => {
    const link = /** @type {HTMLElement} */ (event.target).closest('a[href^="#"]');
    if (!link) return;
    event.preventDefault();
    go(link.getAttribute("href") ?? "");
  });
  return {
    read: () => fragment,
    go,
    replace: next => {
      fragment = next;
    },
    listen: seen => {
      tell = seen;
    },
  };
}
