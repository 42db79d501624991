// The rows of the table of terms.

/** @param {string} name @param {string} words @param {string[]} values @param {string} kind */
function termRow(name, words, values, kind = "") {
  const line = Object.assign(document.createElement("tr"), { className: kind });
  const head = Object.assign(document.createElement("th"), { scope: "row" });
  head.append(...rich(name));
  const text = Object.assign(document.createElement("td"), { className: "text" });
  text.append(...rich(words));
  const cells = values.map((value) => Object.assign(document.createElement("td"), { textContent: value }));
  line.append(head, text, ...cells);
  return line;
}

/** Text in which _{…} is a subscript and ^{…} an exponent. @param {string} words */
function rich(words) {
  return words.split(/([_^]\{[^}]*\})/).map((part) => {
    const found = /^([_^])\{(.*)\}$/.exec(part);
    return found ? Object.assign(document.createElement(found[1] === "_" ? "sub" : "sup"), { textContent: found[2] }) : part;
  });
}

/** A number of a term; "< 0.0001" below the page's precision. @param {number} value */
function amount(value) {
  return value > 0 && value < 1e-4 ? "< 0.0001" : significant(value, 3);
}

/** A factor of a term, without trailing zeros. @param {number} value */
function factor(value, digits = 3) {
  const text = significant(value, digits);
  return /[×]/.test(text) ? text : text.replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}

/** @param {number[]} colour */
function colourText(colour) {
  const texts = colour.map((value) => factor(value));
  return texts.every((text) => text === texts[0]) ? texts[0] : `(${texts.join(", ")})`;
}

/** @param {TermsPoint} point */
function termRows(point) {
  const { material } = point;
  const rows = [];
  if (material.k_i.some(Boolean)) rows.push(termRow("emission", `k_{i} = ${colourText(material.k_i)}`, material.k_i.map(amount)));
  rows.push(termRow("ambient", `I_{a} k_{a} = ${colourText(material.ambient)} × ${colourText(material.k_a)}`, point.ambient.map(amount)));
  for (const light of point.lights) rows.push(...lightRows(light, material));
  if (point.others) rows.push(termRow("other lights", "diffuse and specular", point.others.map(amount)));
  return rows;
}

/** @param {LightTerms} light @param {Material} material */
function lightRows(light, material) {
  const arriving = `${colourText(light.intensity)} × ${factor(light.attenuation)}`;
  const isLit = light.cosIncidence > 0;
  const cosine = Math.max(material.form === "blinn" ? light.lobe ** (1 / material.n) : light.cosReflection, 0);
  const base = material.form === "blinn" ? "N·H" : "R·V";
  const behind = `N·L = ${factor(light.cosIncidence)}: the light is behind the surface`;
  const power = `${factor(cosine, 4)}^{${factor(material.n)}}`;
  return [
    termRow(light.name, `I_{p0} f_{att} = ${arriving}`, ["", "", ""], "light"),
    termRow("diffuse", isLit ? `× k_{d} (N·L) = × ${colourText(material.k_d)} × ${factor(light.cosIncidence)}` : behind, light.diffuse.map(amount)),
    termRow("specular", isLit ? `× k_{s} (${base})^{n} = × ${colourText(material.k_s)} × ${power}` : "", light.specular.map(amount)),
  ];
}

/** The sum of the terms, and the reference. @param {AnyPoint} point @param {Images} images */
function sumRows(point, images) {
  const [x, y] = point.pixel;
  const place = Math.floor(y / images.block) * images.width + Math.floor(x / images.block);
  const shown = (/** @type {string} */ name) => valueText(images, name, place);
  const rows = point.material ? [termRow("textbook", "the sum of the terms", point.total.map(amount), "total")] : [];
  rows.push(termRow("physical", `± ${shown("standard_error")} in its noisiest channel`, ["R", "G", "B"].map((colour) => shown(`reference.${colour}`)), "reference"));
  return rows;
}
