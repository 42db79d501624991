// Shapes and materials: pointing at a name lights up its pixels.

/** @typedef {{width: number, height: number, picture: string, maps: string}} Lit */

/** Brightness of the other pixels. */
const SHADE = 0.25;

/** Make the table of a scene's shapes live when the scene is first opened. @param {HTMLElement} section */
async function makeObjects(section) {
  const element = /** @type {HTMLElement | null} */ (section.querySelector(".objects"));
  const canvas = element?.querySelector("canvas");
  if (!element || !canvas || element.dataset.ready) return;
  element.dataset.ready = "soon";
  /** @type {Lit} */
  const lit = JSON.parse(element.querySelector("script")?.textContent ?? "{}");
  const picture = Object.assign(new Image(), { src: lit.picture });
  const [maps] = await Promise.all([inflate(lit.maps), picture.decode()]);
  const size = lit.width * lit.height;
  const planes = { objects: maps.subarray(0, size), materials: maps.subarray(size) };
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  /** The clicked name, whose pixels stay lit. @type {HTMLElement | null} */
  let kept = null;

  /** @param {HTMLElement | null} link */
  function light(link) {
    for (const row of element?.querySelectorAll("tr.lit") ?? []) row.classList.remove("lit");
    context.drawImage(picture, 0, 0);
    if (!link) return;
    link.closest("tr")?.classList.add("lit");
    const plane = planes[/** @type {keyof typeof planes} */ (link.dataset.lights)];
    const seen = context.getImageData(0, 0, lit.width, lit.height);
    plane.forEach((row, pixel) => {
      if (row === Number(link.dataset.row)) return;
      for (let channel = 0; channel < 3; channel++) seen.data[4 * pixel + channel] *= SHADE;
    });
    context.putImageData(seen, 0, 0);
  }

  for (const link of /** @type {NodeListOf<HTMLElement>} */ (element.querySelectorAll("[data-lights]"))) {
    const row = /** @type {HTMLElement} */ (link.closest("tr"));
    row.addEventListener("pointerenter", () => light(link));
    row.addEventListener("pointerleave", () => light(kept));
    link.addEventListener("focus", () => light(link));
    link.addEventListener("blur", () => light(kept));
    link.addEventListener("click", () => light((kept = link)));
  }
  light(null);
  element.dataset.ready = "yes";
}
