// The first screen: a tolerance, the scenes that pass, and remedies for the others.

/** @param {HTMLElement} element */
function makeVerdict(element) {
  const rows = [.../** @type {NodeListOf<HTMLElement>} */ (element.querySelectorAll("li[data-scene]"))];
  const buttons = [.../** @type {NodeListOf<HTMLElement>} */ (element.querySelectorAll("[data-tolerance]"))];
  const bars = /** @type {HTMLElement} */ (element.querySelector(".bars"));
  const line = /** @type {HTMLElement} */ (element.querySelector("[data-line]"));
  const count = /** @type {HTMLElement} */ (element.querySelector("[data-count]"));

  /** @param {string} tolerance */
  function show(tolerance) {
    for (const button of buttons) {
      button.setAttribute("aria-pressed", String(button.dataset.tolerance === tolerance));
    }
    for (const row of rows) {
      const passes = (row.dataset.passes ?? "").split(" ").includes(tolerance);
      row.classList.toggle("passes", passes);
      for (const remedy of /** @type {NodeListOf<HTMLElement>} */ (row.querySelectorAll("[data-at]"))) {
        remedy.hidden = remedy.dataset.at !== tolerance;
      }
    }
    bars.style.setProperty("--at", tolerance);
    line.textContent = tolerance;
    const passing = rows.filter((row) => row.classList.contains("passes")).length;
    count.textContent = `${passing} of ${rows.length} ${rows.length === 1 ? "scene passes" : "scenes pass"}.`;
  }

  for (const button of buttons) {
    button.addEventListener("click", () => show(button.dataset.tolerance ?? ""));
  }
  const first = buttons.find((button) => button.getAttribute("aria-pressed") === "true");
  if (first) show(first.dataset.tolerance ?? "");
}
