// From linear light to the screen: × exposure, a tone map, then the curve of IEC 61966-2-1 (sRGB).

/**
 * Tone maps by name: linear light ≥ 0, 1 being display white, to [0, 1].
 * Reinhard: x / (1 + x), Reinhard et al. 2002. Filmic: Narkowicz's fit to ACES, 2016.
 * @type {Record<string, (x: number) => number>}
 */
const TONE_MAPS = {
  clip: (x) => x,
  reinhard: (x) => x / (1 + x),
  filmic: (x) => (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14),
};

/** False colours show luminance over this many stops below and above display white. */
const FALSE_COLOUR_STOPS = [-8, 4];

/** @param {number} linear */
function srgb(linear) {
  const x = clamp(linear, 0, 1);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
}

/**
 * The 8-bit level of each code.
 * @param {string} tone
 * @param {number} exposure a linear factor
 */
function levels(tone, exposure) {
  const curve = TONE_MAPS[tone];
  return Uint8Array.from(VALUES, (value) => Math.round(255 * srgb(curve(Math.max(value * exposure, 0)))));
}
