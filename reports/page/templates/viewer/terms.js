// Equation 8.10 at the picked pixel, with its numbers, from the page's grid.

/** The largest code of the grid; see reports/page/terms_view.py. */
const LARGEST_CODE = 65535;

/**
 * @typedef {Awaited<ReturnType<typeof termsOf>>} TermsData
 * @typedef {ReturnType<typeof lightTerms>} LightTerms
 * @typedef {ReturnType<typeof termsAt>} AnyPoint of a surface or the background
 * @typedef {Extract<AnyPoint, {material: Material}>} TermsPoint
 */

class TermsPanel {
  /** @param {HTMLElement} panel @param {Page} page */
  constructor(panel, page) {
    this.panel = panel;
    /** @type {Scene | null} */
    this.scene = null;
    /** @type {TermsData | null} */
    this.data = null;
    /** @type {number[] | null} */
    this.asked = null;
    document.addEventListener("pick", (event) => {
      const { scene, pixel } = /** @type {CustomEvent} */ (event).detail;
      if (pixel && scene === this.scene?.id) this.show(pixel);
    });
  }

  /** Move into a scene's section, and show its first pixel. @param {Scene} scene @param {HTMLElement} section */
  async open(scene, section) {
    const { terms } = scene;
    this.scene = scene;
    this.data = this.asked = null;
    this.panel.hidden = !terms;
    if (!terms) return;
    section.querySelector(".pictures")?.after(this.panel); // first on paper, hidden on screens
    this.part("missing").hidden = !terms.missing;
    this.part("missing").textContent = `No terms. ${terms.missing}`;
    this.part("whole").hidden = !terms.grid;
    this.part("place").textContent = "";
    if (!terms.grid) return;
    const data = await termsOf(scene, terms, terms.grid);
    if (this.scene !== scene) return; // another one was opened meanwhile
    this.data = data;
    this.show(this.asked ?? firstPixel(scene, data));
  }

  /** @param {number[]} pixel */
  show(pixel) {
    this.asked = pixel;
    if (!this.scene || !this.data) return;
    const point = termsAt(this.scene, this.data, pixel);
    const [x, y] = point.pixel;
    this.part("place").textContent = `at ${x}, ${y}${point.material ? `: ${point.material.name}` : ", where no surface is seen"}`;
    this.listTerms(point, this.scene);
  }

  /** @param {AnyPoint} point @param {Scene} scene */
  listTerms(point, scene) {
    const [list, sums] = this.panel.querySelectorAll("tbody");
    list.replaceChildren(...(point.material ? termRows(point) : []));
    void imagesOf(scene.id, scene.images).then((images) => {
      if (this.scene === scene) sums.replaceChildren(...sumRows(point, images));
    });
  }

  /** @param {string} name @returns {HTMLElement} */
  part(name) {
    return /** @type {HTMLElement} */ (this.panel.querySelector(`[data-part=${name}]`));
  }
}

/** Planes of a scene's grid as numbers. @param {Scene} scene @param {Terms} terms @param {Manifest} grid */
async function termsOf(scene, terms, grid) {
  const { tops } = terms;
  const { codes } = await imagesOf(`terms-${scene.id}`, grid);
  const values = (/** @type {string} */ name, /** @type {Uint16Array} */ plane) =>
    Float64Array.from(plane, (code) =>
      name in tops ? tops[name] * (code / LARGEST_CODE) ** 2 : (2 * code) / LARGEST_CODE - 1);
  /** @type {Record<string, Float64Array>} */
  const planes = Object.fromEntries(Object.entries(codes).map(([name, plane]) => [name, values(name, plane)]));
  return {
    terms,
    grid,
    material: codes.material,
    planes,
  };
}

/** The middle of the largest region if it shows a surface, or else of the picture. @param {Scene} scene @param {TermsData} data */
function firstPixel(scene, data) {
  const [region] = scene.regions;
  const inside = region && [region.x + (region.width >> 1), region.y + (region.height >> 1)];
  const places = [...(inside ? [inside] : []), [scene.width >> 1, scene.height >> 1]];
  const seen = places.filter((pixel) => termsAt(scene, data, pixel).material);
  const shaded = seen.find((pixel) => !termsAt(scene, data, pixel).material?.k_i.some(Boolean)); // not a lamp
  return shaded ?? seen[0] ?? places[0];
}

/**
 * The terms at the point of the grid nearest to a pixel; `material` is null on the background.
 * @param {Scene} scene
 * @param {TermsData} data
 * @param {number[]} pixel
 */
function termsAt(scene, data, [x, y]) {
  const { terms } = data;
  const { width, height } = data.grid;
  const column = Math.floor((x * width) / scene.width), row = Math.floor((y * height) / scene.height);
  const middle = (/** @type {number} */ cell, /** @type {number} */ count, /** @type {number} */ side) =>
    Math.floor(((2 * cell + 1) * side) / (2 * count));
  const place = row * width + column;
  const number = data.material[place] - 1;
  const at = (/** @type {string} */ name) => data.planes[name][place];
  const pixel = [middle(column, width, scene.width), middle(row, height, scene.height)];
  const material = /** @type {Material | null} */ (terms.materials[number] ?? null);
  if (!material) return { pixel, material, number, cosView: 0, lights: [], total: [0, 0, 0] };
  const lights = terms.lights.map((light, index) =>
    lightTerms(light, material, at("cos_view"), (name) => at(`${index}.${name}`)));
  const ambient = product(material.ambient, material.k_a);
  const others = "others.R" in data.planes ? ["R", "G", "B"].map((colour) => at(`others.${colour}`)) : null;
  const parts = [material.k_i, ambient, ...(others ? [others] : []), ...lights.flatMap((light) => [light.diffuse, light.specular])];
  const total = parts.reduce((sum, part) => sum.map((/** @type {number} */ value, /** @type {number} */ channel) => value + part[channel]));
  return { pixel, material, number, cosView: at("cos_view"), ambient, lights, others, total };
}

/** @param {Lamp} light @param {Material} material @param {number} normalView @param {(name: string) => number} at */
function lightTerms(light, material, normalView, at) {
  const [attenuation, cosIncidence, cosView, lobe] = ["attenuation", "cos_incidence", "cos_view", "lobe"].map(at);
  const arriving = light.intensity.map((value) => value * attenuation);
  return {
    ...light, attenuation, cosIncidence, cosView, lobe,
    cosReflection: 2 * cosIncidence * normalView - cosView,
    diffuse: product(arriving, material.k_d).map((value) => value * Math.max(cosIncidence, 0)),
    specular: product(arriving, material.k_s).map((value) => value * lobe),
  };
}

/** @param {number[]} a @param {number[]} b */
function product(a, b) {
  return a.map((value, channel) => value * b[channel]);
}
