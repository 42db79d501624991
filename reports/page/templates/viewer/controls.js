// The viewer's controls set the view and show it. Those without an effect are disabled.

class Controls {
  /** @param {Viewer} viewer */
  constructor(viewer) {
    this.viewer = viewer;
    this.element = viewer.element;
    this.element.addEventListener("click", (event) => {
      const button = /** @type {HTMLElement} */ (event.target).closest("button");
      if (button?.dataset.mode) viewer.change({ mode: button.dataset.mode });
      if (button?.dataset.action) viewer.act(button.dataset.action);
    });
    for (const control of this.fields()) {
      control.addEventListener("input", () => viewer.change(changeOf(control)));
    }
  }

  /** @returns {NodeListOf<HTMLInputElement>} */
  fields() {
    return this.element.querySelectorAll("[data-control]");
  }

  /** @param {string} name @returns {HTMLButtonElement} */
  button(name) {
    return /** @type {HTMLButtonElement} */ (this.element.querySelector(`[data-action=${name}]`));
  }

  /** Whether a control has an effect now; keys do no more than buttons. @param {string} name */
  enabled(name) {
    const control = /** @type {HTMLButtonElement | null} */ (this.element.querySelector(`[data-control=${name}], [data-action=${name}]`));
    return Boolean(control && !control.disabled && !control.closest("[hidden]"));
  }

  show() {
    const { view } = this.viewer;
    this.showRanges();
    for (const button of /** @type {NodeListOf<HTMLElement>} */ (this.element.querySelectorAll("button[data-mode]"))) {
      button.setAttribute("aria-pressed", String(button.dataset.mode === view.mode));
    }
    for (const [name, pressed] of Object.entries({ boxes: view.boxes, best: view.best, select: this.viewer.selecting })) {
      this.button(name).setAttribute("aria-pressed", String(pressed));
    }
    for (const field of this.fields()) field.value = String(view[/** @type {keyof View} */ (field.dataset.control)] ?? "");
    const output = this.element.querySelector("output");
    if (output) output.textContent = `${view.ev > 0 ? "+" : ""}${view.ev}`.replace("-", "−");
    this.showGain();
    this.showLegend();
    this.disable();
  }

  /** The means before and after the best exposure. */
  showGain() {
    const { view, scene } = this.viewer;
    const { factor, mean, after } = bestOf(scene, view.map);
    const text = `${scene.judged.title} ${gainText(factor)}: mean ${this.viewer.measure().title} ${significant(mean)} → ${significant(after)}`;
    /** @type {HTMLElement} */ (this.element.querySelector(".gain")).textContent = view.best && view.mode !== "error" ? text : "";
  }

  /** Disable controls without an effect in this mode, for this scene, or at this zoom. */
  disable() {
    const { view, scene, viewport } = this.viewer;
    const [rendered, zoom, fit] = [view.mode !== "error", viewport.zoom(view), viewport.fit];
    const useful = {
      tone: rendered, ev: rendered, best: rendered && bestOf(scene, view.map).factor !== 1, boxes: scene.regions.length > 0,
      "zoom-out": zoom > fit, fit: zoom > fit, pixels: fit < 1 && zoom !== 1, "zoom-in": zoom < GREATEST_ZOOM,
    };
    const focused = document.activeElement;
    for (const [name, enabled] of Object.entries(useful)) {
      const control = /** @type {HTMLButtonElement} */ (this.element.querySelector(`[data-control=${name}], [data-action=${name}]`));
      control.disabled = !enabled;
      // A control that disables itself must not lose the keyboard's focus.
      if (!enabled && control === focused) /** @type {HTMLElement} */ (this.element.querySelector("button[data-mode][aria-pressed=true]")).focus();
    }
  }

  /** The colour bars of the maps shown, with the values at their ends. */
  showLegend() {
    const { view } = this.viewer;
    const seen = view.mode === "error" || view.mode === "side" ? [view.map] : [];
    if (view.tone === "false" && view.mode !== "error") seen.push("false");
    for (const legend of /** @type {NodeListOf<HTMLElement>} */ (this.element.querySelectorAll("[data-legend]"))) {
      legend.hidden = !seen.includes(legend.dataset.legend ?? "");
      const labels = legend.querySelectorAll(".labels.live span");
      labelsOf(mapOf(page, view.map), this.viewer.top()).forEach((text, place) => { if (labels[place]) labels[place].textContent = text; });
    }
    const range = /** @type {HTMLElement} */ (this.element.querySelector(".range"));
    range.hidden = !seen.includes(view.map) || !hasRange(mapOf(page, view.map));
  }

  /** The ranges of the map: the automatic one, its own, and the address's. */
  showRanges() {
    const { view } = this.viewer;
    const map = this.viewer.measure();
    const field = /** @type {HTMLSelectElement} */ (this.element.querySelector("[data-control=top]"));
    const ranges = [...new Set([...rangesOf(map), ...(view.top ? [view.top] : [])])].sort((a, b) => a - b);
    const automatic = new Option(`automatic: ${plainly(this.viewer.automatic())}`, "");
    field.replaceChildren(automatic, ...ranges.map((range) => new Option(plainly(range), String(range))));
  }
}

/** The changes that a control makes; another map has other units. @param {{value: string, dataset: DOMStringMap}} control @returns {Partial<View>} */
function changeOf({ value, dataset }) {
  if (dataset.control === "map") return { map: value, top: null, band: null };
  if (dataset.control === "top") return { top: value ? Number(value) : null, band: null };
  return { [dataset.control ?? ""]: dataset.control === "ev" ? Number(value) : value };
}

/** Whether a map's colours stand for values. @param {Legend} map */
function hasRange(map) {
  return map.kind === "error" || map.kind === "ratio";
}

/** A map's labels, from its lower end to its upper one. @param {Legend} map @param {number} top */
function labelsOf(map, top) {
  if (map.kind === "ratio") return [`≤ −${plainly(top)}`, "0", `≥ +${plainly(top)} stops`];
  return ["0", plainly(top / 2), `≥ ${plainly(top)}`];
}
