// The page: the address's fragment says which scene is seen, and how.

const address = makeAddress();
const viewer = new Viewer(byId("viewer"), change);
const terms = new TermsPanel(byId("terms"));
const live = new LiveShading(byId("live"), change);
let view = DEFAULT_VIEW;
const sliders = /** @type {HTMLInputElement[]} */ (elementsIn("[data-threshold]"));
/** How far the overview was scrolled when it was left. */
let left = 0;

/**
 * Change the view, and the address unless the change is passing: browsers allow few changes per
 * second.
 * @param {Partial<View>} changes
 */
function change(changes, passing = false) {
  view = { ...view, ...changes };
  if (!passing) address.replace(fragmentOf(view));
  show();
}

/** Show the address's view; links to scenes keep the threshold. */
function follow() {
  const before = view;
  view = parseFragment(address.read());
  const isKnown = page.scenes.some(scene => scene.id === view.scene && !scene.failed);
  const unknown = byId("unknown");
  unknown.hidden = isKnown || !view.scene;
  unknown.textContent = `This page has no pictures of “${view.scene}”: choose a scene below.`;
  if (!isKnown) view.scene = "";
  if (!before.scene && view.scene) left = window.scrollY;
  if (!/[#&]t=/.test(address.read()) && before.t !== view.t) {
    view.t = before.t;
    address.replace(fragmentOf(view));
  }
  show();
  if (view.scene === before.scene) return;
  window.scrollTo(0, view.scene ? 0 : left);
  if (view.scene)
    /** @type {HTMLElement | null} */ (document.querySelector(".scene.open h1"))?.focus({
      preventScroll: true,
    });
}

function show() {
  const place = placeOf(view.t);
  const scene = page.scenes.find(one => one.id === view.scene);
  document.documentElement.dataset.view = scene ? "scene" : "overview";
  for (const slider of sliders) {
    slider.value = String(view.t);
    if (slider.nextElementSibling) slider.nextElementSibling.textContent = String(view.t);
  }
  const open = scene ? sectionOf(scene.id) : null;
  for (const section of document.querySelectorAll(".scene"))
    section.classList.toggle("open", section === open);
  if (!scene) showOverview(view.t);
  if (!scene || scene.failed || !open) return;
  showScene(open, scene, place);
  if (!scene.images) return;
  if (viewer.scene !== scene) openScene(/** @type {Pictured} */ (scene), open);
  viewer.show(view);
  showTerms();
}

/** Scenes wait as text, in <noscript>: a page of many scenes loads fast. @param {string} id */
function sectionOf(id) {
  const waiting = document.querySelector(`noscript[data-scene="${CSS.escape(id)}"]`);
  if (waiting) waiting.outerHTML = waiting.textContent ?? "";
  return document.getElementById(`scene=${id}`);
}

/** @param {Pictured} scene @param {HTMLElement} section */
function openScene(scene, section) {
  live.open(scene, section);
  void Promise.all([viewer.open(scene, section), terms.open(scene, section)]).then(showTerms);
  explainTerms(section);
}

function showTerms() {
  if (!viewer.painter) return;
  terms.show(viewer.painter, view.pixel ?? viewer.scene.worst.pixel);
  live.show(viewer.painter, view);
}

/** @param {number} step */
function turn(step) {
  const seen = page.scenes.filter(scene => scene.images);
  const next =
    seen[(seen.findIndex(scene => scene.id === view.scene) + step + seen.length) % seen.length];
  address.go(
    fragmentOf({ ...DEFAULT_VIEW, t: view.t, mode: view.mode, map: view.map, scene: next.id }),
  );
}

for (const slider of sliders)
  slider.addEventListener("input", () => change({ t: Number(slider.value) }));
for (const link of elementsIn("[data-jump]")) {
  link.addEventListener("click", event => {
    event.preventDefault(); // the fragment is the view's
    event.stopPropagation();
    if (view.scene && link.dataset.jump !== "main")
      address.go(fragmentOf({ ...DEFAULT_VIEW, t: view.t }));
    setTimeout(() => {
      const target = byId(link.dataset.jump ?? "");
      target.scrollIntoView();
      target.focus({ preventScroll: true });
    });
  });
}
window.addEventListener("beforeprint", () => {
  for (const part of document.querySelectorAll(".scene.open details"))
    part.setAttribute("open", "");
});
listenToKeys(viewer, turn, () => address.go(fragmentOf({ ...DEFAULT_VIEW, t: view.t })));
address.listen(follow);
const [only, ...others] = page.scenes;
if (!address.read() && only?.images && !others.length)
  address.replace(fragmentOf({ ...DEFAULT_VIEW, scene: only.id }));
follow();

/** Milliseconds without a new page, after which the command that writes it is taken to be gone. */
const PATIENCE = 10 * 60 * 1000;

if (page.written !== null) {
  const age = Date.now() - page.written;
  // The older the page, the longer the next one takes.
  if (age < PATIENCE) setTimeout(() => location.reload(), Math.max(2000, age / 10));
  else byId("state").textContent = "Unfinished, and no longer written: run the command again.";
}
