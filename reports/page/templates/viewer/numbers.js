// Numbers as the page prints them, and the 16-bit codes that embedded images are made of.

const LOWEST_EXPONENT = -18;
const NEGATIVE = 0x8000;

/**
 * The value of a decimal code: 0 for 0, else ± m · 10^(e − digits + 1) with m of `digits` digits.
 * @param {number} code
 * @param {number} digits
 */
function decimal(code, digits) {
  const magnitude = code & (NEGATIVE - 1);
  if (!magnitude) return 0;
  const unit = 10 ** (digits - 1);
  const place = magnitude - 1;
  const exponent = Math.floor(place / (9 * unit)) + LOWEST_EXPONENT - digits + 1;
  const mantissa = (place % (9 * unit)) + unit;
  return Number(`${code & NEGATIVE ? "-" : ""}${mantissa}e${exponent}`);
}

/** Tables of values by digits, made when first needed. @type {Map<number, Float64Array>} */
const TABLES = new Map();

/** The values of all codes of some digits, looked up in painting images. @param {number} digits */
function valuesOf(digits) {
  const table = TABLES.get(digits) ?? Float64Array.from({ length: 65536 }, (_, code) => decimal(code, digits));
  TABLES.set(digits, table);
  return table;
}

/** The values of an image's codes. */
const VALUES = valuesOf(3);

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
