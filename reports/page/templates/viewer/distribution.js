// The panel of brushing: a metric's distribution over the selection, and the values lit up.

/** Shows numbers of the map, and has the viewer light up the values dragged over. */
class Distribution {
  /** @param {HTMLElement} panel @param {Viewer} viewer */
  constructor(panel, viewer) {
    this.panel = panel;
    this.viewer = viewer;
    this.shown = "";
    /** @type {{painter: Painter | null, name: string, top: number, all: Summary} | undefined} */
    this.kept = undefined;
    this.chart = /** @type {SVGElement} */ (panel.querySelector("svg"));
    this.listenToDrags();
    for (const field of this.fields()) field.addEventListener("change", () => this.lightTyped());
    panel.addEventListener("click", (event) => {
      const action = /** @type {HTMLElement} */ (event.target).closest("button")?.dataset.action;
      if (action === "clear") viewer.change({ box: null, band: null });
    });
  }

  /** @returns {NodeListOf<HTMLInputElement>} */
  fields() {
    return this.panel.querySelectorAll("input");
  }

  /** @param {string} name @returns {HTMLElement} */
  part(name) {
    return /** @type {HTMLElement} */ (this.panel.querySelector(`[data-part=${name}]`));
  }

  show() {
    const { painter, view, scene } = this.viewer;
    if (!painter) return;
    const [map, top, box] = [this.viewer.measure(), this.viewer.top(), this.viewer.box()];
    this.part("actions").querySelector("a")?.setAttribute("href", fragmentOf(view));
    const key = JSON.stringify([scene.id, map.name, top, box, view.band && view.band.map(String)]);
    if (this.shown === key) return;
    this.shown = key;
    const all = this.whole(map, top);
    const some = box ? summarise(painter, map, top, box, all) : all;
    this.part("title").textContent = `${map.title} in ${box ? "the selection" : "the whole image"}`;
    this.showChart(map, top, all, some);
    const lines = box ? [...linesOf(map, some), ["Cause", causeText(causesIn(painter, scene, map, box))]] : linesOf(map, some).slice(0, 2);
    this.part("numbers").replaceChildren(...lines.map(([name, text]) => numberRow(name, text)));
    this.showBand(map, box, all.size);
    this.part("hint").hidden = Boolean(box && view.band);
    this.part("actions").hidden = !box && !view.band;
  }

  /** The whole image's numbers, kept until the map changes. @param {Legend} map @param {number} top @returns {Summary} */
  whole(map, top) {
    const { painter } = this.viewer;
    if (this.kept?.painter !== painter || this.kept?.name !== map.name || this.kept?.top !== top) {
      this.kept = { painter, name: map.name, top, all: summarise(/** @type {Painter} */ (painter), map, top, null) };
    }
    return this.kept.all;
  }

  /** @param {Legend} map @param {number} top @param {Summary} all @param {Summary} some */
  showChart(map, top, all, some) {
    const tallest = Math.max(...all.bars, ...some.bars, 1e-9);
    this.part("all").setAttribute("d", outline(all.bars, tallest));
    this.part("some").setAttribute("d", outline(some.bars, tallest));
    const [low, high] = endsOf(map, top);
    const ends = (this.viewer.view.band ?? [0, 0]).map((value) => 100 * clamp((value - low) / (high - low), 0, 1));
    this.part("band").setAttribute("x", String(ends[0]));
    this.part("band").setAttribute("width", String(ends[1] - ends[0]));
    this.part("tallest").textContent = `Tallest bar: ${percentText(tallest)} of its pixels`;
    labelsOf(map, top).forEach((text, place) => { this.part("labels").children[place].textContent = text; });
    for (const bar of /** @type {NodeListOf<HTMLElement>} */ (this.panel.querySelectorAll("[data-bar]"))) bar.hidden = bar.dataset.bar !== map.kind;
  }

  /** @param {Legend} map @param {number[] | null} box @param {number} whole the sum over the image */
  showBand(map, box, whole) {
    const { band } = this.viewer.view;
    this.fields().forEach((field, place) => {
      field.value = band && Number.isFinite(band[place]) ? String(band[place]) : "";
    });
    this.part("lit").hidden = !band;
    if (!band) return;
    const { count, size } = withinBand(/** @type {Painter} */ (this.viewer.painter), map, box, band);
    this.part("lit").textContent = `Lit up: ${count.toLocaleString("en")} pixels with ${percentText(whole ? size / whole : 0)} of the departure.`;
  }

  /** Whole bars are lit up; the outer ones include all values beyond. */
  listenToDrags() {
    /** @type {number | null} */
    let start = null;
    const bar = (/** @type {PointerEvent} */ event) => {
      const { left, width } = this.chart.getBoundingClientRect();
      return clamp(Math.floor((BARS * (event.clientX - left)) / width), 0, BARS - 1);
    };
    this.chart.addEventListener("pointerdown", (event) => {
      this.chart.setPointerCapture(event.pointerId);
      start = bar(event);
      this.light(start, start, true);
    });
    this.chart.addEventListener("pointermove", (event) => {
      if (start !== null) this.light(start, bar(event), true);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      this.chart.addEventListener(end, () => {
        if (start !== null) this.viewer.change({});
        start = null;
      });
    }
  }

  /** @param {number} from @param {number} to @param {boolean} passing */
  light(from, to, passing) {
    const [low, high] = endsOf(this.viewer.measure(), this.viewer.top());
    const edge = (/** @type {number} */ bar) => Number((low + ((high - low) * bar) / BARS).toPrecision(4));
    const [first, last] = [Math.min(from, to), Math.max(from, to) + 1];
    this.viewer.change({ band: [first ? edge(first) : -Infinity, last < BARS ? edge(last) : Infinity] }, passing);
  }

  lightTyped() {
    const [from, to] = [...this.fields()].map((field) => (field.value === "" ? NaN : Number(field.value)));
    const band = [Number.isNaN(from) ? -Infinity : from, Number.isNaN(to) ? Infinity : to];
    const sensible = band[0] < band[1] && band.some(Number.isFinite);
    this.viewer.change({ band: sensible ? band : null });
  }
}

/** A bar chart as one outline, 100 by 100, from the bottom left. @param {number[]} bars @param {number} tallest */
function outline(bars, tallest) {
  const height = (/** @type {number} */ bar) => (100 - (100 * bar) / tallest).toFixed(2);
  const step = 100 / bars.length;
  return `M0 100${bars.map((bar) => `V${height(bar)}h${step}`).join("")}V100Z`;
}

/** @param {Legend} map @param {Summary} found @returns {string[][]} */
function linesOf(map, found) {
  return [
    ["Mean", differenceText(map, found.mean)],
    ["Pixels", found.part < 1 ? `${found.count.toLocaleString("en")} (${percentText(found.part)})` : found.count.toLocaleString("en")],
    ["Of the departure", percentText(found.share)],
  ];
}

/** @param {{name: string, part: number | null}[]} causes */
function causeText(causes) {
  if (!causes.length) return "unknown";
  return causes.slice(0, 3).map(({ name, part }) => (part === null ? name : `${name} ${percentText(part)}`)).join(", ");
}

/** @param {string} name @param {string} text */
function numberRow(name, text) {
  const line = document.createElement("div");
  const [term, value] = ["dt", "dd"].map((tag) => document.createElement(tag));
  term.textContent = name;
  value.textContent = text;
  line.append(term, value);
  return line;
}
