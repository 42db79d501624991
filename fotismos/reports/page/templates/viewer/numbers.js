// The numbers of a scene that are changed by hand, and the settings of 8.10 that they make.

const AXES = ["x", "y", "z"];
const COEFFICIENTS = ["k_i", "k_a", "k_d", "k_s"];

/** k0, k1 and k2 of 6.1 by the value of f_att; any other value stands for those of the scene. */
const LAWS = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];
const AS_GIVEN = -1;

/** The vector of a light that sliders move. @param {Source} light */
const vectorOf = light => light.position ?? light.direction ?? [0, 0, 0];

/**
 * The numbers of a scene, each with a name and an owner. A light is known by its index in `lights`,
 * a material by that of its name in `names`; all else has the owner 0.
 */
class Numbers {
  /** @param {Live} live @param {Points} points */
  constructor(live, points) {
    this.live = live;
    this.hasFaces = Boolean(points.face_normal);
    /** Materials of a name move together. */
    this.names = [...new Set(live.materials.map(one => one.name))];
    /** Values by `name:owner`. @type {Map<string, number>} */
    this.moved = new Map();
    const seen = [...points.material.keys()].filter(place => points.material[place]);
    /** The middle of what is seen, and how far that reaches along an axis. */
    this.middle = AXES.map(
      (_, c) => seen.reduce((sum, place) => sum + points.position[3 * place + c], 0) / seen.length,
    );
    this.reach = points.position.reduce(
      (most, value, p, all) => Math.max(most, Math.abs(value - all[p % 3])),
      0,
    );
  }

  /**
   * A value at the start; of colours, and of several materials of a name, the largest. Null if the
   * scene has nothing that it would change.
   * @param {string} name
   * @param {number} owner
   * @returns {number | null}
   */
  original(name, owner) {
    const { materials, lights, is_flat } = this.live;
    if (name === "flat") return this.hasFaces ? Number(is_flat) : null;
    if (name === "I_a") return Math.max(...materials.flatMap(one => one.ambient)) || null;
    if (COEFFICIENTS.includes(name) || name === "n") {
      if (name === "k_i" && !materials.some(one => one.k_i.some(Boolean))) return null;
      const own = materials.filter(one => one.name === this.names[owner]);
      return own.length
        ? Math.max(...own.flatMap(one => one[/** @type {"k_d" | "n"} */ (name)]))
        : null;
    }
    const light = lights[owner];
    if (!light) return null;
    if (AXES.includes(name)) return vectorOf(light)[AXES.indexOf(name)];
    if (name === "intensity")
      return Math.max(...light.diffuse_intensity, ...light.specular_intensity);
    if (name === "L_d" || name === "L_s") return 1; // factors
    if (name === "f_att") return light.position ? AS_GIVEN : null;
    if (name === "cutoff") return light.cutoff?.[0] ?? null;
    return name === "m" && light.cutoff ? (light.exponent?.[0] ?? 0) : null;
  }

  /** A value as it is now. @param {string} name @param {number} owner */
  value(name, owner) {
    return this.moved.get(`${name}:${owner}`) ?? this.original(name, owner) ?? 0;
  }

  /** The least and the greatest value. @param {string} name @param {number} owner */
  range(name, owner) {
    const value = this.original(name, owner) ?? 0;
    if (name === "n") return [0.5, Math.max(1024, 2 * value)];
    if (name === "m") return [0, Math.max(64, 2 * value)];
    if (name === "cutoff") return [1, Math.max(90, value)];
    if (name === "f_att") return [AS_GIVEN, LAWS.length - 1];
    if (name === "intensity") return [0, 4 * value * this.dimming(owner) || 1];
    if (name === "L_d" || name === "L_s") return [0, 2];
    if (!AXES.includes(name)) return [0, Math.max(1, 2 * value)];
    const reach = this.live.lights[owner].position ? this.reach : 1 + Math.abs(value);
    return [value - reach, value + reach];
  }

  /**
   * How much darker a light's attenuation makes it than the scene's does: its intensity must be
   * able to make up for that.
   * @param {number} owner
   */
  dimming(owner) {
    const light = this.live.lights[owner];
    if (!light.position) return 1;
    const d = Math.hypot(...light.position.map((value, c) => value - this.middle[c]));
    const now = { ...light, attenuation: this.attenuation(owner) };
    return Math.max(1, lampOf(light).fading(d) / lampOf(now).fading(d) || 1);
  }

  /** @param {number} owner */
  attenuation(owner) {
    return LAWS[this.value("f_att", owner)] ?? this.live.lights[owner].attenuation;
  }

  /**
   * Move a number within its range; what the scene does not have stays as it is.
   * @param {string} name
   * @param {number} owner
   * @param {number} value
   */
  move(name, owner, value) {
    const original = this.original(name, owner);
    if (original === null || Number.isNaN(value)) return;
    const [min, max] = this.range(name, owner);
    // Rounded, so that an address stays short and leads to the same picture.
    const kept = clamp(Number(value.toPrecision(4)), min, max);
    if (kept === original) this.moved.delete(`${name}:${owner}`);
    else this.moved.set(`${name}:${owner}`, kept);
    const intensity = this.moved.get(`intensity:${owner}`);
    if (name === "f_att" && intensity !== undefined) this.move("intensity", owner, intensity);
  }

  /** What was moved, for the address. */
  get text() {
    return [...this.moved].map(([key, value]) => `${key}:${value}`).sort().join(",");
  }

  /** Move what a text of the address says, and nothing else. @param {string} text */
  follow(text) {
    this.moved.clear();
    // Sorted, f_att is before the intensity, whose range depends on it.
    for (const part of text.split(",").sort()) {
      const [name, owner, value] = part.split(":");
      this.move(name, Number(owner), Number.parseFloat(value));
    }
  }

  /** @returns {Settings} */
  settings() {
    const colour = (
      /** @type {number[]} */ was,
      /** @type {string} */ name,
      /** @type {number} */ owner,
    ) => {
      const value = this.moved.get(`${name}:${owner}`);
      const largest = this.original(name, owner) ?? 0;
      return value === undefined
        ? was
        : was.map(channel => (largest > 0 ? (channel / largest) * value : value));
    };
    return {
      materials: this.live.materials.map(one => {
        const owner = this.names.indexOf(one.name);
        return {
          ...one,
          k_i: colour(one.k_i, "k_i", owner),
          k_a: colour(one.k_a, "k_a", owner),
          k_d: colour(one.k_d, "k_d", owner),
          k_s: colour(one.k_s, "k_s", owner),
          n: colour([one.n], "n", owner)[0],
          ambient: colour(one.ambient, "I_a", 0),
        };
      }),
      lights: this.live.lights.map((one, owner) => {
        const intensity = (/** @type {number[]} */ was, /** @type {string} */ factor) =>
          colour(was, "intensity", owner).map(channel => channel * this.value(factor, owner));
        return {
          ...one,
          diffuse_intensity: intensity(one.diffuse_intensity, "L_d"),
          specular_intensity: intensity(one.specular_intensity, "L_s"),
          attenuation: this.attenuation(owner),
          cutoff: one.cutoff && [this.value("cutoff", owner)],
          exponent: one.cutoff && [this.value("m", owner)],
          [one.position ? "position" : "direction"]: AXES.map(axis => this.value(axis, owner)),
        };
      }),
      is_flat: this.value("flat", 0) === 1,
    };
  }
}
