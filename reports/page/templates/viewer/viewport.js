// The places of the image's pixels on the canvas: zoom, pan, and the panes of side by side.

/** Narrower canvases stack the panes of side by side (CSS pixels). */
const STACKED_BELOW = 620;

/** Most screen pixels per image pixel. */
const GREATEST_ZOOM = 64;

/** The least height of a view, and the greatest relative to the window's. */
const LEAST_HEIGHT = 180, GREATEST_PART = 0.74;

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
   * Lay out panes over a canvas of a width, and return their height.
   * @param {number} count
   * @param {number} available
   */
  arrange(count, available) {
    const gap = 4;
    const stacked = count > 1 && available < STACKED_BELOW;
    const width = stacked ? available : (available - gap * (count - 1)) / count;
    const natural = (width * this.height) / this.width;
    const height = Math.round(clamp(natural, Math.min(LEAST_HEIGHT, available), GREATEST_PART * window.innerHeight));
    this.panes = Array.from({ length: count }, (_, place) => ({
      left: stacked ? 0 : place * (width + gap),
      top: stacked ? place * (height + gap) : 0,
      width,
      height,
    }));
    this.fit = Math.min(width / this.width, height / this.height);
    return stacked ? count * height + (count - 1) * gap : height;
  }

  /** @param {View} view */
  zoom(view) {
    return Math.max(view.zoom ?? this.fit, this.fit); // a link never shrinks the picture
  }

  /** The point of the image at the centre of each pane. @param {View} view */
  centre(view) {
    if (view.zoom === null) return [this.width / 2, this.height / 2];
    return [view.x ?? this.width / 2, view.y ?? this.height / 2];
  }

  /** From the image to a pane. @param {View} view @param {Box} pane @param {number} x @param {number} y */
  toScreen(view, pane, x, y) {
    const [cx, cy] = this.centre(view);
    const zoom = this.zoom(view);
    return [pane.left + pane.width / 2 + (x - cx) * zoom, pane.top + pane.height / 2 + (y - cy) * zoom];
  }

  /** Whether a point of the first pane is seen in it. @param {number[]} place */
  sees([left, top]) {
    const pane = this.panes[0];
    return left >= 0 && top >= 0 && left <= pane.width && top <= pane.height;
  }

  /** The visible part of the image: left, top, width and height in whole pixels. @param {View} view */
  seen(view) {
    const centre = this.centre(view);
    const zoom = this.zoom(view);
    const halves = [this.panes[0].width / 2 / zoom, this.panes[0].height / 2 / zoom];
    const [x, y] = centre.map((at, axis) => Math.max(Math.floor(at - halves[axis]), 0));
    const [right, bottom] = centre.map((at, axis) => Math.ceil(at + halves[axis]));
    return [x, y, Math.min(right, this.width) - x, Math.min(bottom, this.height) - y];
  }

  /** From the canvas to the image. @param {View} view @param {number} left @param {number} top */
  toImage(view, left, top) {
    const pane = this.paneAt(left, top);
    const [cx, cy] = this.centre(view);
    const zoom = this.zoom(view);
    return [cx + (left - pane.left - pane.width / 2) / zoom, cy + (top - pane.top - pane.height / 2) / zoom];
  }

  /** The pane at a place of the canvas, or the nearest before it. @param {number} left @param {number} top */
  paneAt(left, top) {
    const reached = this.panes.filter((pane) => pane.left <= left && pane.top <= top);
    return reached.at(-1) ?? this.panes[0];
  }

  /** The pixel under a place of the canvas, or null. @param {View} view @param {number} left @param {number} top */
  pixelAt(view, left, top) {
    const [x, y] = this.toImage(view, left, top).map(Math.floor);
    return x >= 0 && y >= 0 && x < this.width && y < this.height ? [x, y] : null;
  }

  /** The pixel under a place of the canvas, or the nearest of the image. @param {View} view @param {number} left @param {number} top */
  nearestPixel(view, left, top) {
    const [x, y] = this.toImage(view, left, top).map(Math.floor);
    return [clamp(x, 0, this.width - 1), clamp(y, 0, this.height - 1)];
  }

  /**
   * Zoom by a factor, keeping the image's point under a place of the canvas in place.
   * @param {View} view
   * @param {number} factor
   * @param {number[]} place
   */
  zoomed(view, factor, [left, top]) {
    const [x, y] = this.toImage(view, left, top);
    const [cx, cy] = this.centre(view);
    const before = this.zoom(view);
    const zoom = clamp(before * factor, this.fit, Math.max(GREATEST_ZOOM, this.fit));
    if (zoom <= this.fit) return { zoom: null, x: null, y: null };
    const kept = before / zoom;
    return { zoom, ...this.within(x + (cx - x) * kept, y + (cy - y) * kept) };
  }

  /** Move by screen pixels. @param {View} view @param {number} right @param {number} down */
  panned(view, right, down) {
    const [cx, cy] = this.centre(view);
    const zoom = this.zoom(view);
    return view.zoom === null ? {} : this.within(cx - right / zoom, cy - down / zoom);
  }

  /** The nearest centre in the image. @param {number} x @param {number} y */
  within(x, y) {
    return { x: clamp(x, 0, this.width), y: clamp(y, 0, this.height) };
  }
}
