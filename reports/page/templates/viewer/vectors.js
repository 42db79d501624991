// The figure of a point: N, L, R and V in the plane of incidence, and both lobes.

/** The point in the figure, the length of a vector and of the longest lobe. */
const ORIGIN = [240, 226], VECTOR = 150, LOBE = 165;

/** If lobes differ by more than this factor, the larger is cut off to keep the smaller visible. */
const CUT = 3;

/** Degrees between the directions of the textbook's lobe. */
const STEP = 1.5;

/** @param {number} degrees from the normal, to the right @param {number} radius @returns {number[]} */
function polarPoint(degrees, radius) {
  const angle = (degrees * Math.PI) / 180;
  return [ORIGIN[0] + radius * Math.sin(angle), ORIGIN[1] - radius * Math.cos(angle)];
}

/** @param {number} cosine */
function degreesOf(cosine) {
  return (Math.acos(clamp(cosine, -1, 1)) * 180) / Math.PI;
}

/**
 * The textbook's lobe in the plane of incidence.
 * @param {Material} material
 * @param {number} incidence degrees
 * @param {number[]} weights of red, green and blue in luminance
 * @returns {number[][]} pairs of degrees and a value
 */
function textbookLobe(material, incidence, weights) {
  const [k_d, k_s] = [material.k_d, material.k_s].map((k) => luminanceOf(k, weights));
  const diffuse = k_d * Math.cos((incidence * Math.PI) / 180);
  const share = material.form === "blinn" ? 0.5 : 1;
  return Array.from({ length: 180 / STEP + 1 }, (_, place) => {
    const view = -90 + place * STEP;
    const cosine = Math.max(0, Math.cos((share * (view - incidence) * Math.PI) / 180));
    return [view, diffuse + k_s * cosine ** material.n];
  });
}

/**
 * The physical lobe, interpolated between the tabulated incidences.
 * @param {Terms} terms the scene's
 * @param {Float64Array} table incidences times views
 * @param {number} incidence degrees
 * @returns {number[][]}
 */
function physicalLobe(terms, table, incidence) {
  const { incidences, views, grazing } = terms;
  const above = incidences.findIndex((/** @type {number} */ each) => each > incidence);
  const low = (above < 0 ? incidences.length - 1 : above) - 1;
  const part = clamp((incidence - incidences[low]) / (incidences[low + 1] - incidences[low]), 0, 1);
  return views.map((/** @type {number} */ side, /** @type {number} */ column) => {
    const [before, after] = [low, low + 1].map((row) => table[row * views.length + column]);
    const view = incidence + side * (side < 0 ? grazing + incidence : grazing - incidence);
    return [view, before + part * (after - before)];
  });
}

/** @param {number[]} colour @param {number[]} weights */
function luminanceOf(colour, weights) {
  return colour.reduce((sum, value, channel) => sum + value * weights[channel], 0);
}

/** @param {number[][]} lobe */
function highest(lobe) {
  return Math.max(0, ...lobe.map(([, value]) => value));
}

/** @param {string} name @param {Record<string, string | number>} attributes @param {string} text */
function drawn(name, attributes, text = "") {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.textContent = text;
  return element;
}

/** @param {string} kind @param {number[][]} lobe @param {number} top */
function drawnLobe(kind, lobe, top) {
  const points = lobe.map(([degrees, value]) => polarPoint(degrees, (LOBE * Math.min(value, top)) / top));
  const path = points.map((point) => point.map((each) => each.toFixed(1)).join(" ")).join(" L ");
  return drawn("path", { class: kind, d: `M ${ORIGIN.join(" ")} L ${path} Z` });
}

/** @param {string} letter @param {number} x along the surface, to the right @param {number} y along the normal */
function drawnVector(letter, x, y) {
  const length = VECTOR * (y < 0 ? 0.25 : 1);
  const end = [ORIGIN[0] + length * x, ORIGIN[1] - length * y];
  const size = Math.hypot(x, y) || 1;
  const away = letter === "V" ? 31 : 16; // V often lies next to R or N
  const label = [end[0] + (away * x) / size, end[1] - (away * y) / size + 5];
  return [
    drawn("line", { class: `vector ${letter}`, x1: ORIGIN[0], y1: ORIGIN[1], x2: end[0], y2: end[1] }),
    drawn("text", { class: letter, x: label[0], y: label[1] }, letter),
  ];
}

/** Where V is in the plane of incidence: along the surface towards R, and along N. @param {LightTerms} light @param {number} cosView @returns {[number, number]} */
function projectedView(light, cosView) {
  const sine = Math.sqrt(Math.max(0, 1 - light.cosIncidence ** 2));
  const along = (light.cosIncidence * cosView - light.cosView) / sine;
  return [sine > 1e-4 ? along : Math.sqrt(Math.max(0, 1 - cosView ** 2)), cosView];
}

/**
 * Draw the figure of a point, for the light that contributes most.
 * @param {SVGElement} svg
 * @param {LightTerms | null} light with its cosines, or null
 * @param {number} cosView
 * @param {{textbook: number[][], physical: number[][]} | null} lobes
 * @returns {{top: number, cut: boolean}} the value of the longest radius, and whether a lobe is longer
 */
function drawVectors(svg, light, cosView, lobes) {
  const [x, y] = ORIGIN;
  const ground = `M ${x - 180} ${y + 32} Q ${x} ${y - 32} ${x + 180} ${y + 32} Z`;
  const [a, b] = lobes ? [highest(lobes.textbook), highest(lobes.physical)] : [0, 0];
  const top = Math.min(Math.max(a, b), CUT * (Math.min(a, b) || Math.max(a, b))) || 1;
  const sine = light ? Math.sqrt(Math.max(0, 1 - light.cosIncidence ** 2)) : 0;
  svg.replaceChildren(
    drawn("path", { class: "ground", d: ground }),
    ...(lobes ? [drawnLobe("textbook", lobes.textbook, top), drawnLobe("partner", lobes.physical, top)] : []),
    ...drawnVector("N", 0, 1),
    ...(light ? drawnVector("L", -sine, light.cosIncidence) : []),
    ...(light && light.cosIncidence > 0 ? drawnVector("R", sine, light.cosIncidence) : []),
    ...(light ? drawnVector("V", ...projectedView(light, cosView)) : drawnVector("V", Math.sqrt(1 - cosView ** 2), cosView)),
  );
  return { top, cut: Math.max(a, b) > top };
}
