// What the page says of itself: its scenes, and its maps in their order.

const page = JSON.parse(document.getElementById("page-data")?.textContent ?? "{}");

/** A map by its name; undefined where there is none. @param {any} page @param {string} name */
function mapOf(page, name) {
  return page.maps.find((/** @type {any} */ map) => map.name === name);
}
