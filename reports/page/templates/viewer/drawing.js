// The viewer's canvas: pictures through the viewport, and their overlays.

/** Colours of overlays, legible on any picture. */
const OVERLAY = { line: "#fff", edge: "#000a", box: "#5ef0ff", selection: "#ffd84a", label: "#000b" };

/** Pixels of the image at least this large on the screen have their values printed. */
const PRINTED_FROM = 40;

/**
 * Besides the view: `map` with its `end` and the `measure` of bands, `gain` on the first half, and how
 * that is `judged`, in a word.
 * @typedef {{swapped: boolean, regions: Region[], box: number[] | null, map: Legend & {end: number, measure: string}, gain: number, judged: string}} Extra
 */

/** @typedef {{picture: string, title: string}} Content of a pane */

/** Draws a view of a scene, without handling events. */
class Drawing {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    // What `draw` was given last:
    /** @type {View} */
    this.view;
    /** @type {Viewport} */
    this.viewport;
    /** @type {Painter} */
    this.painter;
    /** @type {Extra} */
    this.extra;
  }

  /**
   * @param {View} view
   * @param {Viewport} viewport
   * @param {Painter} painter
   * @param {Extra} extra
   */
  draw(view, viewport, painter, extra) {
    this.extra = extra;
    this.view = view;
    this.viewport = viewport;
    this.painter = painter;
    const panes = this.contents(extra);
    const width = this.canvas.clientWidth;
    const height = viewport.arrange(panes.length, width);
    this.resize(width, height);
    panes.forEach((content, place) => this.pane(viewport.panes[place], content));
    viewport.panes.forEach((pane) => this.clipped(pane, () => this.overlay(pane)));
    if (view.mode === "split") this.divide(viewport.panes[0]);
    panes.forEach((content, place) => this.titles(viewport.panes[place], content));
  }

  /** The pictures of each pane: one, or two divided. @param {Extra} extra */
  contents({ swapped, map, gain, judged }) {
    const error = { picture: "map", title: gain === 1 ? map.title : `${map.title}, without that exposure` };
    const halves = [{ picture: "heuristic", title: judged }, { picture: "reference", title: "physical" }];
    if (gain !== 1) halves[0].title += ` ${gainText(gain)}`;
    switch (this.view.mode) {
      case "side": return [...halves, error].map((one) => [one]);
      case "error": return [[error]];
      case "flicker": return [[halves[swapped ? 1 : 0]]];
      default: return [halves];
    }
  }

  /** @param {number} width @param {number} height */
  resize(width, height) {
    const density = window.devicePixelRatio || 1;
    const wanted = [Math.round(width * density), Math.round(height * density)];
    if (this.canvas.width !== wanted[0]) this.canvas.width = wanted[0];
    if (this.canvas.height !== wanted[1]) this.canvas.height = wanted[1];
    this.canvas.style.height = `${height}px`;
    this.context.setTransform(density, 0, 0, density, 0, 0);
    this.context.clearRect(0, 0, width, height);
  }

  /** @param {Box} box @param {() => void} paint */
  clipped(box, paint) {
    this.context.save();
    this.context.beginPath();
    this.context.rect(box.left, box.top, box.width, box.height);
    this.context.clip();
    paint();
    this.context.restore();
  }

  /** @param {Box} pane @param {Content[]} content */
  pane(pane, content) {
    this.clipped(pane, () => this.picture(pane, content.length === 1 ? content[0].picture : "reference"));
    if (content.length === 1) return;
    const above = { ...pane, width: pane.width * this.view.split };
    this.clipped(above, () => this.picture(pane, "heuristic"));
  }

  /** @param {Box} pane @param {string} name */
  picture(pane, name) {
    const { view, viewport, painter, extra } = this;
    const gain = 2 ** view.ev * (name === "heuristic" ? extra.gain : 1);
    const source = name === "map" ? painter.map(view.map, extra.map.end) : painter.rendering(name, view.tone, gain);
    this.image(pane, source);
    if (view.band) this.image(pane, painter.band(extra.map.measure, view.band, extra.box));
    if (viewport.zoom(view) >= PRINTED_FROM) this.print(pane, name);
  }

  /** @param {Box} pane @param {HTMLCanvasElement} source */
  image(pane, source) {
    const { view, viewport, painter } = this;
    const zoom = viewport.zoom(view) * (window.devicePixelRatio || 1);
    const [left, top] = viewport.toScreen(view, pane, 0, 0);
    const [right, bottom] = viewport.toScreen(view, pane, viewport.width, viewport.height);
    this.context.imageSmoothingEnabled = zoom * painter.images.block < 1;
    this.context.imageSmoothingQuality = "high";
    this.context.drawImage(source, left, top, right - left, bottom - top);
  }

  /** Print each pixel's values: three of a rendering, one of a map. @param {Box} pane @param {string} name */
  print(pane, name) {
    const { view, viewport, painter, context } = this;
    const { block, width } = painter.images;
    const [left, top, wide, high] = viewport.seen(view);
    const size = block * viewport.zoom(view);
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 2.5;
    context.lineJoin = "round";
    for (let row = Math.floor(top / block); row * block < top + high; row++) {
      for (let column = Math.floor(left / block); column * block < left + wide; column++) {
        const [middle, centre] = viewport.toScreen(view, pane, (column + 0.5) * block, (row + 0.5) * block);
        const lines = this.valuesAt(name, row * width + column);
        lines.forEach((text, line) => this.outlined(text, middle, centre + 13 * (line - (lines.length - 1) / 2), size - 4));
      }
    }
    context.textAlign = "left";
  }

  /** @param {string} name @param {number} place */
  valuesAt(name, place) {
    const { painter, extra } = this;
    if (name !== "map") return painter.channels(name).map((codes) => significant(VALUES[codes[place]], 2));
    return hasRange(extra.map) ? [differenceText(extra.map, painter.values(extra.map.name)[place], 2).replace(" stops", "")] : [];
  }

  /** Text legible on any colour, squeezed into a width. @param {string} text @param {number} left @param {number} top @param {number} width */
  outlined(text, left, top, width) {
    this.context.strokeStyle = OVERLAY.label;
    this.context.strokeText(text, left, top, width);
    this.context.fillStyle = OVERLAY.line;
    this.context.fillText(text, left, top, width);
  }

  /** Regions, the selection and the marked pixel. @param {Box} pane */
  overlay(pane) {
    const { regions, box } = this.extra;
    if (this.view.boxes) regions.forEach((region, place) => this.region(pane, region, place + 1));
    if (box) this.outline(...this.frame(pane, box), OVERLAY.selection);
    if (this.view.pixel) this.mark(pane, this.view.pixel);
  }

  /** @param {Box} pane @param {Region} region @param {number} number */
  region(pane, region, number) {
    const frame = this.frame(pane, [region.x, region.y, region.width, region.height]);
    this.outline(...frame, OVERLAY.box);
    this.label(String(number), frame[0] + 1, frame[1] + 1, OVERLAY.box);
  }

  /** A rectangle of the image on the screen. @param {Box} pane @param {number[]} box @returns {[number, number, number, number]} */
  frame(pane, [x, y, width, height]) {
    const [left, top] = this.viewport.toScreen(this.view, pane, x, y);
    const zoom = this.viewport.zoom(this.view);
    return [left, top, width * zoom, height * zoom];
  }

  /** @param {Box} pane @param {number[]} pixel */
  mark(pane, [x, y]) {
    const zoom = this.viewport.zoom(this.view);
    const [left, top] = this.viewport.toScreen(this.view, pane, x, y);
    const margin = Math.max(0, 4 - zoom / 2);
    this.outline(left - margin, top - margin, zoom + 2 * margin, zoom + 2 * margin, OVERLAY.line);
  }

  /** @param {number} left @param {number} top @param {number} width @param {number} height @param {string} colour */
  outline(left, top, width, height, colour) {
    const { context } = this;
    for (const [stroke, thickness] of [[OVERLAY.edge, 3], [colour, 1.25]]) {
      context.strokeStyle = /** @type {string} */ (stroke);
      context.lineWidth = /** @type {number} */ (thickness);
      context.strokeRect(left, top, width, height);
    }
  }

  /** @param {Box} pane */
  divide(pane) {
    const { context } = this;
    const at = pane.left + pane.width * this.view.split;
    context.fillStyle = OVERLAY.edge;
    context.fillRect(at - 2, pane.top, 4, pane.height);
    context.fillStyle = OVERLAY.line;
    context.fillRect(at - 1, pane.top, 2, pane.height);
    context.beginPath();
    context.arc(at, pane.top + pane.height / 2, 7, 0, 2 * Math.PI);
    context.fill();
    context.strokeStyle = OVERLAY.edge;
    context.lineWidth = 1.5;
    context.stroke();
  }

  /** @param {Box} pane @param {Content[]} content */
  titles(pane, content) {
    const bottom = pane.top + pane.height - 23;
    this.label(content[0].title, pane.left + 6, bottom);
    if (content[1]) this.label(content[1].title, pane.left + pane.width - 6, bottom, OVERLAY.line, "right");
  }

  /** @param {string} text @param {number} left @param {number} top @param {string} colour @param {"left" | "right"} align */
  label(text, left, top, colour = OVERLAY.line, align = "left") {
    const { context } = this;
    context.font = "12px system-ui, sans-serif";
    const width = context.measureText(text).width + 10;
    const start = align === "left" ? left : left - width;
    context.fillStyle = OVERLAY.label;
    context.fillRect(start, top, width, 17);
    context.fillStyle = colour;
    context.textBaseline = "middle";
    context.fillText(text, start + 5, top + 9);
  }
}
