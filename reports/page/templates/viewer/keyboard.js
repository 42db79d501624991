// Keys; the table in help.html.j2 says the same to people.

/** @param {Viewer} viewer @param {(step: number) => void} turn to another scene @param {() => void} leave to the overview */
function listenToKeys(viewer, turn, leave) {
  const next = (/** @type {"map" | "tone"} */ control) => {
    const options = [.../** @type {HTMLSelectElement} */ (viewer.element.querySelector(`[data-control=${control}]`)).options].filter((option) => !option.disabled);
    const place = options.findIndex((option) => option.value === viewer.view[control]);
    viewer.change({ [control]: options[(place + 1) % options.length].value });
  };
  const expose = (/** @type {number} */ stops) => viewer.change({ ev: clamp(viewer.view.ev + stops, -8, 8) });
  const divide = (/** @type {number} */ by) => viewer.change({ split: clamp(viewer.view.split + by, 0, 1) });

  /** @type {Record<string, () => void>} */
  const keys = {
    1: () => viewer.change({ mode: "split" }),
    2: () => viewer.change({ mode: "flicker" }),
    3: () => viewer.change({ mode: "side" }),
    4: () => viewer.change({ mode: "error" }),
    f: () => (viewer.view.mode === "flicker" ? viewer.swap() : viewer.change({ mode: "flicker" })),
    m: () => next("map"),
    t: () => next("tone"),
    r: () => viewer.act("boxes"),
    "+": () => viewer.act("zoom-in"),
    "=": () => viewer.act("zoom-in"),
    "-": () => viewer.act("zoom-out"),
    0: () => viewer.act("fit"),
    9: () => viewer.act("pixels"),
    "[": () => expose(-0.5),
    "]": () => expose(0.5),
    "\\": () => viewer.act("ev-reset"),
    ",": () => divide(-0.02),
    ".": () => divide(0.02),
    n: () => turn(1),
    p: () => turn(-1),
    o: leave,
    Escape: () => (viewer.view.pixel ? viewer.change({ pixel: null }) : leave()),
  };
  /** On the canvas alone: elsewhere these scroll the page. @type {Record<string, number[]>} */
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target)) return;
    if (event.key === "?") return openHelp();
    if (!viewer.view.scene) return;
    const arrow = event.target === viewer.canvas && arrows[event.key];
    if (arrow) viewer.step(arrow[0] * (event.shiftKey ? 10 : 1), arrow[1] * (event.shiftKey ? 10 : 1));
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
