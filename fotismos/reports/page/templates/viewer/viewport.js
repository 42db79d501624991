// The places of the image's pixels on the canvas: zoom, pan, and the panes of side by side.

/**
 * Narrower canvases stack the panes of side by side (CSS pixels); four stand in two rows below
 * twice this.
 */
const STACKED_BELOW = 340;

/** Films of this shape or wider stack their panes, too. */
const WIDE = 2;

/** Most screen pixels per image pixel, and the heights of all panes and of one, relative to the
 * window's, that are left to them at least. */
const GREATEST_ZOOM = 64;
const LEAST_PART = 0.5;
const LEAST_PANE = 0.3;

/** @typedef {{left: number, top: number, width: number, height: number}} Box */

/** Geometry in CSS pixels; `width` and `height` are the image's, in its pixels. */
class Viewport {
  /** @param {number} width @param {number} height */
  constructor(width, height) {
    this.width = width;
    this.height = height;
    /** @type {Box[]} */
    this.panes = [];
    /** The zoom that fits, set by `arrange`. */
    this.fit = 1;
  }

  /**
   * Lay out panes over a canvas of a width, and return their height: together they fit into the
   * window where the page is not scrolled, if that leaves enough.
   * @param {number} count
   * @param {number} available
   * @param {number} top of the canvas on the page
   */
  arrange(count, available, top) {
    const gap = 8;
    const isStacked = available < STACKED_BELOW || this.width >= WIDE * this.height;
    const columns = isStacked ? 1 : count > 3 && available < 2 * STACKED_BELOW ? 2 : count;
    const rows = Math.ceil(count / columns);
    const width = (available - gap * (columns - 1)) / columns;
    const most = Math.max(window.innerHeight - top - gap, LEAST_PART * window.innerHeight);
    const each = Math.max((most - gap * (rows - 1)) / rows, LEAST_PANE * window.innerHeight);
    const height = Math.round(Math.min((width * this.height) / this.width, each));
    this.panes = Array.from({ length: count }, (_, place) => ({
      left: (place % columns) * (width + gap),
      top: Math.floor(place / columns) * (height + gap),
      width,
      height,
    }));
    this.fit = Math.min(width / this.width, height / this.height);
    return rows * (height + gap) - gap;
  }

  /** @param {View} view */
  zoom(view) {
    return Math.max(view.zoom ?? this.fit, this.fit); // a link never shrinks the picture
  }

  /** The point of the image at the centre of each pane. @param {View} view */
  centre(view) {
    const middle = [this.width / 2, this.height / 2];
    return view.zoom === null ? middle : [view.x ?? middle[0], view.y ?? middle[1]];
  }

  /**
   * A rectangle of the image in a pane.
   * @param {View} view
   * @param {Box} pane
   * @param {number[]} box
   */
  frame(view, pane, [x, y, width, height]) {
    const [zoom, [cx, cy]] = [this.zoom(view), this.centre(view)];
    return [
      pane.left + pane.width / 2 + (x - cx) * zoom,
      pane.top + pane.height / 2 + (y - cy) * zoom,
      width * zoom,
      height * zoom,
    ];
  }

  /** From the canvas to the image. @param {View} view @param {number[]} place */
  toImage(view, [left, top]) {
    const pane =
      this.panes.filter(one => one.left <= left && one.top <= top).at(-1) ?? this.panes[0];
    const [zoom, [cx, cy]] = [this.zoom(view), this.centre(view)];
    return [
      cx + (left - pane.left - pane.width / 2) / zoom,
      cy + (top - pane.top - pane.height / 2) / zoom,
    ];
  }

  /**
   * The pixel under a place of the canvas, or the nearest of the image.
   * @param {View} view
   * @param {number[]} place
   */
  pixelAt(view, place) {
    const [x, y] = this.toImage(view, place).map(Math.floor);
    return [clamp(x, 0, this.width - 1), clamp(y, 0, this.height - 1)];
  }

  /**
   * Zoom by a factor, keeping the image's point under a place of the canvas.
   * @param {View} view
   * @param {number} factor
   * @param {number[]} place
   */
  zoomed(view, factor, place) {
    const [[x, y], [cx, cy], before] = [
      this.toImage(view, place),
      this.centre(view),
      this.zoom(view),
    ];
    const zoom = Math.min(before * factor, GREATEST_ZOOM);
    if (zoom <= this.fit) return { zoom: null, x: null, y: null };
    return { zoom, ...this.within(x + ((cx - x) * before) / zoom, y + ((cy - y) * before) / zoom) };
  }

  /** Move by screen pixels. @param {View} view @param {number} right @param {number} down */
  panned(view, right, down) {
    const [cx, cy] = this.centre(view);
    return view.zoom === null
      ? {}
      : this.within(cx - right / this.zoom(view), cy - down / this.zoom(view));
  }

  /** The nearest centre in the image. @param {number} x @param {number} y */
  within(x, y) {
    return { x: clamp(x, 0, this.width), y: clamp(y, 0, this.height) };
  }
}
