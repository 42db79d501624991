// The page: the address's fragment says which scene is seen, and how.

const address = makeAddress();
const verdict = document.getElementById("verdict-section");
if (verdict) makeVerdict(verdict);
const viewer = new Viewer(byId("viewer"), byId("inspector"), byId("distribution"), page, change);
const terms = new TermsPanel(byId("terms"), page);
/** @type {View} */
let view = DEFAULT_VIEW;

/** Change the view, and the address unless the change is passing: browsers allow few changes per second. @param {Partial<View>} changes */
function change(changes, passing = false) {
  view = { ...view, ...changes };
  if (!passing) address.replace(fragmentOf(view));
  show();
}

/** Show the address's view. */
function follow() {
  const before = view.scene;
  view = parseFragment(address.read());
  if (!page.scenes.some((scene) => scene.id === view.scene)) view.scene = "";
  show();
  if (view.scene !== before) arrive(view.scene || before);
}

/** Show the address's view, or the only scene. */
function begin() {
  const [only, ...others] = page.scenes;
  if (!address.read() && only?.images && !others.length) address.replace(fragmentOf({ ...DEFAULT_VIEW, scene: only.id }));
  follow();
}

function show() {
  const scene = page.scenes.find((one) => one.id === view.scene);
  document.documentElement.dataset.view = scene ? "scene" : "overview";
  const open = scene && sectionOf(scene.id);
  for (const section of document.querySelectorAll(".scene")) section.classList.toggle("open", section === open);
  if (!scene?.images) return;
  if (viewer.scene !== scene) openScene(scene);
  viewer.show(view);
}

/** @param {Scene} scene */
function openScene(scene) {
  const section = byId(`scene=${scene.id}`);
  void terms.open(scene, section);
  void viewer.open(scene, section);
  void makeSwitchboard(section);
  explainTerms(section);
}

/** @param {string} id @returns {HTMLElement} */
function byId(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/** Scroll to a scene's heading, or to where the overview was left. @param {string} id */
function arrive(id) {
  if (view.scene) {
    window.scrollTo(0, 0);
    /** @type {HTMLElement | null} */ (document.querySelector(".scene.open h2"))?.focus({ preventScroll: true });
  } else {
    document.querySelector(`.card[data-scene="${CSS.escape(id)}"]`)?.scrollIntoView({ block: "center" });
  }
}

/** @param {number} step */
function turn(step) {
  const seen = page.scenes.filter((scene) => scene.images);
  const place = seen.findIndex((scene) => scene.id === view.scene);
  const { mode, map, tone, top } = view;
  const next = seen[(place + step + seen.length) % seen.length];
  address.go(fragmentOf({ ...DEFAULT_VIEW, mode, map, tone, top, scene: next.id }));
}

listenToPrinting(viewer);
explainTerms(document.body);
listenForHelp(byId("tip"));
document.querySelector(".skip")?.addEventListener("click", (event) => {
  event.preventDefault(); // the fragment is the view's
  event.stopPropagation();
  /** @type {HTMLElement | null} */ (document.querySelector(".scene.open h2") ?? document.getElementById("main"))?.focus();
});
listenToKeys(viewer, turn, () => address.go("#"));
address.listen(follow);
begin();
