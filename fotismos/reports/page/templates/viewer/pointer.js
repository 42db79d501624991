// Mouse, pen and fingers on the canvas: the divide, selection, pan, wheel and pinch, hover and tap.

/** Most movement of a tap (CSS pixels), and milliseconds without the wheel that end its gesture. */
const TAP = 5;
const GESTURE = 200;

/** @param {Viewer} viewer */
function listenToPointers(viewer) {
  const { canvas } = viewer;
  /** Pointers that are down, by id. @type {Map<number, number[]>} */
  const down = new Map();
  let moved = 0;
  let rest = 0;
  /** Where a selection begins. @type {number[] | null} */
  let corner = null;

  const placeIn = (/** @type {MouseEvent} */ event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };

  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, placeIn(event));
    if (down.size > 1) return;
    moved = 0;
    corner = viewer.selecting || event.shiftKey ? placeIn(event) : null;
  });

  canvas.addEventListener("pointermove", event => {
    const at = placeIn(event);
    const before = down.get(event.pointerId);
    if (!before) return viewer.hover(at);
    const [right, low] = [at[0] - before[0], at[1] - before[1]];
    moved += Math.hypot(right, low);
    if (down.size > 1) pinch(viewer, [...down.values()], before, at);
    else if (moved > TAP && corner) viewer.select(corner, at);
    else if (moved > TAP && viewer.view.mode === "split" && viewer.view.zoom === null)
      viewer.change({ split: clamp(at[0] / canvas.clientWidth, 0, 1) }, true);
    else if (moved > TAP) viewer.change(viewer.viewport.panned(viewer.view, right, low), true);
    down.set(event.pointerId, at);
  });

  canvas.addEventListener("pointerup", event => {
    if (moved <= TAP && down.size === 1) viewer.tap(placeIn(event));
    else viewer.change({}); // keep the view after a drag in the address
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, event =>
      down.delete(/** @type {PointerEvent} */ (event).pointerId),
    );
  }
  canvas.addEventListener("pointerleave", () => viewer.hover(null));

  canvas.addEventListener(
    "wheel",
    event => {
      // The wheel scrolls the page, unless the picture was clicked.
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== canvas) return;
      event.preventDefault();
      viewer.change(
        viewer.viewport.zoomed(viewer.view, 2 ** (-event.deltaY / 240), placeIn(event)),
        true,
      );
      clearTimeout(rest);
      rest = setTimeout(() => viewer.change({}), GESTURE); // one address for the whole gesture
    },
    { passive: false },
  );
}

/**
 * Two fingers: the one that moved changes their distance and their middle.
 * @param {Viewer} viewer
 * @param {number[][]} fingers
 * @param {number[]} before
 * @param {number[]} after
 */
function pinch(viewer, fingers, before, after) {
  const other = fingers.find(finger => finger !== before) ?? after;
  const [from, to] = [before, after].map(finger =>
    Math.hypot(finger[0] - other[0], finger[1] - other[1]),
  );
  const middle = [(after[0] + other[0]) / 2, (after[1] + other[1]) / 2];
  viewer.change(viewer.viewport.zoomed(viewer.view, to / Math.max(from, 1), middle), true);
  viewer.change(
    viewer.viewport.panned(viewer.view, (after[0] - before[0]) / 2, (after[1] - before[1]) / 2),
    true,
  );
}
