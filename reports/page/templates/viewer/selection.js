// Statistics of a metric over a part of the image, for brushing.

/** Ends of a map's colours relative to the metric's; the automatic one holds this part of the pixels. */
const RANGES = [0.05, 0.1, 0.25, 0.5, 1, 2, 5], HELD = 0.95;

/** Bars of the histogram, from one end of the colours to the other. */
const BARS = 40;

/** @typedef {{count: number, size: number, mean: number, part: number, share: number, bars: number[]}} Summary */

/** The possible ends of a map's colours. @param {{top: number}} map */
function rangesOf(map) {
  return RANGES.map((factor) => Number((factor * map.top).toPrecision(3)));
}

/** The least range that holds 95 % of the counted pixels, found once for each map. @param {Painter} painter @param {Legend} map */
function automaticRange(painter, map) {
  const known = painter.ranges.get(map.name);
  if (known) return known;
  const sizes = painter.values(map.name).map(Math.abs).filter((_, place) => painter.counts(place)).sort();
  const held = sizes[Math.floor(HELD * (sizes.length - 1))] ?? 0;
  const ranges = rangesOf(map);
  const range = ranges.find((one) => one >= held) ?? ranges[ranges.length - 1];
  painter.ranges.set(map.name, range);
  return range;
}

/** The values at the ends of a map's colours. @param {Legend} map @param {number} top */
function endsOf(map, top) {
  return [map.kind === "ratio" ? -top : 0, top];
}

/**
 * Statistics of a rectangle or the whole image: counted pixels, their mean, their parts of the image's
 * pixels and of its departure (the sum of the metric's size), and the part of them in each bar; the
 * outer bars include values beyond.
 * @param {Painter} painter
 * @param {Legend} map
 * @param {number} top
 * @param {number[] | null} box
 * @param {{count: number, size: number}} [all] the whole image's, for a rectangle
 * @returns {Summary}
 */
function summarise(painter, map, top, box, all) {
  const values = painter.values(map.name);
  const [low, high] = endsOf(map, top);
  const bars = new Array(BARS).fill(0);
  let count = 0, total = 0, size = 0;
  eachPlace(painter, box, (place) => {
    const value = values[place];
    count += 1;
    total += value;
    size += Math.abs(value);
    bars[clamp(Math.floor((BARS * (value - low)) / (high - low)), 0, BARS - 1)] += 1;
  });
  const whole = all ?? { count, size };
  return {
    count, size, mean: count ? total / count : 0, part: whole.count ? count / whole.count : 0,
    share: whole.size ? size / whole.size : 0, bars: bars.map((bar) => (count ? bar / count : 0)),
  };
}

/** Call with each counted place of a rectangle of the image. @param {Painter} painter @param {number[] | null} box @param {(place: number) => void} visit */
function eachPlace(painter, box, visit) {
  const { width, height, block } = painter.images;
  const [x, y, w, h] = box ?? [0, 0, width * block, height * block];
  for (let row = Math.floor(y / block); row < Math.min(Math.ceil((y + h) / block), height); row++) {
    for (let column = Math.floor(x / block); column < Math.min(Math.ceil((x + w) / block), width); column++) {
      const place = row * width + column;
      if (painter.counts(place)) visit(place);
    }
  }
}

/** The rectangle between two corner pixels. @param {number[]} from @param {number[]} to */
function boxBetween(from, to) {
  const start = from.map((value, axis) => Math.min(value, to[axis]));
  return [...start, ...from.map((value, axis) => Math.abs(value - to[axis]) + 1)];
}

/** Counted pixels of a rectangle within a band of values, and the sum of their sizes. @param {Painter} painter @param {Legend} map @param {number[] | null} box @param {number[]} band */
function withinBand(painter, map, box, [low, high]) {
  const values = painter.values(map.name);
  let count = 0, size = 0;
  eachPlace(painter, box, (place) => {
    if (values[place] < low || values[place] >= high) return;
    count += 1;
    size += Math.abs(values[place]);
  });
  return { count, size };
}

/**
 * Effects in a rectangle: the part of its departure where each of them dominates, largest first.
 * Without a map of effects, those of the regions that it overlaps, without parts.
 * @param {Painter} painter
 * @param {Scene} scene
 * @param {Legend} map
 * @param {number[]} box
 * @returns {{name: string, part: number | null}[]}
 */
function causesIn(painter, scene, map, box) {
  if (!scene.effects) {
    const names = scene.regions.filter((region) => overlap(region, box)).flatMap((region) => region.effect ?? []);
    return [...new Set(names)].map((name) => ({ name, part: null }));
  }
  const { width, height } = painter.images;
  const values = painter.values(map.name);
  /** @type {Map<string, number>} */
  const sums = new Map();
  let whole = 0;
  eachPlace(painter, box, (place) => {
    const letter = letterAt(scene.effects, ((place % width) + 0.5) / width, (Math.floor(place / width) + 0.5) / height);
    const size = Math.abs(values[place]);
    whole += size;
    sums.set(letter, (sums.get(letter) ?? 0) + size);
  });
  return [...sums].map(([letter, sum]) => ({ name: effectName(scene.effects, letter), part: whole ? sum / whole : 0 }))
    .filter(({ name, part }) => name && part >= 0.005)
    .sort((a, b) => b.part - a.part);
}

/** @param {Region} region @param {number[]} box */
function overlap(region, [x, y, w, h]) {
  return region.x < x + w && x < region.x + region.width && region.y < y + h && y < region.y + region.height;
}
