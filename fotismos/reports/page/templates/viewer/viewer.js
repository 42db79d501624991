// The viewer of one scene: its state, its controls, and when it is drawn.

class Viewer {
  /**
   * @param {HTMLElement} element the canvas and its controls
   * @param {(changes: Partial<View>, passing?: boolean) => void} change requests a view of the page
   */
  constructor(element, change) {
    this.element = element;
    this.change = change;
    this.canvas = /** @type {HTMLCanvasElement} */ (element.querySelector("canvas[tabindex]"));
    this.drawing = new Drawing(this.canvas);
    this.viewport = new Viewport(1, 1);
    this.panels = new Panels(this);
    /** The open one. @type {Pictured} */
    this.scene;
    this.view = DEFAULT_VIEW;
    /** @type {Painter | null} */
    this.painter = null;
    /** @type {Switches | null} */
    this.switches = null;
    /** @type {number[] | null} */
    this.hovered = null;
    this.selecting = this.pending = false;
    element.addEventListener("click", event => {
      const { mode, action, effect } =
        /** @type {HTMLElement} */ (event.target).closest("button")?.dataset ?? {};
      if (mode) change({ mode });
      if (action) this.act(action);
      if (effect && this.switches)
        change({ on: this.switches.after(this.view.on, Number(effect)) });
    });
    for (const control of this.fields()) {
      control.addEventListener("input", () =>
        change({
          [control.dataset.control ?? ""]:
            control.type === "range" ? Number(control.value) : control.value,
        }),
      );
    }
    listenToPointers(this);
    new ResizeObserver(() => this.redraw()).observe(element);
  }

  /** @returns {NodeListOf<HTMLInputElement>} */
  fields() {
    return this.element.querySelectorAll("[data-control]");
  }

  /** @param {string} selector @returns {HTMLElement} */
  part(selector) {
    return /** @type {HTMLElement} */ (this.element.querySelector(selector));
  }

  /**
   * Open a scene in its section of the page.
   * @param {Pictured} scene
   * @param {HTMLElement} section
   */
  async open(scene, section) {
    Object.assign(this, { scene, painter: null, switches: null, hovered: null, selecting: false });
    this.viewport = new Viewport(scene.width, scene.height);
    section.querySelector(".viewer-slot")?.append(this.element);
    section.querySelector(".side")?.prepend(...this.panels.elements);
    for (const part of [this.element, ...this.panels.elements]) part.hidden = false;
    this.element.dataset.ready = "";
    this.part("[data-part=switches]").hidden = !scene.board;
    const waiting = scene.board && imagesIn(`data-board-${scene.id}`, scene.board.images);
    const [images, small] = await Promise.all([
      imagesIn(`data-${scene.id}`, scene.images),
      waiting,
    ]);
    if (this.scene !== scene) return; // another one was opened meanwhile
    this.painter = new Painter(scene, images);
    this.switches = scene.board && small && new Switches(this.painter, scene.board, small);
    this.part("[data-part=switches] .choices").replaceChildren(...(this.switches?.buttons ?? []));
    this.element.dataset.ready = scene.id;
    this.show(this.view);
  }

  /** @param {View} view */
  show(view) {
    const without = !this.scene.effects && view.map === "effects";
    this.view = without ? { ...view, map: DEFAULT_VIEW.map } : view;
    for (const button of elementsIn("button[data-mode]", this.element))
      button.setAttribute("aria-pressed", String(button.dataset.mode === view.mode));
    this.part("[data-action=select]").setAttribute("aria-pressed", String(this.selecting));
    const option = /** @type {HTMLOptionElement} */ (this.part("option[value=effects]"));
    option.hidden = option.disabled = !this.scene.effects;
    for (const field of this.fields())
      field.value = String(this.view[/** @type {"map" | "ev"} */ (field.dataset.control)]);
    this.part("[data-control=ev] + output").textContent =
      `${view.ev > 0 ? "+" : ""}${view.ev}`.replace("-", "−");
    this.redraw();
  }

  /** @returns {MapOf} */
  map() {
    return /** @type {MapOf} */ (page.maps.find(map => map.name === this.view.map));
  }

  /** The part of the selection in the image, or null. @returns {number[] | null} */
  box() {
    const [x, y, w, h] = this.view.box ?? [0, 0, 0, 0];
    const [width, height] = [Math.min(w, this.scene.width - x), Math.min(h, this.scene.height - y)];
    return width > 0 && height > 0 ? [x, y, width, height] : null;
  }

  /** The pixel at the pointer, or the marked one, or the worst. @returns {number[]} */
  pixel() {
    const { width, height } = this.scene;
    const [x, y] = this.hovered ?? this.view.pixel ?? this.scene.worst.pixel;
    return [Math.min(x, width - 1), Math.min(y, height - 1)];
  }

  /** Draw once before the next frame, however often requested. */
  redraw() {
    if (this.pending || !this.painter) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.paint();
    });
  }

  paint() {
    const { painter, shown, added, scene, view } = this;
    if (!painter || !shown || !this.canvas.clientWidth) return;
    const map = added ? page.maps[0] : this.map();
    const box = this.box();
    const textbook = { picture: painter.rendering("heuristic", view.ev), title: scene.judged.name };
    const more = added
      ? [
          {
            picture: added.painter.sharp(view.ev),
            title: `+ ${added.name}`,
          },
        ]
      : [];
    const physical = { picture: painter.rendering("reference", view.ev), title: scene.truth.name };
    const kind = map.kind === "difference" ? "error" : map.title;
    const error = {
      picture: shown.picture("map", `${map.name} ${view.t}`, shown.colours(map, view.t)),
      title: added ? "error left" : kind,
    };
    const contents = {
      side: [textbook, ...more, physical, error],
      split: [more[0] ?? textbook, physical],
    }[view.mode] ?? [error];
    /** @type {[number[], string][]} */
    const outlines = scene.regions
      .slice(0, 1)
      .map(({ x, y, width, height }) => [[x, y, width, height], OVERLAY.worst]);
    if (box) outlines.push([box, OVERLAY.selection]);
    outlines.push([[...(view.pixel ?? this.scene.worst.pixel), 1, 1], OVERLAY.line]);
    this.drawing.draw(view, this.viewport, contents, outlines);
    this.canvas.style.touchAction = view.zoom === null && !this.selecting ? "pan-y" : "none";
    this.canvas.setAttribute(
      "aria-label",
      `${scene.name}: ${contents.map(one => one.title).join(", ")}. Press ? for the keys.`,
    );
    this.part("[data-part=numbers]").textContent = this.numbers(added);
    for (const heading of document.querySelectorAll("[data-truth]"))
      heading.textContent = scene.truth.title;
    for (const one of document.querySelectorAll("[data-judged]"))
      one.textContent = `${scene.judged.title}${added ? " +" : ""}`;
    this.switches?.show(view.on);
    this.panels.show();
    showLegend(this.part(".legend"), this);
  }

  /** The textbook with the effects that are on, or null. */
  get added() {
    return (this.view.on && this.switches?.find(this.view.on)) ?? null;
  }

  /** The painter of the picture that is judged. */
  get shown() {
    return this.added?.painter ?? this.painter;
  }

  /** What the effects that are on change, in the small pictures. @param {Added | null} added */
  numbers(added) {
    const { view } = this;
    const none = added && this.switches?.find([]);
    if (!none) return "";
    const [before, after] = [none, added].map(({ painter }) =>
      percentText(summarise(painter, null, view.t).visible),
    );
    const { width, height } = none.painter.images;
    const share = `${before} → ${after} of the pixels differ visibly, with noise`;
    const mean = `mean without noise ${none.mean} → ${added.mean}`;
    return `${share}; ${mean}; at ${width} × ${height}`;
  }

  /** @param {number[] | null} place */
  hover(place) {
    this.hovered = place && this.viewport.pixelAt(this.view, place);
    if (this.painter) this.panels.inspect();
  }

  /**
   * Select the rectangle between two places of the canvas.
   * @param {number[]} from
   * @param {number[]} to
   */
  select(from, to) {
    const [a, b] = [from, to].map(place => this.viewport.pixelAt(this.view, place));
    const size = a.map((value, axis) => Math.abs(value - b[axis]) + 1);
    this.change({ box: [...a.map((value, axis) => Math.min(value, b[axis])), ...size] }, true);
  }

  /** Mark a pixel; clear the selection when selecting. @param {number[]} place */
  tap(place) {
    this.change(
      this.selecting ? { box: null } : { pixel: this.viewport.pixelAt(this.view, place) },
    );
  }

  /**
   * Move the marked pixel, or the far corner of the selection.
   * @param {number} right
   * @param {number} down
   */
  step(right, down) {
    const { width, height } = this.scene;
    const [x, y] = this.view.pixel ?? this.scene.worst.pixel;
    if (!this.selecting)
      return this.change({
        pixel: [clamp(x + right, 0, width - 1), clamp(y + down, 0, height - 1)],
      });
    const [left, top, w, h] = this.box() ?? [x, y, 1, 1];
    this.change({
      box: [left, top, clamp(w + right, 1, width - left), clamp(h + down, 1, height - top)],
    });
  }

  /** Zoom about the marked pixel. @param {number} factor */
  zoomBy(factor) {
    const [x, y] = this.pixel();
    const [left, top] = this.viewport.frame(this.view, this.viewport.panes[0], [
      x + 0.5,
      y + 0.5,
      0,
      0,
    ]);
    this.change(this.viewport.zoomed(this.view, factor, [left, top]));
  }

  /** Do the action of a button or a key. @param {string} action */
  act(action) {
    if (action === "zoom-in") this.zoomBy(Math.SQRT2);
    if (action === "zoom-out") this.zoomBy(Math.SQRT1_2);
    if (action === "fit") this.change({ zoom: null, x: null, y: null });
    if (action === "help") openHelp();
    if (action === "select") {
      this.selecting = !this.selecting;
      this.change({});
    }
  }
}

/** The meaning of the map's colours. @param {HTMLElement} legend @param {Viewer} viewer */
function showLegend(legend, { painter, view, scene }) {
  if (!painter) return;
  const { kind, title, top } = /** @type {MapOf} */ (page.maps.find(map => map.name === view.map));
  const is = view.on ? "difference" : kind;
  const hasBar = ["difference", "ratio", "metric"].includes(is);
  const key = JSON.stringify([scene.id, is, title, view.t]);
  if (legend.dataset.key === key) return;
  legend.dataset.key = key;
  const [bar, labels, words] = /** @type {HTMLElement[]} */ ([...legend.children]);
  bar.hidden = labels.hidden = !hasBar;
  if (hasBar) {
    const table = pixelsOf(is === "ratio" ? page.colours.signed : page.colours.error);
    const differences = differenceColours(view.t);
    const strip = painted(256, 1, place =>
      is === "difference" ? differences((place / 256) * TOP) : table[place],
    );
    /** @type {HTMLCanvasElement} */ (bar).getContext("2d")?.drawImage(strip, 0, 0);
    const texts =
      is === "ratio"
        ? [`≤ −${top}`, "0", `≥ +${top} stops`]
        : ["0", "", `≥ ${top}`];
    texts.forEach((text, place) => {
      labels.children[place].textContent = text;
    });
    words.textContent =
      is === "difference" ? `ΔE2000; grey up to ${view.t}, where nothing is visible` : title;
    return;
  }
  const names =
    is === "mask"
      ? ["certain to differ, however little", "not certain", "not counted", "undetermined"]
      : [...(scene.effects?.names ?? []), "no visible error"];
  const colours =
    is === "mask"
      ? page.mask.map(rgb => `rgb(${rgb})`)
      : [...(scene.effects?.colours ?? []), page.noEffect];
  words.replaceChildren(...names.map((name, place) => keyOf(name, colours[place])));
}

/** A swatch and its name. @param {string} name @param {string} colour */
function keyOf(name, colour) {
  const key = Object.assign(document.createElement("span"), { className: "key" });
  const swatch = document.createElement("i");
  swatch.style.background = colour;
  key.append(swatch, name);
  return key;
}
