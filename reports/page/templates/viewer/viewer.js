// The viewer of one scene: its state, its actions, and when it is drawn.

class Viewer {
  /**
   * @param {HTMLElement} element the canvas and its controls
   * @param {HTMLElement} panel the pixel inspector
   * @param {HTMLElement} brushing the panel of the selection
   * @param {Page} page
   * @param {(changes: Partial<View>, passing?: boolean) => void} change requests a view of the page
   */
  constructor(element, panel, brushing, page, change) {
    this.element = element;
    this.panel = panel;
    this.page = page;
    this.change = change;
    this.canvas = /** @type {HTMLCanvasElement} */ (element.querySelector("canvas"));
    this.drawing = new Drawing(this.canvas);
    this.viewport = new Viewport(1, 1);
    /** The open one. @type {Scene} */
    this.scene;
    /** @type {View} */
    this.view = DEFAULT_VIEW;
    /** @type {Painter | null} */
    this.painter = null;
    /** @type {number[] | null} */
    this.hovered = null;
    this.swapped = false;
    this.selecting = false;
    this.pending = false;
    /** The last details, by the event's name. @type {Map<string, string>} */
    this.told = new Map();
    this.controls = new Controls(this);
    this.distribution = new Distribution(brushing, this);
    listenToPointers(this);
    new ResizeObserver(() => this.redraw()).observe(element);
  }

  /** Open a scene in its section of the page. @param {Scene} scene @param {HTMLElement} section */
  async open(scene, section) {
    this.scene = scene;
    this.painter = null;
    this.hovered = null;
    this.swapped = this.selecting = false;
    this.viewport = new Viewport(scene.width, scene.height);
    section.querySelector(".viewer-slot")?.append(this.element);
    section.querySelector(".side")?.prepend(this.panel, this.distribution.panel);
    this.element.hidden = this.panel.hidden = this.distribution.panel.hidden = false;
    this.element.dataset.ready = "";
    for (const one of this.panel.querySelectorAll("[data-judged]")) one.textContent = scene.judged.title;
    this.offerEffects();
    const images = await imagesOf(scene.id, scene.images);
    if (this.scene !== scene) return; // another one was opened meanwhile
    this.painter = new Painter(images, scene.exposure, this.page, scene.effects);
    this.element.dataset.ready = scene.id;
    this.controls.show();
    this.redraw();
  }

  /** Offer the map of effects for scenes with an attribution. */
  offerEffects() {
    const option = /** @type {HTMLOptionElement} */ (this.element.querySelector("option[value=effects]"));
    option.hidden = option.disabled = !this.scene.effects;
    const legend = /** @type {HTMLElement} */ (this.element.querySelector("[data-legend=effects]"));
    if (this.scene.effects) listEffects(legend, this.scene.effects, this.page);
  }

  /** @param {View} view */
  show(view) {
    const known = this.page.maps.some((map) => map.name === view.map) && (view.map !== "effects" || this.scene.effects);
    this.view = known ? view : { ...view, map: DEFAULT_VIEW.map };
    this.element.dataset.mode = view.mode;
    this.controls.show();
    this.redraw();
  }

  /** The map of the numbers shown: the chosen one, or the first if that has no values. */
  measure() {
    const map = mapOf(this.page, this.view.map);
    return hasRange(map) ? map : this.page.maps[0];
  }

  /** The end of its colours. */
  top() {
    return this.view.top ?? this.automatic();
  }

  automatic() {
    const map = this.measure();
    return this.painter ? automaticRange(this.painter, map) : map.top;
  }

  /** The part of the selection in the image, or null. @returns {number[] | null} */
  box() {
    const [x, y, w, h] = this.view.box ?? [0, 0, 0, 0];
    const [width, height] = [Math.min(w, this.scene.width - x), Math.min(h, this.scene.height - y)];
    return width > 0 && height > 0 ? [x, y, width, height] : null;
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
    if (!this.painter || !this.canvas.clientWidth) return;
    const { swapped, scene } = this;
    const map = { ...mapOf(this.page, this.view.map), end: this.top(), measure: this.measure().name };
    const gain = gainOf(scene, this.view);
    this.drawing.draw(this.view, this.viewport, this.painter, { swapped, regions: scene.regions, box: this.box(), map, gain, judged: scene.judged.name });
    this.canvas.style.touchAction = this.view.zoom === null && !this.selecting ? "pan-y" : "none";
    this.controls.disable();
    this.distribution.show();
    this.canvas.setAttribute("aria-label", this.description());
    this.inspectPixel();
  }

  description() {
    const { title } = mapOf(this.page, this.view.map);
    const { subject } = this.scene.judged;
    const modes = {
      split: `${subject} on the left, physical reference on the right`,
      flicker: this.swapped ? "physical reference" : subject,
      side: `${subject}, physical reference and ${title}`,
      error: title,
    };
    return `${this.scene.name}: ${modes[/** @type {keyof modes} */ (this.view.mode)]}. Press ? for the keys.`;
  }

  /** Show the numbers of the pixel at the pointer, or else of the marked one. */
  inspectPixel() {
    const pixel = this.hovered ?? this.view.pixel;
    const known = this.painter && pixel && pixel[0] < this.scene.width && pixel[1] < this.scene.height ? pixel : null;
    showInspection(this.panel, this.painter && known ? inspect(this.painter, this.scene, known, this.view) : null);
    this.tell("pick", { scene: this.scene.id, pixel: known, marked: Boolean(known && !this.hovered) });
  }

  /**
   * Report each change to other parts of the page by a CustomEvent on the viewer's element. "pick" has
   * the detail `{scene, pixel, marked}`: the scene's id, `[x, y]` in pixels of the image or null, and
   * whether the pixel is marked (by a click or the keys) or only at the pointer.
   * @param {string} name
   * @param {object} detail
   */
  tell(name, detail) {
    const text = JSON.stringify(detail);
    if (this.told.get(name) === text) return;
    this.told.set(name, text);
    this.element.dispatchEvent(new CustomEvent(name, { detail, bubbles: true }));
  }

  /** @param {number[] | null} place */
  hover(place) {
    this.hovered = place && this.viewport.pixelAt(this.view, place[0], place[1]);
    if (this.painter) this.inspectPixel();
  }

  /** Select the rectangle between two places of the canvas. @param {number[]} from @param {number[]} to */
  select(from, to) {
    const ends = [from, to].map(([left, top]) => this.viewport.nearestPixel(this.view, left, top));
    this.change({ box: boxBetween(ends[0], ends[1]) }, true);
  }

  /** Mark a pixel, and swap flickering halves; clear the selection when selecting. @param {number[]} place */
  tap(place) {
    if (this.selecting) return this.change({ box: null });
    if (this.view.mode === "flicker") this.swap();
    this.change({ pixel: this.viewport.pixelAt(this.view, place[0], place[1]) });
  }

  /** Let drags and arrows select rectangles, or not. @param {boolean} selecting */
  selectBy(selecting) {
    this.selecting = selecting;
    this.element.classList.toggle("selecting", selecting);
    this.controls.show();
    this.redraw();
  }

  swap() {
    this.swapped = !this.swapped;
    this.redraw();
  }

  /** Whether a press grabs the divide: near it, or anywhere if the whole image is visible. @param {number} left @param {number} reach */
  dividesAt(left, reach) {
    if (this.view.mode !== "split") return false;
    const pane = this.viewport.panes[0];
    return this.view.zoom === null || Math.abs(left - pane.width * this.view.split) < reach;
  }

  /** @param {number} left */
  divideAt(left) {
    return clamp(left / this.viewport.panes[0].width, 0, 1);
  }

  /** Zoom about the marked pixel if visible, or else about the middle. @param {number} factor */
  zoomBy(factor) {
    const pane = this.viewport.panes[0];
    const [x, y] = this.view.pixel ?? this.viewport.centre(this.view);
    const at = this.viewport.toScreen(this.view, pane, x + 0.5, y + 0.5);
    const about = this.view.pixel && this.viewport.sees(at) ? at : [pane.width / 2, pane.height / 2];
    this.change(this.viewport.zoomed(this.view, factor, about));
  }

  /** Move the marked pixel, and keep it in view. @param {number} right @param {number} down */
  step(right, down) {
    const { width, height } = this.viewport;
    const [cx, cy] = this.viewport.centre(this.view).map(Math.floor);
    const [x, y] = this.view.pixel ?? [cx - right, cy - down];
    const pixel = [clamp(x + right, 0, width - 1), clamp(y + down, 0, height - 1)];
    this.hovered = null;
    this.change({ pixel, ...this.following(pixel) });
  }

  /** Move the far corner of the selection, which begins at the marked pixel. @param {number} right @param {number} down */
  stretch(right, down) {
    const { width, height } = this.viewport;
    const [x, y] = this.view.pixel ?? this.viewport.centre(this.view).map(Math.floor);
    const [left, top, w, h] = this.box() ?? [x, y, 1, 1];
    this.change({ box: [left, top, clamp(w + right, 1, width - left), clamp(h + down, 1, height - top)] });
  }

  /** @param {number[]} pixel */
  following([x, y]) {
    if (this.view.zoom === null) return {};
    const at = this.viewport.toScreen(this.view, this.viewport.panes[0], x + 0.5, y + 0.5);
    return this.viewport.sees(at) ? {} : { x: x + 0.5, y: y + 0.5 };
  }

  /** Do the action of a button or a key. @param {string} action */
  act(action) {
    /** @type {Record<string, () => void>} */
    const actions = {
      "zoom-in": () => this.zoomBy(2),
      "zoom-out": () => this.zoomBy(0.5),
      fit: () => this.change({ zoom: null, x: null, y: null }),
      pixels: () => this.zoomBy(1 / this.viewport.zoom(this.view)),
      best: () => this.change({ best: !this.view.best }),
      select: () => this.selectBy(!this.selecting),
      save: () => savePicture(this),
      boxes: () => this.change({ boxes: !this.view.boxes }),
      swap: () => this.swap(),
      help: () => openHelp(),
    };
    actions[action]?.();
  }
}
