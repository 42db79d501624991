// Embedded images back to numbers; reports/page/embedding.py encodes them.

/**
 * @typedef {{name: string, digits: number, base: string | null}} Plane
 * @typedef {{width: number, height: number, block: number, planes: Plane[], data: string}} Manifest
 * @typedef {Manifest & {codes: Record<string, Uint16Array>}} Images
 */

/** Decoded images by the ids of their scenes. @type {Map<string, Promise<Images>>} */
const decoded = new Map();

/**
 * The images of a scene, decoded when first requested.
 * @param {string} id
 * @param {Manifest} manifest
 */
function imagesOf(id, manifest) {
  if (!decoded.has(id)) decoded.set(id, decode(manifest, dataOf(id)));
  return /** @type {Promise<Images>} */ (decoded.get(id));
}

/** @param {string} id */
function dataOf(id) {
  return document.getElementById(`data-${id}`)?.textContent ?? "";
}

/** @param {Manifest} manifest @param {string} data @returns {Promise<Images>} */
async function decode(manifest, data) {
  const raw = await inflate(data.trim());
  const size = manifest.width * manifest.height;
  /** @type {Record<string, Uint16Array>} */
  const codes = {};
  manifest.planes.forEach((plane, number) => {
    const bytes = raw.subarray(2 * size * number, 2 * size * (number + 1));
    codes[plane.name] = undifference(bytes, manifest.width, plane.base ? codes[plane.base] : null);
  });
  return { ...manifest, codes };
}

/** Base64 of a zlib stream to bytes. @param {string} base64 */
async function inflate(base64) {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * One plane: low and high bytes joined, the zigzag undone, differences to the left and to the base
 * plane summed, all modulo 2^16.
 * @param {Uint8Array} bytes
 * @param {number} width
 * @param {Uint16Array | null} base
 */
function undifference(bytes, width, base) {
  const codes = new Uint16Array(bytes.length / 2);
  let sum = 0;
  for (let place = 0; place < codes.length; place++) {
    const zigzag = bytes[place] | (bytes[place + codes.length] << 8);
    const difference = (zigzag >>> 1) ^ -(zigzag & 1);
    sum = ((place % width ? sum : 0) + difference) & 0xffff;
    codes[place] = sum + (base ? base[place] : 0);
  }
  return codes;
}
