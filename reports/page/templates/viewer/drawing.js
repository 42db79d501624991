// The viewer's canvas: pictures through the viewport, their titles, outlines and the divide.

/** Colours of overlays, legible on any picture. */
const OVERLAY = {
  line: "#fff",
  edge: "#000a",
  worst: "#5ef0ff",
  selection: "#ffd84a",
  label: "#000b",
};

/** @typedef {{picture: HTMLCanvasElement, title: string, smooth?: boolean}} Content of a pane */

/** Draws a view of a scene, without handling events. */
class Drawing {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  }

  /**
   * Draw one content into each pane, or two into one, divided; `outlines` are rectangles of the
   * image
   * with their colours.
   * @param {View} view
   * @param {Viewport} viewport
   * @param {Content[]} contents
   * @param {[number[], string][]} outlines
   */
  draw(view, viewport, contents, outlines) {
    const isDivided = view.mode === "split";
    const width = this.canvas.clientWidth;
    const height = viewport.arrange(isDivided ? 1 : contents.length, width);
    const density = window.devicePixelRatio || 1;
    Object.assign(this.canvas, {
      width: Math.round(width * density),
      height: Math.round(height * density),
    });
    this.canvas.style.height = `${height}px`;
    this.context.setTransform(density, 0, 0, density, 0, 0);
    viewport.panes.forEach((pane, place) => {
      const content = isDivided ? contents[1] : contents[place];
      this.clipped(pane, () => this.image(view, viewport, pane, content, density));
      if (isDivided)
        this.clipped({ ...pane, width: pane.width * view.split }, () =>
          this.image(view, viewport, pane, contents[0], density),
        );
      this.clipped(pane, () =>
        outlines.forEach(([box, colour]) => this.outline(viewport.frame(view, pane, box), colour)),
      );
      this.label(
        isDivided ? contents[0].title : content.title,
        pane.left + 6,
        pane.top + pane.height - 23,
      );
      if (isDivided) this.divide(pane, pane.width * view.split, content.title);
    });
  }

  /** @param {Box} box @param {() => void} paint */
  clipped(box, paint) {
    this.context.save();
    this.context.beginPath();
    this.context.rect(box.left, box.top, box.width, box.height);
    this.context.clip();
    paint();
    this.context.restore();
  }

  /**
   * @param {View} view
   * @param {Viewport} viewport
   * @param {Box} pane
   * @param {Content} content
   * @param {number} density
   */
  image(view, viewport, pane, { picture, smooth }, density) {
    const [left, top, width, height] = viewport.frame(view, pane, [
      0,
      0,
      viewport.width,
      viewport.height,
    ]);
    this.context.imageSmoothingEnabled = smooth || width * density < picture.width;
    this.context.imageSmoothingQuality = "high";
    this.context.drawImage(picture, left, top, width, height);
  }

  /** A frame, at least 8 pixels wide. @param {number[]} frame @param {string} colour */
  outline([left, top, width, height], colour) {
    const margin = Math.max(0, 4 - Math.min(width, height) / 2);
    for (const [stroke, thickness] of /** @type {[string, number][]} */ ([
      [OVERLAY.edge, 3],
      [colour, 1.25],
    ])) {
      Object.assign(this.context, { strokeStyle: stroke, lineWidth: thickness });
      this.context.strokeRect(left - margin, top - margin, width + 2 * margin, height + 2 * margin);
    }
  }

  /** @param {Box} pane @param {number} at @param {string} title of the right part */
  divide(pane, at, title) {
    const { context } = this;
    for (const [colour, half] of /** @type {[string, number][]} */ ([
      [OVERLAY.edge, 2],
      [OVERLAY.line, 1],
    ])) {
      context.fillStyle = colour;
      context.fillRect(pane.left + at - half, pane.top, 2 * half, pane.height);
    }
    context.beginPath();
    context.arc(pane.left + at, pane.top + pane.height / 2, 7, 0, 2 * Math.PI);
    context.fill();
    this.label(title, pane.left + pane.width - 6, pane.top + pane.height - 23, 1);
  }

  /**
   * Text at a place, which is left of it or (1) right.
   * @param {string} text
   * @param {number} left
   * @param {number} top
   */
  label(text, left, top, align = 0) {
    const { context } = this;
    context.font = "12px system-ui, sans-serif";
    const width = context.measureText(text).width + 10;
    context.fillStyle = OVERLAY.label;
    context.fillRect(left - align * width, top, width, 17);
    Object.assign(context, { fillStyle: OVERLAY.line, textBaseline: "middle" });
    context.fillText(text, left - align * width + 5, top + 9);
  }
}
