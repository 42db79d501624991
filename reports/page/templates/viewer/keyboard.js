// Keys; help.html.j2 explains them to people.

/** @param {Viewer} viewer @param {(step: number) => void} turn to another scene @param {() => void} leave to the overview */
function listenToKeys(viewer, turn, leave) {
  const next = (/** @type {"map" | "tone" | "top"} */ control) => {
    if (!viewer.controls.enabled(control)) return;
    const options = [.../** @type {HTMLSelectElement} */ (viewer.element.querySelector(`[data-control=${control}]`)).options].filter((option) => !option.disabled);
    const place = options.findIndex((option) => option.value === String(viewer.view[control] ?? ""));
    const { value } = options[(place + 1) % options.length];
    viewer.change(changeOf({ value, dataset: { control } }));
  };
  const press = (/** @type {string} */ action) => viewer.controls.enabled(action) && viewer.act(action);
  const expose = (/** @type {number} */ stops) => viewer.controls.enabled("ev") && viewer.change({ ev: clamp(viewer.view.ev + stops, -8, 8) });
  const divide = (/** @type {number} */ by) => viewer.view.mode === "split" && viewer.change({ split: clamp(viewer.view.split + by, 0, 1) });
  const back = () => {
    if (viewer.selecting) viewer.selectBy(false);
    else if (viewer.view.box || viewer.view.band) viewer.change({ box: null, band: null });
    else if (viewer.view.pixel) viewer.change({ pixel: null });
    else leave();
  };

  /** @type {Record<string, () => void>} */
  const keys = {
    1: () => viewer.change({ mode: "split" }),
    2: () => viewer.change({ mode: "flicker" }),
    3: () => viewer.change({ mode: "side" }),
    4: () => viewer.change({ mode: "error" }),
    f: () => (viewer.view.mode === "flicker" ? viewer.swap() : viewer.change({ mode: "flicker" })),
    m: () => next("map"),
    t: () => next("tone"),
    c: () => next("top"),
    b: () => press("best"),
    s: () => press("select"),
    d: () => press("save"),
    r: () => press("boxes"),
    "+": () => press("zoom-in"),
    "=": () => press("zoom-in"),
    "-": () => press("zoom-out"),
    0: () => press("fit"),
    9: () => press("pixels"),
    "[": () => expose(-0.5),
    "]": () => expose(0.5),
    "\\": () => expose(-viewer.view.ev),
    ",": () => divide(-0.02),
    ".": () => divide(0.02),
    n: () => turn(1),
    p: () => turn(-1),
    o: leave,
    Escape: back,
  };
  /** Only on the canvas: elsewhere these scroll the page. @type {Record<string, number[]>} */
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target)) return;
    if (event.key === "?") return openHelp();
    if (!viewer.view.scene) return;
    const arrow = event.target === viewer.canvas && arrows[event.key];
    const [right, down] = (arrow || []).map((step) => step * (event.shiftKey ? 10 : 1));
    if (arrow) viewer.selecting ? viewer.stretch(right, down) : viewer.step(right, down);
    else if (event.key === " " && event.target === viewer.canvas) viewer.act("swap");
    else if (keys[event.key]) keys[event.key]();
    else return;
    event.preventDefault();
  });
}

/** @param {EventTarget | null} target */
function isTyping(target) {
  return target instanceof Element && target.closest("input, select, textarea, dialog") !== null;
}

function openHelp() {
  const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("help"));
  if (!dialog.open) dialog.showModal();
}
