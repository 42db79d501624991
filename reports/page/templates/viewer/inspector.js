// The pixel inspector: what the images hold at one pixel, with as many digits as they are kept to.

/**
 * Lines of text for a pixel, by the name of their place in the page.
 * @param {Painter} painter
 * @param {any} scene
 * @param {number[]} pixel in pixels of the image
 */
function inspect(painter, scene, [x, y]) {
  const { images } = painter;
  const place = Math.floor(y / images.block) * images.width + Math.floor(x / images.block);
  const flags = images.codes.flags[place];
  const shown = (/** @type {string} */ name) => valueText(images, name, place);
  const mapText = (/** @type {{name: string, kind: string}} */ { name, kind }) =>
    kind === "error" ? shown(name) : kind === "ratio" ? `${significant(painter.ratio(place), 2)} stops` : "";
  return {
    position: images.block > 1 ? `${x}, ${y}: mean of ${images.block} × ${images.block}` : `${x}, ${y}`,
    heuristic: ["R", "G", "B"].map((colour) => shown(`heuristic.${colour}`)),
    reference: ["R", "G", "B"].map((colour) => shown(`reference.${colour}`)),
    ...Object.fromEntries(painter.page.maps.map((/** @type {any} */ map) => [map.name, mapText(map)])),
    standard_error: shown("standard_error"),
    significant: markText(flags),
    effect: effectAt(scene, x, y),
  };
}

/** Whether a pixel is shown to differ. @param {number} flags */
function markText(flags) {
  if (!(flags & COUNTED)) return "not counted";
  if (flags & SIGNIFICANT) return "yes";
  return flags & UNDETERMINED ? "undetermined" : "no";
}

/** @param {Images} images @param {string} name @param {number} place */
function valueText(images, name, place) {
  const plane = /** @type {Plane} */ (images.planes.find((one) => one.name === name));
  return significant(decimal(images.codes[name][place], plane.digits), plane.digits);
}

/** The effect that dominates at a pixel, or else in its region, where that is known. @param {any} scene @param {number} x @param {number} y */
function effectAt(scene, x, y) {
  if (scene.effects) {
    return effectName(scene.effects, letterAt(scene.effects, (x + 0.5) / scene.width, (y + 0.5) / scene.height));
  }
  const inside = scene.regions.find(
    (/** @type {any} */ region) =>
      x >= region.x && y >= region.y && x < region.x + region.width && y < region.y + region.height,
  );
  return inside?.effect ?? "";
}

/** Writes a pixel's lines into the page. @param {HTMLElement} panel @param {ReturnType<typeof inspect> | null} lines */
function showInspection(panel, lines) {
  for (const cell of panel.querySelectorAll("[data-value]")) {
    const [name, index] = /** @type {HTMLElement} */ (cell).dataset.value?.split(".") ?? [];
    const value = lines?.[/** @type {keyof typeof lines} */ (name)];
    cell.textContent = (index && value ? value[Number(index)] : /** @type {string} */ (value)) ?? "–";
  }
  const effect = /** @type {HTMLElement | null} */ (panel.querySelector(".effect"));
  if (effect) effect.hidden = !lines?.effect;
}
