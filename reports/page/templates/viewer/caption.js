// The strip below a saved picture: its legends, and what it shows.

/** Heights in CSS pixels of a legend and of a line of text. */
const LEGEND_HEIGHT = 34, LINE_HEIGHT = 18;

const CAPTION = { ground: "#fff", ink: "#1c1e21", font: "12px system-ui, sans-serif" };

/** The canvas of a viewer with its legends and a line below. @param {Viewer} viewer */
function captioned(viewer) {
  const { canvas, element } = viewer;
  const { clientWidth: width, clientHeight: height } = canvas;
  const legends = /** @type {HTMLElement[]} */ ([...element.querySelectorAll(".legend:not([hidden])")]);
  const whole = document.createElement("canvas");
  const context = /** @type {CanvasRenderingContext2D} */ (whole.getContext("2d"));
  context.font = CAPTION.font;
  const lines = wrapped(context, captionText(viewer), width - 16);
  const density = canvas.width / width;
  whole.width = canvas.width;
  whole.height = canvas.height + Math.round(density * (LEGEND_HEIGHT * legends.length + LINE_HEIGHT * lines.length + 12));
  context.fillStyle = CAPTION.ground;
  context.fillRect(0, 0, whole.width, whole.height);
  context.drawImage(canvas, 0, 0);
  context.setTransform(density, 0, 0, density, 0, 0);
  context.font = CAPTION.font;
  context.textBaseline = "top";
  let top = height + 8;
  for (const legend of legends) {
    drawLegend(context, legend, viewer, top);
    top += LEGEND_HEIGHT;
  }
  context.fillStyle = CAPTION.ink;
  lines.forEach((line, place) => context.fillText(line, 8, top + place * LINE_HEIGHT));
  return whole;
}

/** Scene, mode, metric with its range, exposure. @param {Viewer} viewer */
function captionText(viewer) {
  const { scene, view, painter, page } = viewer;
  const map = mapOf(page, view.map);
  const [low, high] = labelsOf(map, viewer.top()).filter((_, place) => place !== 1).map((label) => label.replace(/[≤≥] /, ""));
  const isMapped = view.mode === "side" || view.mode === "error";
  const parts = [viewer.description().replace(/\. Press.*/, "")];
  if (isMapped && hasRange(map)) parts.push(`${map.title} from ${low} to ${high}`);
  if (view.mode !== "error") {
    parts.push(`exposure × ${plainly((painter?.exposure ?? 1) * 2 ** view.ev)}`);
    if (view.best) parts.push(`${scene.judged.name} ${gainText(gainOf(scene, view))}`);
  }
  return parts.join(" · ");
}

/** @param {CanvasRenderingContext2D} context @param {HTMLElement} legend @param {Viewer} viewer @param {number} top */
function drawLegend(context, legend, { painter, canvas, page }, top) {
  const width = Math.min(canvas.clientWidth - 16, 420);
  let left = 8;
  for (const key of legend.querySelectorAll(".key")) {
    context.fillStyle = getComputedStyle(/** @type {Element} */ (key.querySelector("i"))).backgroundColor;
    context.fillRect(left, top, 12, 12);
    context.fillStyle = CAPTION.ink;
    context.fillText(key.textContent ?? "", left + 17, top);
    left += 32 + context.measureText(key.textContent ?? "").width;
  }
  if (!legend.querySelector(".bar")) return;
  const name = legend.dataset.legend ?? "";
  const table = name === "false" ? "value" : mapOf(page, name).kind === "ratio" ? "signed" : "error";
  painter?.tables[table].forEach((/** @type {number} */ colour, /** @type {number} */ place) => {
    context.fillStyle = `rgb(${colour & 255} ${(colour >> 8) & 255} ${(colour >> 16) & 255})`;
    context.fillRect(8 + (place * width) / 256, top, width / 256 + 1, 10);
  });
  const labels = [...legend.querySelectorAll(".labels span")].map((label) => label.textContent ?? "");
  context.fillStyle = CAPTION.ink;
  labels.forEach((text, place) => {
    const free = width - context.measureText(text).width;
    context.fillText(text, 8 + (free * place) / (labels.length - 1), top + 14);
  });
}

/** @param {CanvasRenderingContext2D} context @param {string} text @param {number} width */
function wrapped(context, text, width) {
  const lines = [""];
  for (const word of text.split(" ")) {
    const longer = `${lines[lines.length - 1]} ${word}`.trim();
    if (context.measureText(longer).width <= width) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}
