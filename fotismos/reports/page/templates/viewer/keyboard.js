// Keys; help.html.j2 explains them to people.

/**
 * @param {Viewer} viewer
 * @param {(step: number) => void} turn to another scene
 * @param {() => void} leave to the overview
 */
function listenToKeys(viewer, turn, leave) {
  const nextMap = () => {
    const usable = page.maps.filter(map => map.kind !== "effects" || viewer.scene.effects);
    viewer.change({ map: usable[(usable.indexOf(viewer.map()) + 1) % usable.length].name });
  };
  const nextThreshold = (/** @type {number} */ step) =>
    viewer.change({
      t: page.thresholds[clamp(placeOf(viewer.view.t) + step, 0, page.thresholds.length - 1)],
    });
  const back = () => {
    if (viewer.selecting) viewer.act("select");
    else if (viewer.view.box || viewer.view.on) viewer.change({ box: null, on: null });
    else if (viewer.view.pixel) viewer.change({ pixel: null });
    else leave();
  };

  /** @type {Record<string, () => void>} */
  const keys = {
    1: () => viewer.change({ mode: "side" }),
    2: () => viewer.change({ mode: "split" }),
    3: () => viewer.change({ mode: "error" }),
    m: nextMap,
    "[": () => nextThreshold(-1),
    "]": () => nextThreshold(1),
    s: () => viewer.act("select"),
    "+": () => viewer.act("zoom-in"),
    "=": () => viewer.act("zoom-in"),
    "-": () => viewer.act("zoom-out"),
    0: () => viewer.act("fit"),
    n: () => turn(1),
    p: () => turn(-1),
    o: leave,
    Escape: back,
  };
  /** Only on the canvas: elsewhere these scroll the page. @type {Record<string, number[]>} */
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

  document.addEventListener("keydown", event => {
    const typing = event.target instanceof Element && event.target.closest("input, select, dialog");
    if (event.ctrlKey || event.metaKey || event.altKey || typing) return;
    if (event.key === "?") return openHelp();
    if (!viewer.view.scene) return;
    const arrow = event.target === viewer.canvas && arrows[event.key];
    if (arrow)
      viewer.step(arrow[0] * (event.shiftKey ? 10 : 1), arrow[1] * (event.shiftKey ? 10 : 1));
    else if (keys[event.key]) keys[event.key]();
    else return;
    event.preventDefault();
  });
}

function openHelp() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("help"));
  if (!dialog.open) dialog.showModal();
}
