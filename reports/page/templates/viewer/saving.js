// The picture as shown, as a PNG file named after its content.

/** @param {Viewer} viewer */
function savePicture(viewer) {
  const { view, viewport, scene } = viewer;
  viewer.canvas.toBlob((blob) => {
    if (!blob) return;
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `${pictureName(view, viewport, scene)}.png` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}

/** Scene, mode, any map, and region: the selection, or else the visible part of a zoomed image. @param {View} view @param {Viewport} viewport @param {Scene} scene */
function pictureName(view, viewport, scene) {
  const parts = [scene.id, view.mode];
  if (view.mode === "side" || view.mode === "error") parts.push(view.map);
  const box = view.box ?? (view.zoom === null ? null : viewport.seen(view));
  if (box) parts.push(`${box[0]},${box[1]}+${box[2]}x${box[3]}`);
  return parts.join("-");
}
