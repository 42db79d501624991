// Beside the picture: the numbers of a pixel, and how the error is distributed over the image or a
// selection.

/** Bars of the histogram, from 0 to the end of the map's colours. */
const BARS = 40;

/** In place of what a picture with effects does not tell. */
const UNKNOWN = "–";

class Panels {
  /** @param {Viewer} viewer */
  constructor(viewer) {
    this.viewer = viewer;
    this.inspector = byId("inspector");
    this.distribution = byId("distribution");
    this.elements = [this.inspector, this.distribution];
    this.key = "";
    this.part("clear").addEventListener("click", () => viewer.change({ box: null }));
    this.listenToDrags(/** @type {SVGElement} */ (this.distribution.querySelector("svg")));
  }

  /** @param {string} name @returns {HTMLElement} */
  part(name) {
    return /** @type {HTMLElement} */ (this.distribution.querySelector(`[data-part=${name}]`));
  }

  show() {
    this.inspect();
    const { shown: painter, added, view, scene } = this.viewer;
    const hasCauses = Boolean(scene.effects) || scene.regions.some(region => region.effect);
    for (const row of this.elements.flatMap(part => elementsIn("tr.cause", part)))
      row.hidden = !hasCauses && scene.arePictures;
    const box = this.viewer.box();
    const key = JSON.stringify([scene.id, view.t, box, view.on]);
    if (!painter || this.key === key) return;
    this.key = key;
    const all = summarise(painter, null, view.t);
    const some = box ? summarise(painter, box, view.t) : all;
    this.part("title").textContent =
      `ΔE2000 ${added ? "left " : ""}in ${box ? "the selection" : "the whole image"}, with noise`;
    const tallest = Math.max(...all.bars, ...some.bars, 1e-9);
    this.part("some").setAttribute("d", outlineOf(some.bars, tallest));
    this.part("all").setAttribute("d", outlineOf(all.bars, tallest));
    this.part("line").setAttribute("x", String((100 * view.t) / TOP));
    this.part("end").textContent = `≥ ${TOP}`;
    const texts = {
      mean: box || added ? differenceText(some.mean) : scene.mean,
      visible: percentText(box || added ? some.visible : scene.shares[placeOf(view.t)]),
      certain: added ? UNKNOWN : percentText(some.marked),
      both: added ? UNKNOWN : percentText(some.both),
      pixels: percentText(some.count / all.count),
      error: percentText(all.sum ? some.sum / all.sum : 0),
      cause: added ? UNKNOWN : causesIn(painter, box),
    };
    for (const [name, text] of Object.entries(texts)) this.part(name).textContent = text;
    for (const name of ["pixels", "error"])
      /** @type {HTMLElement} */ (this.part(name).parentElement).hidden = !box;
    this.part("clear").hidden = !box;
  }

  /** The histogram is dragged to a threshold. @param {SVGElement} chart */
  listenToDrags(chart) {
    const drag = (/** @type {PointerEvent} */ event, passing = true) => {
      const { left, width } = chart.getBoundingClientRect();
      const value = ((event.clientX - left) / width) * TOP;
      const t = page.thresholds.reduce((best, one) =>
        Math.abs(one - value) < Math.abs(best - value) ? one : best,
      );
      this.viewer.change({ t }, passing);
    };
    chart.addEventListener("pointerdown", event => {
      chart.setPointerCapture(event.pointerId);
      drag(event);
    });
    chart.addEventListener("pointermove", event => event.buttons && drag(event));
    chart.addEventListener("pointerup", event => drag(event, false));
  }

  /** Write the numbers of the pixel into the page. */
  inspect() {
    const { shown: painter, added, scene, view } = this.viewer;
    if (!painter) return;
    const pixel = this.viewer.pixel();
    const place = painter.placeOf(pixel);
    const { codes, block, width, height } = painter.images;
    const flags = codes.flags[place];
    const [textbook, physical] = ["heuristic", "reference"].map(half =>
      painter.colour(half, place),
    );
    const seen = (/** @type {number[]} */ rgb) =>
      `#${rgb
        .map(value =>
          srgb(value * scene.exposure * 2 ** view.ev)
            .toString(16)
            .padStart(2, "0"),
        )
        .join("")}`;
    const marked = flags & SIGNIFICANT ? "yes" : flags & UNDETERMINED ? "undetermined" : "no";
    const short = (/** @type {number} */ value) =>
      significant(value, Math.abs(value) < 1e-2 ? 2 : 3);
    const isVisible = painter.differences[place] > view.t;
    const isWorst = String(pixel) === String(scene.worst.pixel) && block === 1 && !added;
    const size = added
      ? ` + ${added.name}, at ${width} × ${height}`
      : block > 1
        ? `: mean of ${block} × ${block}`
        : "";
    /** @type {Record<string, string | string[]>} */
    const texts = {
      position: `${isWorst ? "Worst pixel:" : "Pixel"} ${pixel.join(", ")}${size}`,
      cause: added ? UNKNOWN : causeAt(painter, pixel, isVisible) || "unknown",
      heuristic: textbook.map(short),
      reference: physical.map(short),
      heuristic_hex: seen(textbook),
      reference_hex: seen(physical),
      dE2000: isWorst ? scene.worst.error : differenceText(painter.differences[place]),
      log2_luminance: ratioText(painter, place),
      standard_error: added
        ? UNKNOWN
        : scene.isNoiseKnown
          ? significant(VALUES[codes.standard_error[place]], 2)
          : "not known",
      significant: !(flags & COUNTED) ? "not counted" : added ? UNKNOWN : marked,
    };
    for (const cell of elementsIn("[data-value]", this.inspector)) {
      const [name, index] = cell.dataset.value?.split(".") ?? [];
      cell.textContent = index ? texts[name][Number(index)] : String(texts[name]);
      if (name.endsWith("_hex")) cell.style.borderColor = String(texts[name]);
    }
  }
}

/**
 * The ratio of the luminances at a place, unless one of them is 0: then it is how that half is
 * called.
 * @param {Painter} painter
 * @param {number} place
 */
function ratioText(painter, place) {
  const [isTestDark, isReferenceDark] = painter.luminances(place).map(value => value === 0);
  if (isTestDark && isReferenceDark) return "both are black";
  if (isTestDark) return `${painter.scene.judged.name} is black`;
  if (isReferenceDark) return `${painter.scene.truth.name} is black`;
  return `${significant(painter.ratio(place), 2)} stops`;
}

/**
 * What is missing at a pixel: the effect that dominates there, or in its region; "none" if nothing
 * is, empty if unknown, as where noise alone is visible.
 * @param {Painter} painter
 * @param {number[]} pixel
 * @param {boolean} isVisible whether the error is
 */
function causeAt({ scene }, [x, y], isVisible) {
  if (scene.effects) {
    const letter = letterAt(scene.effects, (x + 0.5) / scene.width, (y + 0.5) / scene.height);
    if (letter === NO_EFFECT) return isVisible ? "" : "none";
    return effectName(scene.effects, letter);
  }
  return (
    scene.regions.find(
      one => x >= one.x && y >= one.y && x < one.x + one.width && y < one.y + one.height,
    )?.effect ?? ""
  );
}

/**
 * Statistics of a rectangle, or of the whole image.
 * @param {Painter} painter
 * @param {number[] | null} box
 * @param {number} t
 */
function summarise(painter, box, t) {
  const bars = new Array(BARS).fill(0);
  let count = 0;
  let sum = 0;
  let visible = 0;
  let marked = 0;
  let both = 0;
  eachPlace(painter, box, place => {
    const value = painter.differences[place];
    const isMarked = painter.images.codes.flags[place] & SIGNIFICANT;
    count += 1;
    sum += value;
    visible += Number(value > t);
    marked += Number(isMarked > 0);
    both += Number(isMarked && value > t);
    bars[clamp(Math.floor((BARS * value) / TOP), 0, BARS - 1)] += 1;
  });
  const share = (/** @type {number} */ part) => (count ? part / count : 0);
  return {
    count,
    sum,
    mean: share(sum),
    visible: share(visible),
    marked: share(marked),
    both: share(both),
    bars: bars.map(share),
  };
}

/**
 * Call with each counted place of a rectangle of the image.
 * @param {Painter} painter
 * @param {number[] | null} box
 * @param {(place: number) => void} visit
 */
function eachPlace(painter, box, visit) {
  const {
    scene,
    step: [right, down],
    images: { width, height },
  } = painter;
  const [x, y, w, h] = box ?? [0, 0, scene.width, scene.height];
  for (let row = Math.floor(y / down); row < Math.min(Math.ceil((y + h) / down), height); row++) {
    for (
      let column = Math.floor(x / right);
      column < Math.min(Math.ceil((x + w) / right), width);
      column++
    ) {
      if (painter.counts(row * width + column)) visit(row * width + column);
    }
  }
}

/**
 * What is missing: in the whole picture what the effects remove, as in its headline; in a rectangle
 * the parts of its error where each effect dominates.
 * @param {Painter} painter
 * @param {number[] | null} box
 */
function causesIn(painter, box) {
  const { scene } = painter;
  if (!scene.effects) {
    const [x, y, w, h] = box ?? [0, 0, Infinity, Infinity];
    const near = scene.regions.filter(
      one => one.x < x + w && x < one.x + one.width && one.y < y + h && y < one.y + one.height,
    );
    return [...new Set(near.flatMap(one => one.effect ?? []))].join(", ") || "unknown";
  }
  if (!box) {
    const { names, parts: removed } = scene.effects;
    return inWords(names.map((name, place) => ({ name, part: removed[place] ?? 0 })));
  }
  /** @type {Map<string, number>} */
  const sums = new Map();
  let whole = 0;
  eachPlace(painter, box, place => {
    const letter = painter.letter(place);
    const size = painter.differences[place];
    whole += size;
    sums.set(letter, (sums.get(letter) ?? 0) + size);
  });
  const parts = [...sums].map(([letter, sum]) => ({
    name: effectName(scene.effects, letter),
    part: whole ? sum / whole : 0,
  }));
  return inWords(parts);
}

/**
 * The largest parts of an error, in words.
 * @param {{name: string, part: number}[]} parts
 */
function inWords(parts) {
  const seen = parts
    .filter(({ name, part }) => name && part >= 0.005)
    .sort((a, b) => b.part - a.part);
  return (
    seen
      .slice(0, 3)
      .map(({ name, part }) => `${name} ${percentText(part)}`)
      .join(", ") || "unknown"
  );
}

/**
 * A bar chart as one outline, 100 by 100, from the bottom left.
 * @param {number[]} bars
 * @param {number} tallest
 */
function outlineOf(bars, tallest) {
  const step = 100 / bars.length;
  const steps = bars.map(bar => `V${(100 - (100 * bar) / tallest).toFixed(2)}h${step}`);
  return `M0 100${steps.join("")}V100Z`;
}
