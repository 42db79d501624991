// The textbook half of a scene, shaded again while its numbers are changed by hand.

/**
 * A scene's points and pictures at their resolution, its numbers, and the error that they leave.
 */
class Session {
  /** @param {Painter} painter @param {Live} live @param {Images} grid */
  constructor(painter, live, grid) {
    const { width, height } = grid;
    const { images, scene } = painter;
    const count = width * height;
    this.live = live;
    this.grid = grid;
    this.exposure = scene.exposure;
    this.points = pointsOf(live, grid);
    this.numbers = new Numbers(live, this.points);
    this.start = shaded(this.points, this.numbers.settings());
    /** Of each cell, over its pixels. */
    this.stored = new Float64Array(3 * count);
    this.reference = new Float64Array(3 * count);
    this.counted = new Uint8Array(count);
    const sizes = new Uint32Array(count);
    const cells = Uint32Array.from(images.codes.flags, (_, place) => {
      const column = place % images.width;
      const row = Math.floor(place / images.width);
      return (
        Math.floor((row * height) / images.height) * width +
        Math.floor((column * width) / images.width)
      );
    });
    for (const cell of cells) sizes[cell] += 1;
    cells.forEach((cell, place) => {
      if (painter.counts(place)) this.counted[cell] = 1;
      painter.colour("heuristic", place).forEach((value, c) => {
        this.stored[3 * cell + c] += value / sizes[cell];
      });
      painter.colour("reference", place).forEach((value, c) => {
        this.reference[3 * cell + c] += value / sizes[cell];
      });
    });
    this.physical = labOf(this.reference, this.exposure);
    this.shown = this.errors = this.stored;
    this.best = this.mean = Infinity;
    this.first = this.shade();
  }

  /**
   * Shade again, and return the mean error. The stored picture, plus the change, keeps its smooth
   * edges.
   * @returns {number}
   */
  shade() {
    this.shown = shaded(this.points, this.numbers.settings()).map(
      (value, p) => this.stored[p] + (value - this.start[p]),
    );
    this.errors = differencesOf(labOf(this.shown, this.exposure), this.physical);
    const counted = this.errors.filter((_, cell) => this.counted[cell]);
    this.mean = counted.reduce((sum, value) => sum + value, 0) / Math.max(counted.length, 1);
    this.best = Math.min(this.best, this.mean);
    return this.mean;
  }
}

/** The section in which a scene is shaded again. */
class LiveShading {
  /**
   * @param {HTMLElement} panel
   * @param {(changes: Partial<View>) => void} request requests a view of the page
   */
  constructor(panel, request) {
    this.panel = panel;
    /** What is moved, as the address has it. */
    this.text = "";
    this.whole = /** @type {HTMLDetailsElement} */ (this.part("whole"));
    this.scene = /** @type {Pictured | null} */ (null);
    this.painter = /** @type {Painter | null} */ (null);
    this.session = /** @type {Session | null} */ (null);
    this.threshold = page.usual;
    this.frame = 0;
    this.controls = /** @type {(HTMLInputElement | HTMLSelectElement)[]} */ ([
      ...panel.querySelectorAll("[name]"),
    ]);
    const select = (/** @type {string} */ name) =>
      /** @type {HTMLSelectElement} */ (this.part(name));
    this.material = select("material");
    this.light = select("lamp");
    this.whole.addEventListener("toggle", () => void this.load());
    for (const choice of [this.material, this.light])
      choice.addEventListener("input", () => this.change());
    const keep = () => {
      if (!this.session) return;
      this.text = this.session.numbers.text;
      request({ live: this.text });
    };
    for (const control of this.controls) {
      const { name } = control;
      control.addEventListener("input", () => {
        const value = Number(control.value);
        this.change(({ numbers }) =>
          numbers.move(name, this.ownerOf(control), name === "n" ? 2 ** value : value),
        );
      });
      control.addEventListener("change", keep); // a drag has ended: browsers allow few addresses
    }
    this.part("reset").addEventListener("click", () => {
      this.change(({ numbers }) => numbers.moved.clear());
      keep();
    });
  }

  /** @param {string} name @returns {HTMLElement} */
  part(name) {
    return /** @type {HTMLElement} */ (this.panel.querySelector(`[data-part=${name}]`));
  }

  /** Move into a scene's section. @param {Pictured} scene @param {HTMLElement} section */
  open(scene, section) {
    const { live } = scene;
    Object.assign(this, { scene, painter: null, session: null, text: "" });
    section.querySelector(".terms-slot")?.after(this.panel);
    this.panel.hidden = !live;
    this.whole.open = false;
    this.whole.hidden = !live?.grid;
    this.part("missing").hidden = Boolean(live?.grid);
    this.part("missing").textContent =
      `No other coefficients can be tried here. ${live?.missing}`;
  }

  /** @param {Painter} painter @param {View} view */
  show(painter, { t, live }) {
    if (this.painter === painter && this.threshold === t && this.text === live) return;
    if (this.text !== live) {
      this.session?.numbers.follow(live);
      this.whole.open ||= Boolean(live);
    }
    Object.assign(this, { painter, threshold: t, text: live });
    void this.load();
  }

  /** Decode the points when the section is first open. */
  async load() {
    const { scene, painter } = this;
    const live = scene?.live;
    if (!this.whole.open || !live?.grid || painter?.scene !== scene || !painter) return;
    const grid = await imagesIn(`data-live-${scene.id}`, live.grid);
    if (this.scene !== scene) return; // another one was opened meanwhile
    if (!this.session) {
      this.session = new Session(painter, live, grid);
      const { numbers } = this.session;
      numbers.follow(this.text);
      this.material.replaceChildren(
        ...numbers.names.map((name, place) => new Option(name || "unnamed", String(place))),
      );
      this.light.replaceChildren(
        ...live.lights.map((one, place) => new Option(one.name, String(place))),
      );
      this.choose(numbers);
      this.part("light").hidden = !live.lights.length;
      this.part("size").textContent = `${grid.width} × ${grid.height}`;
    }
    this.change();
  }

  /** Where what a control is of is chosen, if there is a choice. @param {HTMLElement} control */
  choiceOf(control) {
    const of = control.closest("[data-of]")?.getAttribute("data-of");
    return of ? (of === "light" ? this.light : this.material) : null;
  }

  /** What a control is of (`Numbers`). @param {HTMLElement} control */
  ownerOf(control) {
    return Number(this.choiceOf(control)?.value ?? 0);
  }

  /** Choose a material and a light of which something was moved. @param {Numbers} numbers */
  choose(numbers) {
    for (const control of this.controls) {
      const key = [...numbers.moved.keys()].find(one => one.startsWith(`${control.name}:`));
      const choice = this.choiceOf(control);
      if (key && choice) [, choice.value] = key.split(":");
    }
  }

  /** Put the controls where the chosen material and light are. @param {Session} session */
  arrange({ live: { lights }, numbers }) {
    const light = lights[Number(this.light.value)];
    this.part("place").textContent = light?.position ? "Position" : "Direction of travel";
    const law = light?.attenuation?.map(k => Number(k.toPrecision(3)));
    this.part("law").textContent = `as given: ${law?.join(", ")}`;
    const isLit = numbers.original("I_a", 0) !== null;
    for (const control of this.controls) {
      const { name } = control;
      const owner = this.ownerOf(control);
      const label = /** @type {HTMLElement} */ (control.closest("label"));
      label.hidden = numbers.original(name, owner) === null;
      if (label.hidden) continue;
      if (name === "k_a") control.disabled = !isLit;
      if (["k_d", "k_s", "n"].includes(name)) control.disabled = !lights.length;
      const value = numbers.value(name, owner);
      const [min, max, place] = [...numbers.range(name, owner), value].map(one =>
        String(name === "n" ? Math.log2(one) : one),
      );
      Object.assign(control, control instanceof HTMLInputElement && { min, max });
      control.value = place;
      const output = label.querySelector("output");
      if (!output) continue;
      const { before = "", unit = "" } = output.dataset;
      const text = name === "n" ? String(Number(value.toPrecision(4))) : significant(value);
      output.textContent = `${before}${text}${unit}`;
      control.ariaValueText = `${text}${unit}`;
    }
  }

  /**
   * Edit, and shade once before the next frame, however often requested.
   * @param {(session: Session) => void} edit
   */
  change(edit = () => {}) {
    const { session, painter } = this;
    if (!session || !painter) return;
    edit(session);
    this.arrange(session);
    cancelAnimationFrame(this.frame);
    this.frame = requestAnimationFrame(() => this.draw(session, painter));
  }

  /** @param {Session} session @param {Painter} painter */
  draw(session, painter) {
    session.shade();
    const {
      shown,
      reference,
      errors,
      counted,
      exposure,
      grid: { width, height },
      live: { fit },
    } = session;
    const colour = differenceColours(this.threshold);
    const seen = (/** @type {Float64Array} */ rgb) => (/** @type {number} */ cell) =>
      rgba([0, 1, 2].map(c => srgb(rgb[3 * cell + c] * exposure)));
    const pictures = {
      shown: seen(shown),
      reference: seen(reference),
      error: (/** @type {number} */ cell) => colour(counted[cell] ? errors[cell] : 0),
    };
    for (const [name, pixelAt] of Object.entries(pictures)) {
      const canvas = /** @type {HTMLCanvasElement} */ (this.part(name));
      Object.assign(canvas, { width, height });
      canvas.getContext("2d")?.drawImage(painted(width, height, pixelAt), 0, 0);
    }
    const texts = { mean: session.mean, first: session.first, best: session.best };
    for (const [name, value] of Object.entries(texts))
      this.part(name).textContent = differenceText(value);
    this.part("grey").textContent = String(this.threshold);
    this.part("fit").textContent = fit
      ? `, the fit ${differenceText(fit[0])} at ${fit[1]} × ${fit[2]}`
      : "";
  }
}
