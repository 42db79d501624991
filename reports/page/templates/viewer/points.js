// The pictures of the cost chart's points: one is shown at hover and focus, and kept by a click.

/** Distance within which a pointer or finger reaches a point (CSS pixels). */
const NEAR = 24;

/** @typedef {{sheet: string, width: number, height: number, columns: number, points: {method: string, samples: string, time: string, error: string}[]}} Measurements */

/** Let a drawn chart show its points' pictures, if it has any. @param {Element} chart */
async function makePoints(chart) {
  const panel = /** @type {HTMLElement | null | undefined} */ (chart.closest("figure")?.querySelector(".points"));
  if (!panel) return;
  /** @type {Measurements} */
  const { points, ...sheet } = JSON.parse(panel.querySelector("script")?.textContent ?? "{}");
  const picture = Object.assign(new Image(), { src: sheet.sheet });
  await picture.decode();
  // Vega draws the points in the order of its data, which is that of the record.
  const marks = /** @type {SVGElement[]} */ ([...chart.querySelectorAll(".mark-symbol path")]);
  let kept = 0;

  /** @param {string} name @returns {HTMLElement} */
  const part = (name) => /** @type {HTMLElement} */ (panel.querySelector(`[data-point=${name}]`));

  /** @param {string} name @param {number} place */
  function draw(name, place) {
    const { width, height, columns } = sheet;
    const from = [(place % columns) * width, Math.floor(place / columns) * height];
    /** @type {HTMLCanvasElement} */ (part(name)).getContext("2d")?.drawImage(picture, from[0], from[1], width, height, 0, 0, width, height);
  }

  /** @param {number} place */
  const inWords = (place) => `${points[place].method}, ${numbers(place)}`;
  /** @param {number} place */
  const numbers = (place) => `${points[place].samples}: ${points[place].time}, mean ΔE2000 ${points[place].error}`;

  /** @param {number} place */
  function show(place) {
    draw("seen", place);
    part("seen").setAttribute("aria-label", `Picture of ${inWords(place)}`);
    part("method").textContent = points[place].method;
    part("numbers").textContent = numbers(place);
    marks.forEach((mark, each) => mark.classList.toggle("shown", each === place));
  }

  /** @param {number} place */
  function keep(place) {
    kept = place;
    marks.forEach((mark, each) => {
      mark.setAttribute("aria-pressed", String(each === place));
      mark.setAttribute("tabindex", each === place ? "0" : "-1");
    });
    show(place);
  }

  /** The point nearest to a pointer, or -1. @param {MouseEvent} event */
  function near({ clientX, clientY }) {
    const far = marks.map((mark) => {
      const { left, right, top, bottom } = mark.getBoundingClientRect();
      return Math.hypot(clientX - (left + right) / 2, clientY - (top + bottom) / 2);
    });
    const least = Math.min(...far);
    return least <= NEAR ? far.indexOf(least) : -1;
  }

  chart.addEventListener("pointermove", (event) => {
    const place = near(/** @type {PointerEvent} */ (event));
    show(place < 0 ? kept : place);
  });
  chart.addEventListener("pointerleave", () => show(kept));
  chart.addEventListener("click", (event) => {
    const place = near(/** @type {MouseEvent} */ (event));
    if (place >= 0) keep(place);
  });
  marks.forEach((mark, place) => {
    mark.setAttribute("role", "button");
    mark.setAttribute("aria-label", inWords(place));
    mark.addEventListener("focus", () => show(place));
    mark.addEventListener("blur", () => show(kept));
    mark.addEventListener("keydown", (event) => {
      const { key } = /** @type {KeyboardEvent} */ (event);
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[key];
      if (step) marks[(place + step + marks.length) % marks.length].focus();
      else if (key === "Enter" || key === " ") keep(place);
      else return;
      event.preventDefault();
    });
  });
  revealMarks(chart, marks[0]);
  draw("reference", points.length);
  keep(0);
  panel.dataset.ready = "yes";
}

/** Tell assistive technology of the points, and still hide axes and lines. @param {Element} chart @param {Element} mark one of the points */
function revealMarks(chart, mark) {
  chart.setAttribute("role", "group");
  const svg = /** @type {Element} */ (chart.querySelector("svg"));
  for (const one of svg.querySelectorAll("[aria-hidden]")) if (one.contains(mark)) one.removeAttribute("aria-hidden");
  svg.removeAttribute("aria-hidden");
  mark.parentElement?.setAttribute("role", "group");
  mark.parentElement?.removeAttribute("aria-roledescription");
  for (const one of svg.querySelectorAll("g[class*=mark-], g.role-axis, text")) if (!one.contains(mark)) one.setAttribute("aria-hidden", "true");
}
