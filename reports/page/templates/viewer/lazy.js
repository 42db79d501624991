// Scenes wait as text, in <noscript>, until they are opened: a page of many scenes loads fast, and
// a browser without scripts shows them all.

/** The section of a scene, made when first requested; null if there is none. @param {string} id */
function sectionOf(id) {
  const waiting = document.querySelector(`noscript[data-scene="${CSS.escape(id)}"]`);
  if (waiting) waiting.outerHTML = waiting.textContent ?? "";
  return document.getElementById(`scene=${id}`);
}

/** Draw a scene's pictures for printing, from the numbers in the page. @param {Viewer} viewer */
function listenToPrinting(viewer) {
  const draw = () => {
    drawPictures(viewer);
    for (const part of document.querySelectorAll(".scene.open details")) part.setAttribute("open", "");
  };
  window.addEventListener("beforeprint", draw);
  matchMedia("print").addEventListener("change", draw);
}

/** @param {Viewer} viewer */
function drawPictures({ painter }) {
  if (!painter) return;
  for (const canvas of document.querySelectorAll(".scene.open canvas[data-picture]")) {
    const picture = /** @type {HTMLCanvasElement} */ (canvas);
    const name = picture.dataset.picture ?? "";
    const map = painter.page.maps.find((one) => one.name === name);
    picture.getContext("2d")?.drawImage(map ? painter.map(name, map.top) : painter.rendering(name, "clip", 1), 0, 0);
  }
}
