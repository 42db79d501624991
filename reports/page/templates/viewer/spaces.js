// Colours of a pixel in other spaces, with the formulas of ΔE2000 in definitions.py.

/** CIE XYZ (display white has Y = 1) of linear BT.709. @param {number[]} rgb @returns {number[]} */
function xyzOf(rgb) {
  return page.xyz.map((row) => row.reduce((sum, weight, channel) => sum + weight * rgb[channel], 0));
}

/** CIE L*a*b* (D65) of linear RGB as a display shows it: exposed, then clipped. @param {number[]} rgb @param {number} exposure */
function labOf(rgb, exposure) {
  const white = xyzOf([1, 1, 1]);
  const curve = (/** @type {number} */ t) => (t > (6 / 29) ** 3 ? Math.cbrt(t) : t / (3 * (6 / 29) ** 2) + 4 / 29);
  const [x, y, z] = xyzOf(rgb.map((value) => clamp(value * exposure, 0, 1))).map((value, axis) => curve(value / white[axis]));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

/** "#rrggbb" as shown, with exposure and tone map. @param {number[]} rgb @param {string} tone @param {number} factor */
function hexOf(rgb, tone, factor) {
  const curve = TONE_MAPS[tone] ?? TONE_MAPS.clip;
  const level = (/** @type {number} */ value) => Math.round(255 * srgb(curve(Math.max(value * factor, 0))));
  return `#${rgb.map((value) => level(value).toString(16).padStart(2, "0")).join("")}`;
}
