// The textbook half of a scene, shaded again while its numbers are changed by hand.

const AXES = ["x", "y", "z"];

/** The vector of a light that sliders move. @param {Source} light */
const vectorOf = light => light.position ?? light.direction ?? [0, 0, 0];

/**
 * A scene's points and pictures at their resolution, what was moved, and the error that this
 * leaves.
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
    /** Values by slider and what it is of. @type {Map<string, number>} */
    this.moved = new Map();
    this.isFlat = live.is_flat;
    this.reach = this.points.position.reduce(
      (most, value, p, all) => Math.max(most, Math.abs(value - all[p % 3])),
      0,
    );
    this.start = shaded(this.points, this.settings());
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
    this.shown = shaded(this.points, this.settings()).map(
      (value, p) => this.stored[p] + (value - this.start[p]),
    );
    this.errors = differencesOf(labOf(this.shown, this.exposure), this.physical);
    const counted = this.errors.filter((_, cell) => this.counted[cell]);
    this.mean = counted.reduce((sum, value) => sum + value, 0) / Math.max(counted.length, 1);
    this.best = Math.min(this.best, this.mean);
    return this.mean;
  }

  /** @returns {Settings} */
  settings() {
    const { live, moved } = this;
    const colour = (
      /** @type {number[]} */ was,
      /** @type {string} */ name,
      /** @type {string} */ owner,
    ) => {
      const value = moved.get(`${name} ${owner}`);
      const largest = this.original(name, owner);
      return value === undefined
        ? was
        : was.map(channel => (largest > 0 ? (channel / largest) * value : value));
    };
    return {
      materials: live.materials.map(one => ({
        ...one,
        k_a: colour(one.k_a, "k_a", one.name),
        k_d: colour(one.k_d, "k_d", one.name),
        k_s: colour(one.k_s, "k_s", one.name),
        n: colour([one.n], "n", one.name)[0],
      })),
      lights: live.lights.map((one, place) => ({
        ...one,
        diffuse_intensity: colour(one.diffuse_intensity, "intensity", String(place)),
        specular_intensity: colour(one.specular_intensity, "intensity", String(place)),
        [one.position ? "position" : "direction"]: vectorOf(one).map(
          (value, c) => moved.get(`${AXES[c]} ${place}`) ?? value,
        ),
      })),
      is_flat: this.isFlat,
    };
  }

  /**
   * A slider's value at the start; of colours, and of several materials of a name, the largest.
   * @param {string} name
   * @param {string} owner
   */
  original(name, owner) {
    const { materials, lights } = this.live;
    const light = lights[Number(owner)];
    if (AXES.includes(name)) return vectorOf(light)[AXES.indexOf(name)];
    if (name === "intensity")
      return Math.max(...light.diffuse_intensity, ...light.specular_intensity);
    return Math.max(
      ...materials
        .filter(one => one.name === owner)
        .flatMap(one => one[/** @type {"k_d" | "n"} */ (name)]),
    );
  }

  /** The least and the greatest value of a slider. @param {string} name @param {string} owner */
  range(name, owner) {
    const value = this.original(name, owner);
    if (name === "n") return [0.5, Math.max(1024, 2 * value)];
    if (name === "intensity") return [0, 4 * value || 1];
    if (!AXES.includes(name)) return [0, Math.max(1, 2 * value)];
    const reach = this.live.lights[Number(owner)].position ? this.reach : 1 + Math.abs(value);
    return [value - reach, value + reach];
  }
}

/** The section in which a scene is shaded again. */
class LiveShading {
  /** @param {HTMLElement} panel */
  constructor(panel) {
    this.panel = panel;
    this.whole = /** @type {HTMLDetailsElement} */ (this.part("whole"));
    this.scene = /** @type {Pictured | null} */ (null);
    this.painter = /** @type {Painter | null} */ (null);
    this.session = /** @type {Session | null} */ (null);
    this.threshold = page.usual;
    this.frame = 0;
    this.sliders = /** @type {HTMLInputElement[]} */ ([...panel.querySelectorAll("input")]);
    const select = (/** @type {string} */ name) =>
      /** @type {HTMLSelectElement} */ (this.part(name));
    this.material = select("material");
    this.light = select("lamp");
    this.normals = select("interpolation");
    this.whole.addEventListener("toggle", () => void this.load());
    for (const choice of [this.material, this.light])
      choice.addEventListener("input", () => this.change());
    for (const slider of this.sliders) {
      const value = () => (slider.name === "n" ? 2 ** Number(slider.value) : Number(slider.value));
      slider.addEventListener("input", () =>
        this.change(session =>
          session.moved.set(`${slider.name} ${this.ownerOf(slider)}`, value()),
        ),
      );
    }
    this.normals.addEventListener("input", () =>
      this.change(session => {
        session.isFlat = this.normals.value === "flat";
      }),
    );
    this.part("reset").addEventListener("click", () =>
      this.change(session => {
        session.moved.clear();
        session.isFlat = session.live.is_flat;
      }),
    );
  }

  /** @param {string} name @returns {HTMLElement} */
  part(name) {
    return /** @type {HTMLElement} */ (this.panel.querySelector(`[data-part=${name}]`));
  }

  /** Move into a scene's section. @param {Pictured} scene @param {HTMLElement} section */
  open(scene, section) {
    const { live } = scene;
    Object.assign(this, { scene, painter: null, session: null });
    section.querySelector(".terms-slot")?.after(this.panel);
    this.panel.hidden = !live;
    this.whole.open = false;
    this.whole.hidden = !live?.grid;
    this.part("missing").hidden = Boolean(live?.grid);
    this.part("missing").textContent =
      `The textbook half cannot be shaded again here. ${live?.missing}`;
  }

  /** @param {Painter} painter @param {number} t */
  show(painter, t) {
    if (this.painter === painter && this.threshold === t) return;
    Object.assign(this, { painter, threshold: t });
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
      const names = [...new Set(live.materials.map(one => one.name))];
      this.material.replaceChildren(...names.map(name => new Option(name || "unnamed", name)));
      this.light.replaceChildren(
        ...live.lights.map((one, place) => new Option(one.name, String(place))),
      );
      this.part("light").hidden = !live.lights.length;
      this.part("normals").hidden = !this.session.points.face_normal;
      this.part("size").textContent = `${grid.width} × ${grid.height}`;
    }
    this.change();
  }

  /**
   * What a slider is of: a light's place, or a material's name.
   * @param {HTMLInputElement} slider
   */
  ownerOf(slider) {
    return this.part("light").contains(slider) ? this.light.value : this.material.value;
  }

  /** Put the sliders where the chosen material and light are. @param {Session} session */
  arrange(session) {
    const { lights, materials } = session.live;
    const isLit = materials.some(
      one => one.name === this.material.value && one.ambient.some(Boolean),
    );
    this.normals.value = session.isFlat ? "flat" : "phong";
    this.part("place").textContent = lights[Number(this.light.value)]?.position
      ? "Position"
      : "Direction of travel";
    for (const slider of this.sliders) {
      const { name } = slider;
      const owner = this.ownerOf(slider);
      slider.disabled = name === "k_a" ? !isLit : !lights.length;
      if (!lights.length && this.part("light").contains(slider)) continue;
      const value = session.moved.get(`${name} ${owner}`) ?? session.original(name, owner);
      const [min, max, place] = [...session.range(name, owner), value].map(one =>
        String(name === "n" ? Math.log2(one) : one),
      );
      Object.assign(slider, { min, max });
      slider.value = place;
      slider.ariaValueText = significant(value);
      if (slider.nextElementSibling) slider.nextElementSibling.textContent = significant(value);
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
    const colour = differenceColours(this.threshold, painter.top);
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
      canvas.getContext("2d")?.drawImage(
        painted(width, height, pixels =>
          pixels.forEach((_, cell) => {
            pixels[cell] = pixelAt(cell);
          }),
        ),
        0,
        0,
      );
    }
    const texts = { mean: session.mean, first: session.first, best: session.best };
    for (const [name, value] of Object.entries(texts))
      this.part(name).textContent = differenceText(value);
    this.part("fit").textContent = fit
      ? `, the fit ${differenceText(fit[0])} at ${fit[1]} × ${fit[2]}`
      : "";
  }
}
