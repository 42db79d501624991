// Pictures from numbers: the two renderings and the maps, one canvas each, kept until they change.

/** Significant, counted and undetermined, as in the plane "flags". */
const SIGNIFICANT = 1, COUNTED = 2, UNDETERMINED = 4;

/** An opaque pixel as stored in the canvas, on little-endian machines (all that browsers run on). */
const rgba = (/** @type {number} */ r, /** @type {number} */ g, /** @type {number} */ b) =>
  (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;

/** Overlays of pixels that are lit up, and of the others: colours with an opacity. */
const LIT = ((0xa8 << 24) | (0xff << 16) | (0xf0 << 8) | 0x5e) >>> 0, DIMMED = (0x90 << 24) >>> 0;

/** A table of 256 colours from a sequence of "rrggbb". @param {string} hexadecimal */
function colourTable(hexadecimal) {
  return Uint32Array.from({ length: 256 }, (_, place) => {
    const colour = parseInt(hexadecimal.slice(6 * place, 6 * place + 6), 16);
    return rgba(colour >> 16, (colour >> 8) & 255, colour & 255);
  });
}

/** Pictures of one scene. */
class Painter {
  /**
   * @param {Images} images
   * @param {number} exposure the comparison's factor
   * @param {Page} page the page's data of maps: colours, maps, luminance
   * @param {Effects | null} effects the dominating effects, if known
   */
  constructor(images, exposure, page, effects) {
    this.images = images;
    this.exposure = exposure;
    this.page = page;
    this.effects = effects;
    this.tables = Object.fromEntries(
      Object.entries(page.colours).map(([name, colours]) => [name, colourTable(colours)]),
    );
    /** @type {Map<string, {key: string, canvas: HTMLCanvasElement}>} */
    this.pictures = new Map();
    /** @type {Map<string, Float64Array>} */
    this.numbers = new Map();
    /** Automatic ranges of maps. @type {Map<string, number>} */
    this.ranges = new Map();
  }

  /** "heuristic" or "reference" through a tone map. @param {string} half @param {string} tone @param {number} gain × the comparison's exposure */
  rendering(half, tone, gain) {
    const factor = this.exposure * gain;
    return this.picture(half, `${tone} ${factor}`, (pixels) =>
      tone === "false" ? this.paintStops(pixels, half, factor) : this.paintLevels(pixels, half, levels(tone, factor)),
    );
  }

  /** Whether statistics include a place. @param {number} place */
  counts(place) {
    return Boolean(this.images.codes.flags[place] & COUNTED);
  }

  /** The values of a map of kind error or ratio, by place. @param {string} name */
  values(name) {
    let values = this.numbers.get(name);
    if (!values) {
      const codes = this.images.codes[name];
      values = codes ? Float64Array.from(codes, (code) => VALUES[code]) : Float64Array.from(this.images.codes.flags, (_, place) => this.ratio(place));
      this.numbers.set(name, values);
    }
    return values;
  }

  /** The named map, its colours ending at a value. @param {string} name @param {number} top */
  map(name, top) {
    const { kind } = mapOf(this.page, name);
    return this.picture("map", `${name} ${top}`, (pixels) => {
      if (kind === "ratio") this.paintRatio(pixels, name, top);
      else if (kind === "mask") this.paintFlags(pixels);
      else if (kind === "effects") this.paintEffects(pixels);
      else this.paintError(pixels, name, top);
    });
  }

  /**
   * The canvas in a slot, repainted if its key has changed.
   * @param {string} slot
   * @param {string} key
   * @param {(pixels: Uint32Array) => void} paint
   */
  picture(slot, key, paint) {
    const kept = this.pictures.get(slot);
    if (kept?.key === key) return kept.canvas;
    const { width, height } = this.images;
    const canvas = kept?.canvas ?? Object.assign(document.createElement("canvas"), { width, height });
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const data = new ImageData(width, height);
    paint(new Uint32Array(data.data.buffer));
    context.putImageData(data, 0, 0);
    this.pictures.set(slot, { key, canvas });
    return canvas;
  }

  /** @param {string} half */
  channels(half) {
    return ["R", "G", "B"].map((colour) => this.images.codes[`${half}.${colour}`]);
  }

  /** @param {Uint32Array} pixels @param {string} half @param {Uint8Array} level */
  paintLevels(pixels, half, level) {
    const [r, g, b] = this.channels(half);
    for (let i = 0; i < pixels.length; i++) pixels[i] = rgba(level[r[i]], level[g[i]], level[b[i]]);
  }

  /** @param {Uint32Array} pixels @param {string} half @param {number} factor */
  paintStops(pixels, half, factor) {
    const [low, high] = FALSE_COLOUR_STOPS;
    for (let i = 0; i < pixels.length; i++) {
      const stops = Math.log2(Math.max(factor * this.luminance(half, i), 1e-30));
      pixels[i] = this.tables.value[clamp(Math.floor((256 * (stops - low)) / (high - low)), 0, 255)];
    }
  }

  /** @param {Uint32Array} pixels @param {string} metric @param {number} top the end of its range */
  paintError(pixels, metric, top) {
    const values = this.values(metric);
    for (let i = 0; i < pixels.length; i++) pixels[i] = this.tables.error[clamp(Math.floor((256 * values[i]) / top), 0, 255)];
  }

  /** @param {Uint32Array} pixels @param {string} name @param {number} range half of it, in stops */
  paintRatio(pixels, name, range) {
    const values = this.values(name);
    for (let i = 0; i < pixels.length; i++) {
      pixels[i] = this.tables.signed[clamp(Math.floor(128 + (128 * values[i]) / range), 0, 255)];
    }
  }

  /** Light up the counted pixels of a box whose values are in a band, and dim the others. @param {string} name @param {number[]} band @param {number[] | null} box */
  band(name, [low, high], box) {
    return this.picture("band", `${name} ${low} ${high} ${box}`, (pixels) => {
      const values = this.values(name);
      pixels.fill(DIMMED);
      eachPlace(this, box, (place) => {
        if (values[place] >= low && values[place] < high) pixels[place] = LIT;
      });
    });
  }

  /** @param {Uint32Array} pixels */
  paintFlags(pixels) {
    const flags = this.images.codes.flags;
    const [marked, unmarked, uncounted, open] = this.page.mask.map((/** @type {number[]} */ c) => rgba(c[0], c[1], c[2]));
    for (let i = 0; i < pixels.length; i++) {
      const unshown = flags[i] & UNDETERMINED ? open : unmarked;
      pixels[i] = flags[i] & COUNTED ? (flags[i] & SIGNIFICANT ? marked : unshown) : uncounted;
    }
  }

  /** @param {Uint32Array} pixels */
  paintEffects(pixels) {
    const { width, height } = this.images;
    const colours = effectColours(this.effects, this.page);
    for (let i = 0; i < pixels.length; i++) {
      const letter = letterAt(this.effects, ((i % width) + 0.5) / width, (Math.floor(i / width) + 0.5) / height);
      pixels[i] = colours[letter];
    }
  }

  /** Relative luminance of a pixel. @param {string} half @param {number} place */
  luminance(half, place) {
    return this.page.xyz[1].reduce(
      (/** @type {number} */ sum, /** @type {number} */ weight, /** @type {number} */ channel) =>
        sum + weight * VALUES[this.channels(half)[channel][place]],
      0,
    );
  }

  /** Luminance of the heuristic over that of the reference, in stops. @param {number} place */
  ratio(place) {
    const [test, reference] = ["heuristic", "reference"].map(
      (half) => Math.max(this.luminance(half, place), 0) + this.page.epsilon,
    );
    return Math.log2(test / reference);
  }
}
