// Equation 8.10 at the marked pixel, with its numbers, from the page's grid (see why_view.py).

/** The largest code of the grid. */
const LARGEST_CODE = 65535;

/**
 * @typedef {{terms: Terms, grid: Images, planes: Record<string, Float64Array>}} TermsData
 * @typedef {ReturnType<typeof lightTerms>} LightTerms
 */

class TermsPanel {
  /** @param {HTMLElement} panel */
  constructor(panel) {
    this.panel = panel;
    /** @type {Pictured | null} */
    this.scene = null;
    /** @type {TermsData | null} */
    this.data = null;
  }

  /** Move into a scene's section. @param {Pictured} scene @param {HTMLElement} section */
  async open(scene, section) {
    const { terms } = scene;
    Object.assign(this, { scene, data: null });
    this.panel.hidden = !terms;
    if (!terms) return;
    section.querySelector(".terms-slot")?.append(this.panel);
    this.part("missing").hidden = !terms.missing;
    this.part("missing").textContent = `No numbers at a pixel. ${terms.missing}`;
    this.part("whole").hidden = !terms.grid;
    if (!terms.grid) return;
    const grid = await imagesIn(`data-terms-${scene.id}`, terms.grid);
    const valueOf = (/** @type {string} */ name, /** @type {number} */ code) =>
      name in terms.tops
        ? terms.tops[name] * (code / LARGEST_CODE) ** 2
        : (2 * code) / LARGEST_CODE - 1;
    const planes = Object.entries(grid.codes).map(([name, codes]) => [
      name,
      Float64Array.from(codes, code => valueOf(name, code)),
    ]);
    if (this.scene === scene) this.data = { terms, grid, planes: Object.fromEntries(planes) };
  }

  /** @param {string} name @returns {HTMLElement} */
  part(name) {
    return /** @type {HTMLElement} */ (this.panel.querySelector(`[data-part=${name}]`));
  }

  /**
   * List the terms at the grid's point nearest to a pixel.
   * @param {Painter} painter
   * @param {number[]} pixel
   */
  show(painter, [x, y]) {
    const { scene, data } = this;
    if (!scene || !data || painter.scene !== scene) return;
    const { width, height, codes } = data.grid;
    const [column, row] = [
      Math.floor((x * width) / scene.width),
      Math.floor((y * height) / scene.height),
    ];
    const pixel = [data.terms.columns[column], data.terms.rows[row]];
    const place = row * width + column;
    const material = data.terms.materials[codes.material[place] - 1];
    const near = pixel[0] === x && pixel[1] === y ? "" : `, the nearest to ${x}, ${y}`;
    const seen = material ? `: ${material.name}` : ", where no surface is seen";
    this.part("place").textContent = `at ${pixel.join(", ")}${near}${seen}`;
    const rows = material ? termRows(data, material, place) : [];
    const own = painter.placeOf(pixel);
    const error = VALUES[painter.images.codes.standard_error[own]];
    rows.push(
      termRow(
        scene.truth.name,
        `± ${significant(error, 2)} in its noisiest channel`,
        painter.colour("reference", own).map(value => significant(value)),
        "sum",
      ),
    );
    this.panel.querySelector("tbody")?.replaceChildren(...rows);
  }
}

/**
 * The rows of all terms, and of their sum.
 * @param {TermsData} data
 * @param {Material} material
 * @param {number} place
 */
function termRows({ terms, planes }, material, place) {
  const at = (/** @type {string} */ name) => planes[name][place];
  const lights = terms.lights.map((light, index) =>
    lightTerms(light, material, at("cos_view"), name => at(`${index}.${name}`)),
  );
  const ambient = product(material.ambient, material.k_a);
  const others =
    "others.R" in planes ? ["R", "G", "B"].map(channel => at(`others.${channel}`)) : [0, 0, 0];
  const parts = [
    material.k_i,
    ambient,
    others,
    ...lights.flatMap(light => [light.diffuse, light.specular]),
  ];
  const total = [0, 1, 2].map(channel => parts.reduce((sum, part) => sum + part[channel], 0));
  const rows = lights.flatMap(light => lightRows(light, material));
  rows.unshift(
    termRow(
      "ambient",
      `I_{a} k_{a} = ${colourText(material.ambient)} × ${colourText(material.k_a)}`,
      ambient.map(amount),
    ),
  );
  if (material.k_i.some(Boolean))
    rows.unshift(
      termRow("emission", `k_{i} = ${colourText(material.k_i)}`, material.k_i.map(amount)),
    );
  if (others.some(Boolean))
    rows.push(termRow("other lights", "diffuse and specular", others.map(amount)));
  const where = "the textbook at the pixel’s centre";
  return [...rows, termRow("sum of the terms", where, total.map(amount), "sum")];
}

/**
 * @param {Lamp} light
 * @param {Material} material
 * @param {number} normalView
 * @param {(name: string) => number} at
 */
function lightTerms(light, material, normalView, at) {
  const [attenuation, cosIncidence, cosView, lobe] = [
    "attenuation",
    "cos_incidence",
    "cos_view",
    "lobe",
  ].map(at);
  return {
    ...light,
    attenuation,
    cosIncidence,
    lobe,
    cosReflection: 2 * cosIncidence * normalView - cosView,
    diffuse: product(light.intensity, material.k_d).map(
      value => value * attenuation * Math.max(cosIncidence, 0),
    ),
    specular: product(light.specular_intensity, material.k_s).map(
      value => value * attenuation * lobe,
    ),
  };
}

/** @param {LightTerms} light @param {Material} material */
function lightRows(light, material) {
  const isLit = light.cosIncidence > 0;
  const isBlinn = material.form === "blinn";
  const cosine = Math.max(isBlinn ? light.lobe ** (1 / material.n) : light.cosReflection, 0);
  const cosIncidence = factor(light.cosIncidence);
  const behind = `N·L = ${cosIncidence}: the light is behind the surface`;
  const [diffuse, specular] = [light.intensity, light.specular_intensity].map(colourText);
  const [symbol, second] =
    diffuse === specular ? ["I_{p0}", ""] : ["L_{d}", `; L_{s} = ${specular}`];
  const angle = isBlinn ? "N·H" : "R·V";
  const power = `(${angle})^{n} = ${factor(cosine, 4)}^{${factor(material.n)}}`;
  const shine = cosine > 0 ? power : `${angle} = 0, far from the highlight`;
  const specularText = material.k_s.some(Boolean)
    ? `I k_{s} (${angle})^{n}: k_{s} = ${colourText(material.k_s)}, ${shine}`
    : "k_{s} = 0: no highlight";
  const arriving = `I = ${symbol} f_{att} = ${diffuse} × ${factor(light.attenuation)}`;
  const dark = `f_{att} = 0: none of its light arrives; ${symbol} = ${diffuse}`;
  return [
    termRow(
      light.name,
      `${light.attenuation > 0 ? arriving : dark}${second}`,
      ["", "", ""],
      "light",
    ),
    termRow(
      "diffuse",
      isLit
        ? `I k_{d} (N·L): k_{d} = ${colourText(material.k_d)}, N·L = ${cosIncidence}`
        : behind,
      light.diffuse.map(amount),
    ),
    termRow("specular", isLit ? specularText : "", light.specular.map(amount)),
  ];
}

/** @param {number[]} a @param {number[]} b */
const product = (a, b) => a.map((value, channel) => value * b[channel]);

/** A number of a term; "< 0.0001" below the page's precision. @param {number} value */
const amount = value => (value > 0 && value < 1e-4 ? "< 0.0001" : significant(value));

/** A factor of a term, without trailing zeros. @param {number} value */
function factor(value, digits = 3) {
  const text = significant(value, digits);
  return text.includes("×") ? text : text.replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}

/** @param {number[]} colour */
function colourText(colour) {
  const texts = colour.map(value => factor(value));
  return texts.every(text => text === texts[0]) ? texts[0] : `(${texts.join(", ")})`;
}

/** @param {string} name @param {string} words @param {string[]} values @param {string} kind */
function termRow(name, words, values, kind = "") {
  const line = Object.assign(document.createElement("tr"), { className: kind });
  const [head, text, ...cells] = ["th", "td", ...values.map(() => "td")].map(tag =>
    document.createElement(tag),
  );
  head.setAttribute("scope", "row");
  head.textContent = name;
  text.className = "text";
  text.append(...rich(words));
  cells.forEach((cell, place) => {
    cell.textContent = values[place];
  });
  line.append(head, text, ...cells);
  return line;
}

/** Text in which _{…} is a subscript and ^{…} an exponent. @param {string} words */
function rich(words) {
  return words.split(/([_^]\{[^}]*\})/).map(part => {
    const found = /^([_^])\{(.*)\}$/.exec(part);
    return found
      ? Object.assign(document.createElement(found[1] === "_" ? "sub" : "sup"), {
          textContent: found[2],
        })
      : part;
  });
}
