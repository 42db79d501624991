// Numbers as the page prints them, and the half floats that embedded images are made of.

/** The values of all half floats, by their 16 bits (IEEE 754). */
const VALUES = Float64Array.from({ length: 65536 }, (_, code) => {
  const [exponent, fraction] = [(code >> 10) & 31, (code & 1023) / 1024];
  const size = exponent ? (1 + fraction) * 2 ** (exponent - 15) : fraction * 2 ** -14;
  return code & 0x8000 ? -size : size;
});

/**
 * A value with `digits` significant digits, in human form.
 * @param {number} value
 * @param {number} digits
 */
function significant(value, digits = 3) {
  if (!value) return "0";
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const exponent = Number(power);
  const plain = exponent >= -3 && exponent < Math.max(digits, 3);
  const text = plain
    ? value.toFixed(Math.max(0, digits - 1 - exponent))
    : `${mantissa} × 10${superscript(exponent)}`;
  return text.replace("-", "−");
}

/** A set value without needless digits. @param {number} value */
function plainly(value) {
  return String(Number(value.toPrecision(4))).replace("-", "−");
}

/** @param {number} part of 1 */
function percentText(part) {
  const value = 100 * part;
  return value > 0 && value < 0.1 ? "< 0.1 %" : `${value >= 99.95 ? "100" : value.toPrecision(value < 1 ? 1 : value < 10 ? 2 : 3)} %`;
}

/** A value of a map; a hundredth of a colour difference is invisible. @param {{kind: string, top: number}} map @param {number} value */
function differenceText(map, value, digits = 3) {
  if (map.kind === "ratio") return `${significant(value, 2)} stops`;
  return value > 0 && value < 0.01 && map.top >= 1 ? "< 0.01" : significant(value, digits);
}

/** @param {number} exponent */
function superscript(exponent) {
  return [...String(exponent)].map((sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)])).join("");
}

/** @param {number} value @param {number} low @param {number} high */
function clamp(value, low, high) {
  return Math.min(Math.max(value, low), high);
}
