// Draws the scene in #scene with three.js into floats, and leaves them in the page as base64.
import * as THREE from "three";

/**
 * What three_js.py writes; arrays are base64.
 * @typedef {[number, number, number]} Triple
 * @typedef {{positions: string, normals: string | null, faces: string, material: Surface}} Shape
 * @typedef {{width: number, height: number, view: number[][], projection: number[][], meshes: Shape[], lights: Lamp[]}} Given
 *
 * @typedef {object} Surface
 * @property {"MeshPhongMaterial" | "MeshLambertMaterial"} type
 * @property {boolean} flat
 * @property {Triple} color
 * @property {Triple} emissive
 * @property {Triple} [specular]
 * @property {number} [shininess]
 *
 * @typedef {object} Lamp
 * @property {"DirectionalLight" | "PointLight" | "SpotLight"} type
 * @property {Triple} color
 * @property {number} intensity
 * @property {Triple} position
 * @property {Triple} [target]
 * @property {number} [decay]
 * @property {number} [angle]
 */

/** @param {string} text @param {Float32ArrayConstructor | Uint32ArrayConstructor} type */
const decoded = (text, type) =>
  new type(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);

/** @param {Float32Array} floats */
function encoded(floats) {
  const bytes = new Uint8Array(floats.buffer);
  let text = "";
  for (let start = 0; start < bytes.length; start += 0x8000) {
    text += String.fromCharCode(...bytes.subarray(start, start + 0x8000));
  }
  return btoa(text);
}

/** @param {Triple} channels */
const colour = (channels) => new THREE.Color(...channels);

/** @param {Surface} given */
function material(given) {
  const own = new THREE[given.type]({ side: THREE.DoubleSide, flatShading: given.flat });
  own.color = colour(given.color);
  own.emissive = colour(given.emissive);
  if ("specular" in own && given.specular) {
    own.specular = colour(given.specular);
    own.shininess = given.shininess ?? own.shininess;
  }
  return own;
}

/** @param {Shape} given */
function mesh(given) {
  const geometry = new THREE.BufferGeometry();
  const add = (/** @type {string} */ name, /** @type {string} */ text) =>
    geometry.setAttribute(name, new THREE.BufferAttribute(decoded(text, Float32Array), 3));
  add("position", given.positions);
  if (given.normals) add("normal", given.normals);
  geometry.setIndex(new THREE.BufferAttribute(decoded(given.faces, Uint32Array), 1));
  const made = new THREE.Mesh(geometry, material(given.material));
  made.frustumCulled = false;
  return made;
}

/** @param {Lamp} given @param {THREE.Scene} scene */
function light(given, scene) {
  const made = new THREE[given.type](colour(given.color), given.intensity);
  if ("decay" in made && given.decay !== undefined) made.decay = given.decay;
  if ("angle" in made && given.angle !== undefined) {
    made.angle = given.angle;
    made.penumbra = 0;
  }
  made.position.set(...given.position);
  if ("target" in made && given.target) {
    made.target.position.set(...given.target);
    scene.add(made.target);
  }
  scene.add(made);
}

/** @param {Given} given */
function draw(given) {
  THREE.ColorManagement.enabled = false;
  const { width, height } = given;
  const renderer = new THREE.WebGLRenderer({ antialias: false });
  renderer.toneMapping = THREE.NoToneMapping;
  renderer.setClearColor(0x000000, 0);
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType });
  const scene = new THREE.Scene();
  given.meshes.forEach((each) => scene.add(mesh(each)));
  given.lights.forEach((each) => light(each, scene));
  const camera = new THREE.Camera();
  camera.matrixAutoUpdate = false;
  camera.matrixWorld.fromArray(given.view.flat()).transpose().invert(); // given row by row
  camera.matrix.copy(camera.matrixWorld);
  camera.matrixWorldAutoUpdate = false;
  camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
  camera.projectionMatrix.fromArray(given.projection.flat()).transpose();
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
  renderer.setRenderTarget(target);
  renderer.clear();
  renderer.render(scene, camera);
  const floats = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, floats);
  return encoded(floats);
}

const told = document.createElement("pre");
try {
  told.id = "picture";
  told.textContent = draw(JSON.parse(document.getElementById("scene")?.textContent ?? ""));
} catch (error) {
  told.id = "error";
  told.textContent = String(error);
}
document.body.replaceChildren(told);
