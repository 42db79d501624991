// The pixel inspector: the images' values at one pixel, with the digits stored.

/**
 * Texts for a pixel, by the names of their places in the page.
 * @param {Painter} painter
 * @param {Scene} scene
 * @param {number[]} pixel in pixels of the image
 * @param {View} view gives the exposure and the tone map
 */
function inspect(painter, scene, [x, y], view) {
  const { images } = painter;
  const place = Math.floor(y / images.block) * images.width + Math.floor(x / images.block);
  const flags = images.codes.flags[place];
  const shown = (/** @type {string} */ name) => valueText(images, name, place);
  const mapText = (/** @type {Legend} */ map) => (hasRange(map) ? differenceText(map, painter.values(map.name)[place]) : "");
  return {
    position: images.block > 1 ? `${x}, ${y}: mean of ${images.block} × ${images.block}` : `${x}, ${y}`,
    ...coloursOf(painter, scene, place, view, "heuristic"),
    ...coloursOf(painter, scene, place, view, "reference"),
    ...Object.fromEntries(painter.page.maps.map((map) => [map.name, mapText(map)])),
    standard_error: shown("standard_error"),
    significant: markText(flags),
    effect: effectAt(scene, x, y),
  };
}

/** A half's colour in each space, by the names of the half and the space. @param {Painter} painter @param {Scene} scene @param {number} place @param {View} view @param {string} half */
function coloursOf(painter, scene, place, view, half) {
  const rgb = painter.channels(half).map((codes) => VALUES[codes[place]]);
  const gain = half === "heuristic" ? gainOf(scene, view) : 1;
  return {
    [half]: rgb.map((value) => significant(value)),
    [`${half}_xyz`]: xyzOf(rgb).map((value) => significant(value)),
    [`${half}_lab`]: labOf(rgb, scene.exposure).map((value) => value.toFixed(1).replace("-", "−")),
    [`${half}_hex`]: hexOf(rgb, view.tone, painter.exposure * 2 ** view.ev * gain),
  };
}

/** Whether a pixel is shown to differ, in words. @param {number} flags */
function markText(flags) {
  if (!(flags & COUNTED)) return "not counted";
  if (flags & SIGNIFICANT) return "yes";
  return flags & UNDETERMINED ? "undetermined" : "no";
}

/** @param {Images} images @param {string} name @param {number} place */
function valueText(images, name, place) {
  const plane = /** @type {Plane} */ (images.planes.find((one) => one.name === name));
  return significant(VALUES[images.codes[name][place]], plane.digits);
}

/** The effect that dominates at a pixel, or else in its region; empty if unknown. @param {Scene} scene @param {number} x @param {number} y */
function effectAt(scene, x, y) {
  if (scene.effects) {
    return effectName(scene.effects, letterAt(scene.effects, (x + 0.5) / scene.width, (y + 0.5) / scene.height));
  }
  const inside = scene.regions.find(
    (region) =>
      x >= region.x && y >= region.y && x < region.x + region.width && y < region.y + region.height,
  );
  return inside?.effect ?? "";
}

/** Write a pixel's texts into the page. @param {HTMLElement} panel @param {ReturnType<typeof inspect> | null} lines */
function showInspection(panel, lines) {
  for (const cell of panel.querySelectorAll("[data-value]")) {
    const [name, index] = /** @type {HTMLElement} */ (cell).dataset.value?.split(".") ?? [];
    const value = lines?.[/** @type {keyof typeof lines} */ (name)];
    cell.textContent = (index && value ? value[Number(index)] : /** @type {string} */ (value)) ?? "–";
    if (name.endsWith("_hex")) /** @type {HTMLElement} */ (cell).style.borderColor = lines ? String(value) : "";
  }
  panel.classList.toggle("empty", !lines);
  const effect = /** @type {HTMLElement | null} */ (panel.querySelector(".effect"));
  if (effect) effect.hidden = !lines?.effect;
}
