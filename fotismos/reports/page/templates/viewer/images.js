// Embedded images (see reports/page/embedding.py) back to numbers, and pictures of them.

/**
 * @typedef {{width: number, height: number, block: number, names: string[]}} Manifest
 * @typedef {Manifest & {codes: Record<string, Uint16Array>}} Images
 */

/** The values of all half floats, by their 16 bits (IEEE 754). */
const VALUES = Float64Array.from({ length: 65536 }, (_, code) => {
  const [exponent, fraction] = [(code >> 10) & 31, (code & 1023) / 1024];
  const size = exponent ? (1 + fraction) * 2 ** (exponent - 15) : fraction * 2 ** -14;
  return code & 0x8000 ? -size : size;
});

/** Bits of the plane "flags". */
const SIGNIFICANT = 1;
const COUNTED = 2;
const UNDETERMINED = 4;

/** The end of the colours of differences, for all scenes. */
const TOP = page.maps?.[0].top;

/** Decoded planes by the ids of their elements. @type {Map<string, Promise<Images>>} */
const decoded = new Map();

/**
 * The planes in an element, decoded when first requested.
 * @param {string} id
 * @param {Manifest} manifest
 */
function imagesIn(id, manifest) {
  if (!decoded.has(id)) decoded.set(id, decode(manifest, byId(id).textContent ?? ""));
  return /** @type {Promise<Images>} */ (decoded.get(id));
}

/** @param {Manifest} manifest @param {string} text @returns {Promise<Images>} */
async function decode(manifest, text) {
  const bytes = Uint8Array.from(atob(text.trim()), letter => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const halves = new Uint8Array(await new Response(stream).arrayBuffer());
  const codes = new Uint16Array(halves.length / 2);
  for (let place = 0, last = 0; place < codes.length; place++) {
    const signed = halves[place] | (halves[place + codes.length] << 8);
    codes[place] = last += (signed >>> 1) ^ -(signed & 1);
  }
  const size = manifest.width * manifest.height;
  manifest.names.forEach((name, i) => {
    if (!/[.][GB]$/.test(name)) return;
    for (let place = i * size; place < (i + 1) * size; place++) codes[place] += codes[place - size];
  });
  return {
    ...manifest,
    codes: Object.fromEntries(
      manifest.names.map((name, i) => [name, codes.subarray(i * size, (i + 1) * size)]),
    ),
  };
}

/**
 * An opaque pixel as stored in the canvas, on little-endian machines (all that browsers run on).
 * @param {number[]} colour
 */
const rgba = ([r, g, b]) => (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;

/** "rrggbb", once or repeated, as pixels. @param {string} digits */
const pixelsOf = digits =>
  Uint32Array.from(digits.match(/.{6}/g) ?? [], css =>
    rgba([0, 2, 4].map(at => parseInt(css.slice(at, at + 2), 16))),
  );

/** The 8-bit sRGB level of linear light, 1 being white (IEC 61966-2-1). @param {number} linear */
function srgb(linear) {
  const x = clamp(linear, 0, 1);
  return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
}

/**
 * A canvas that is painted place by place, row after row.
 * @param {number} width
 * @param {number} height
 * @param {(place: number) => number} pixelAt
 */
function painted(width, height, pixelAt) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const data = new ImageData(width, height);
  const pixels = new Uint32Array(data.data.buffer);
  for (let place = 0; place < pixels.length; place++) pixels[place] = pixelAt(place);
  canvas.getContext("2d")?.putImageData(data, 0, 0);
  return canvas;
}

/** The colours of differences: grey up to a threshold, then dark to bright. @param {number} t */
function differenceColours(t) {
  const table = pixelsOf(page.colours.error);
  return (/** @type {number} */ value) => {
    const grey = Math.round((page.dark * Math.max(value, 0)) / t);
    if (value <= t) return rgba([grey, grey, grey]);
    return table[clamp(Math.floor(64 + (192 * (value - t)) / (TOP - t)), 64, 255)];
  };
}

/** Pictures of one scene, kept until they change. */
class Painter {
  /**
   * @param {Scene} scene
   * @param {Images} images
   * @param {Painter | null} whole of the scene, if these images are smaller
   */
  constructor(scene, images, whole = null) {
    this.scene = scene;
    this.images = images;
    this.differences = Float64Array.from(images.codes.dE2000, code => VALUES[code]);
    this.whole = whole;
    /** Pixels of the scene in a place, to the right and down. */
    this.step = whole
      ? [scene.width / images.width, scene.height / images.height]
      : [images.block, images.block];
    /** @type {Map<string, {key: string, canvas: HTMLCanvasElement}>} */
    this.kept = new Map();
    /** Linear RGB of the first half, sharpened. @type {Float32Array | undefined} */
    this.fine;
  }

  /** Whether statistics include a place. @param {number} place */
  counts(place) {
    return Boolean(this.images.codes.flags[place] & COUNTED);
  }

  /** The place of a pixel of the image. @param {number[]} pixel */
  placeOf([x, y]) {
    return Math.floor(y / this.step[1]) * this.images.width + Math.floor(x / this.step[0]);
  }

  /** Linear red, green and blue. @param {string} half @param {number} place */
  colour(half, place) {
    return ["R", "G", "B"].map(channel => VALUES[this.images.codes[`${half}.${channel}`][place]]);
  }

  /** Luminances of both halves. @param {number} place */
  luminances(place) {
    return ["heuristic", "reference"].map(half =>
      Math.max(
        this.colour(half, place).reduce(
          (sum, value, channel) => sum + page.xyz[1][channel] * value,
          0,
        ),
        0,
      ),
    );
  }

  /** Luminance of the first half over that of the reference, in stops. @param {number} place */
  ratio(place) {
    const [test, reference] = this.luminances(place);
    return Math.log2((test + page.epsilon) / (reference + page.epsilon));
  }

  /** The letter of the effect that dominates at a place. @param {number} place */
  letter(place) {
    const { width, height } = this.images;
    return letterAt(
      this.scene.effects,
      ((place % width) + 0.5) / width,
      (Math.floor(place / width) + 0.5) / height,
    );
  }

  /**
   * The canvas in a slot, painted place by place if its key has changed.
   * @param {string} slot
   * @param {string} key
   * @param {(place: number) => number} pixelAt
   */
  picture(slot, key, pixelAt, { width, height } = this.images) {
    const kept = this.kept.get(slot);
    if (kept?.key === key) return kept.canvas;
    const canvas = painted(width, height, pixelAt);
    this.kept.set(slot, { key, canvas });
    return canvas;
  }

  /** The first half, as sharp as the whole scene's pictures if it is smaller. @param {number} ev */
  sharp(ev) {
    const { whole, images } = this;
    if (!whole || images.width >= whole.images.width) return this.rendering("heuristic", ev);
    this.fine ??= sharpened(this, whole);
    const { fine, scene } = this;
    const level = (/** @type {number} */ value) => srgb(value * scene.exposure * 2 ** ev);
    return this.picture(
      "heuristic",
      String(ev),
      place => rgba([0, 1, 2].map(c => level(fine[3 * place + c]))),
      whole.images,
    );
  }

  /** "heuristic" or "reference". @param {string} half @param {number} ev */
  rendering(half, ev) {
    const levels = Uint8Array.from(VALUES, value => srgb(value * this.scene.exposure * 2 ** ev));
    const [r, g, b] = ["R", "G", "B"].map(channel => this.images.codes[`${half}.${channel}`]);
    return this.picture(half, String(ev), place =>
      rgba([levels[r[place]], levels[g[place]], levels[b[place]]]),
    );
  }

  /**
   * The pixel at each place of a map.
   * @param {MapOf} map
   * @param {number} t
   * @returns {(place: number) => number}
   */
  colours({ name, kind, top }, t) {
    const flags = this.images.codes.flags;
    const [marked, unmarked, uncounted, undetermined] = page.mask.map(rgba);
    if (kind === "ratio") {
      const table = pixelsOf(page.colours.signed);
      return place => table[clamp(Math.floor(128 + (128 * this.ratio(place)) / top), 0, 255)];
    }
    if (kind === "metric") {
      const table = pixelsOf(page.colours.error);
      const codes = this.images.codes[name];
      return place => table[clamp(Math.floor((256 * VALUES[codes[place]]) / top), 0, 255)];
    }
    if (kind === "mask") {
      const unshown = (/** @type {number} */ place) =>
        flags[place] & UNDETERMINED ? undetermined : unmarked;
      return place =>
        !this.counts(place) ? uncounted : flags[place] & SIGNIFICANT ? marked : unshown(place);
    }
    if (kind === "effects") {
      const own = pixelsOf(
        [...(this.scene.effects?.colours ?? []), page.noEffect].join("").replaceAll("#", ""),
      );
      return place => {
        const letter = this.letter(place);
        return letter === NOT_COUNTED
          ? uncounted
          : own[letter === NO_EFFECT ? own.length - 1 : parseInt(letter, 36)];
      };
    }
    const colour = differenceColours(t);
    return place => colour(this.differences[place]);
  }
}

/** How far levels of the guide may be apart (of 1) in pixels that share their light. */
const NEARNESS = 0.08;

/**
 * The first half of small images at the size of the whole scene's, linear RGB place by place: means
 * of the nearest small pixels, weighed by how alike both whole pictures are there (joint bilateral
 * upsampling).
 * @param {Painter} small
 * @param {Painter} whole
 */
function sharpened(small, whole) {
  const { width, height } = whole.images;
  const across = small.images.width;
  const down = small.images.height;
  const levels = Float32Array.from(VALUES, value => srgb(value * whole.scene.exposure) / 255);
  const planes = ["heuristic", "reference"].flatMap(half =>
    ["R", "G", "B"].map(channel => whole.images.codes[`${half}.${channel}`]),
  );
  const size = planes.length;
  const place = (/** @type {number} */ x, /** @type {number} */ y) =>
    [((x + 0.5) * across) / width - 0.5, ((y + 0.5) * down) / height - 0.5];
  /** The mean of the guide in each small pixel. */
  const guide = new Float32Array(size * across * down);
  const counts = new Uint32Array(across * down);
  for (let p = 0; p < width * height; p++) {
    const [x, y] = place(p % width, Math.floor(p / width)).map(Math.round);
    const cell = y * across + x;
    counts[cell] += 1;
    for (let i = 0; i < size; i++)
      guide[size * cell + i] += (levels[planes[i][p]] - guide[size * cell + i]) / counts[cell];
  }
  const colours = ["R", "G", "B"].map(channel => small.images.codes[`heuristic.${channel}`]);
  const fine = new Float32Array(3 * width * height);
  for (let p = 0; p < width * height; p++) {
    const [x, y] = place(p % width, Math.floor(p / width));
    let total = 0;
    for (let row = Math.round(y) - 1; row <= Math.round(y) + 1; row++)
      for (let column = Math.round(x) - 1; column <= Math.round(x) + 1; column++) {
        if (row < 0 || column < 0 || row >= down || column >= across) continue;
        const cell = row * across + column;
        let apart = 0;
        for (let i = 0; i < size; i++)
          apart += (levels[planes[i][p]] - guide[size * cell + i]) ** 2;
        const far = (column - x) ** 2 + (row - y) ** 2;
        const weight = Math.exp(-far - apart / (2 * NEARNESS ** 2)) + 1e-9;
        total += weight;
        for (let c = 0; c < 3; c++) fine[3 * p + c] += weight * VALUES[colours[c][cell]];
      }
    for (let c = 0; c < 3; c++) fine[3 * p + c] /= total;
  }
  return fine;
}

/** Letters of pixels without an effect: none dominates, and not counted. */
const NO_EFFECT = ".";
const NOT_COUNTED = "-";

/**
 * The letter at a place of the image, from 0 to 1.
 * @param {Effects | null} effects
 * @param {number} x
 * @param {number} y
 */
function letterAt(effects, x, y) {
  if (!effects) return NOT_COUNTED;
  return effects.map[
    Math.floor(y * effects.height) * effects.width + Math.floor(x * effects.width)
  ];
}

/**
 * What is missing where a letter stands; empty if unknown or nothing.
 * @param {Effects | null} effects
 * @param {string} letter
 */
function effectName(effects, letter) {
  return effects?.names[parseInt(letter, 36)] ?? "";
}
