// The page's data: its scenes, and its maps in order.

const page = JSON.parse(document.getElementById("page-data")?.textContent ?? "{}");

/** The exposure of the textbook that lowers a map's mean most: its factor (1: unchanged), and both means. @param {any} scene @param {string} map */
function bestOf(scene, map) {
  return scene.best[map] ?? scene.best[page.maps[0].name];
}

/** The factor on the textbook's image in a view. @param {any} scene @param {View} view */
function gainOf(scene, view) {
  return view.best ? bestOf(scene, view.map).factor : 1;
}

/** A factor on the textbook's image, in words. @param {number} gain */
function gainText(gain) {
  const rounded = plainly(Number(gain.toPrecision(3)));
  return rounded === "1" ? "at the same exposure" : `× ${rounded}`;
}

/** The map with a name, or undefined. @param {any} page @param {string} name */
function mapOf(page, name) {
  return page.maps.find((/** @type {any} */ map) => map.name === name);
}
