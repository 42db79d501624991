// Equation 8.10 at stored points, as the kernel has it, and ΔE2000 (CIE 15): numbers, no page.

/**
 * A light has the fields of heuristic/lights.py, as lists; `fit` is the mean that a fit reached,
 * its width and height.
 * @typedef {{name: string, intensity: number[], diffuse_intensity: number[], specular_intensity:
 * number[], position?: number[], direction?: number[], attenuation?: number[], clamped?: boolean[],
 * cutoff?: number[], exponent?: number[], shell?: number[]}} Source
 * @typedef {{grid: Manifest, tops: Record<string, number>, materials: Material[], lights:
 * Source[], missing: string, rays: number[][][], is_flat: boolean, fit: number[] | null}} Live
 * @typedef {{materials: Material[], lights: Source[], is_flat: boolean}} Settings
 * @typedef {{material: Uint16Array, position: Float64Array, view: Float64Array, normal:
 * Float64Array, face_normal: Float64Array | null, k_d: Float64Array | null}} Points
 */

/** A cosine at the edge of a spot is within its cone despite rounding. */
const EDGE = 1e-7;

/** The points of a decoded grid. @param {Live} live @param {Images} grid @returns {Points} */
function pointsOf({ tops, rays }, { width, height, codes }) {
  const count = width * height;
  const plane = (/** @type {string} */ name) => {
    const values = codes[name].slice();
    for (let place = width; place < count; place++) values[place] += values[place - width];
    return Float64Array.from(values, code => tops[name] * ((2 * code) / 16383 - 1)); // LIVE_CODE
  };
  const vectors = (/** @type {string} */ name) => {
    if (!(`${name}.x` in codes)) return null;
    const found = new Float64Array(3 * count);
    ["x", "y", "z"].forEach((axis, c) =>
      plane(`${name}.${axis}`).forEach((value, place) => {
        found[3 * place + c] = value;
      }),
    );
    return found;
  };
  const depth = plane("depth");
  const position = new Float64Array(3 * count);
  const view = new Float64Array(3 * count);
  for (let place = 0; place < count; place++) {
    const u = (place % width) / Math.max(width - 1, 1);
    const v = Math.floor(place / width) / Math.max(height - 1, 1);
    const [origin, ray] = rays.map(([first, right, below]) =>
      first.map((value, c) => value + u * (right[c] - value) + v * (below[c] - value)),
    );
    const length = Math.hypot(...ray);
    const t = Math.exp(depth[place]);
    for (let c = 0; c < 3; c++) {
      view[3 * place + c] = -ray[c] / length;
      position[3 * place + c] = origin[c] + (t * ray[c]) / length;
    }
  }
  const normal = /** @type {Float64Array} */ (vectors("normal"));
  const faces = vectors("face_normal");
  for (const each of [normal, faces]) if (each) normalise(each);
  return {
    material: Uint16Array.from(plane("material"), Math.round),
    position,
    view,
    normal,
    face_normal: faces,
    k_d: vectors("k_d"),
  };
}

/** @param {Float64Array | number[]} vectors */
function normalise(vectors) {
  for (let p = 0; p < vectors.length; p += 3) {
    const length = Math.hypot(vectors[p], vectors[p + 1], vectors[p + 2]) || 1;
    for (let c = 0; c < 3; c++) vectors[p + c] /= length;
  }
  return vectors;
}

/** @param {Source} light */
function lampOf({
  position,
  direction,
  diffuse_intensity: diffuse,
  specular_intensity: specular,
  attenuation = [1, 0, 0],
  clamped = [false],
  cutoff,
  exponent = [0],
}) {
  const [k0, k1, k2] = attenuation;
  return {
    position,
    diffuse,
    specular,
    exponent: exponent[0],
    axis: normalise([...(direction ?? [0, 0, 0])]),
    edge: cutoff ? Math.cos((cutoff[0] * Math.PI) / 180) - EDGE : -2,
    fading: (/** @type {number} */ d) => {
      const divisor = k0 + d * (k1 + d * k2);
      return clamped[0] ? Math.min(1 / divisor, 1) : divisor > 0 ? 1 / divisor : 0;
    },
  };
}

/**
 * The kernel's value at each point, linear RGB.
 * @param {Points} points
 * @param {Settings} settings
 */
function shaded(
  { material, position, view, normal, face_normal, k_d },
  { materials, lights, is_flat },
) {
  const total = new Float64Array(position.length);
  const lamps = lights.map(lampOf);
  const normals = (is_flat && face_normal) || normal;
  for (let p = 0; p < total.length; p += 3) {
    const own = materials[material[p / 3] - 1];
    if (!own) continue;
    for (let c = 0; c < 3; c++) total[p + c] = own.k_i[c] + own.ambient[c] * own.k_a[c];
    const nx = normals[p];
    const ny = normals[p + 1];
    const nz = normals[p + 2];
    const vx = view[p];
    const vy = view[p + 1];
    const vz = view[p + 2];
    const nv = nx * vx + ny * vy + nz * vz;
    for (const { position: place, diffuse, specular, exponent, axis, edge, fading } of lamps) {
      let lx = -axis[0];
      let ly = -axis[1];
      let lz = -axis[2];
      let factor = 1;
      if (place) {
        lx = place[0] - position[p];
        ly = place[1] - position[p + 1];
        lz = place[2] - position[p + 2];
        const d = Math.sqrt(lx * lx + ly * ly + lz * lz);
        const inverse = d > 0 ? 1 / d : 0;
        lx *= inverse;
        ly *= inverse;
        lz *= inverse;
        factor = fading(d);
      }
      const nl = nx * lx + ny * ly + nz * lz;
      const lv = lx * vx + ly * vy + lz * vz;
      if (!(nl > 0)) continue;
      if (edge > -2) {
        const along = -(axis[0] * lx + axis[1] * ly + axis[2] * lz);
        if (along < edge) continue;
        if (exponent) factor *= Math.max(along, 0) ** exponent;
      }
      const cosine = own.form === "blinn" ? (nl + nv) / Math.sqrt(2 + 2 * lv) : 2 * nl * nv - lv;
      const lobe = cosine > 0 ? cosine ** own.n : 0;
      for (let c = 0; c < 3; c++) {
        const base = own.k_d[c] * (k_d ? k_d[p + c] : 1);
        total[p + c] += factor * (diffuse[c] * base * nl + specular[c] * own.k_s[c] * lobe);
      }
    }
  }
  return total;
}

/** CIE L*a*b* of linear RGB as displayed. @param {Float64Array} rgb @param {number} exposure */
function labOf(rgb, exposure) {
  const white = page.xyz.map(row => row[0] + row[1] + row[2]);
  const found = new Float64Array(rgb.length);
  const f = [0, 0, 0];
  for (let p = 0; p < rgb.length; p += 3) {
    const r = clamp(rgb[p] * exposure, 0, 1);
    const g = clamp(rgb[p + 1] * exposure, 0, 1);
    const b = clamp(rgb[p + 2] * exposure, 0, 1);
    for (let row = 0; row < 3; row++) {
      const m = page.xyz[row];
      const ratio = (m[0] * r + m[1] * g + m[2] * b) / white[row];
      f[row] = ratio > 216 / 24389 ? Math.cbrt(ratio) : (841 / 108) * ratio + 16 / 116;
    }
    found[p] = 116 * f[1] - 16;
    found[p + 1] = 500 * (f[0] - f[1]);
    found[p + 2] = 200 * (f[1] - f[2]);
  }
  return found;
}

/**
 * ΔE2000 of the colours at each place of two arrays of L*a*b*.
 * @param {Float64Array} first
 * @param {Float64Array} second
 */
function differencesOf(first, second) {
  const degree = Math.PI / 180;
  const saturation = (/** @type {number} */ chroma) => 1 / Math.sqrt(1 + (25 / chroma) ** 7);
  const hueOf = (/** @type {number} */ a, /** @type {number} */ b) =>
    (Math.atan2(b, a) / degree + 360) % 360;
  return new Float64Array(first.length / 3).map((_, place) => {
    const p = 3 * place;
    const l1 = first[p];
    const l2 = second[p];
    const b1 = first[p + 2];
    const b2 = second[p + 2];
    const stretch =
      1.5 -
      0.5 *
        saturation(
          (Math.sqrt(first[p + 1] ** 2 + b1 * b1) + Math.sqrt(second[p + 1] ** 2 + b2 * b2)) / 2,
        );
    const a1 = first[p + 1] * stretch;
    const a2 = second[p + 1] * stretch;
    const c1 = Math.sqrt(a1 * a1 + b1 * b1);
    const c2 = Math.sqrt(a2 * a2 + b2 * b2);
    const h1 = hueOf(a1, b1);
    const h2 = hueOf(a2, b2);
    let turn = h2 - h1;
    let hue = h1 + h2;
    if (!(c1 * c2)) turn = 0;
    else if (Math.abs(turn) <= 180 + 1e-9) hue /= 2;
    else {
      turn -= Math.sign(turn) * 360;
      hue = (hue + (hue < 360 ? 360 : -360)) / 2;
    }
    const mean = (c1 + c2) / 2;
    const off = ((l1 + l2) / 2 - 50) ** 2;
    const cos = (/** @type {number} */ angle) => Math.cos(angle * degree);
    const t =
      1 -
      0.17 * cos(hue - 30) +
      0.24 * cos(2 * hue) +
      0.32 * cos(3 * hue + 6) -
      0.2 * cos(4 * hue - 63);
    const dl = (l2 - l1) / (1 + (0.015 * off) / Math.sqrt(20 + off));
    const dc = (c2 - c1) / (1 + 0.045 * mean);
    const dh = (2 * Math.sqrt(c1 * c2) * Math.sin((turn / 2) * degree)) / (1 + 0.015 * mean * t);
    const rotation =
      -2 * saturation(mean) * Math.sin(60 * degree * Math.exp(-(((hue - 275) / 25) ** 2)));
    return Math.sqrt(Math.max(dl * dl + dc * dc + dh * dh + rotation * dc * dh, 0));
  });
}
