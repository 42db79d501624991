// The viewer's canvas: pictures through the viewport, their titles, outlines and the divide.

/** Colours of overlays, legible on any picture. */
const OVERLAY = {
  line: "#fff",
  edge: "#000a",
  worst: "#5ef0ff",
  selection: "#ffd84a",
  label: "#000b",
};

/** Pixels of a line of a label, and about its letters on both sides. */
const LINE = 17;
const MARGIN = 5;

/** @typedef {{picture: HTMLCanvasElement, title: string}} Content of a pane */

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
    const top = this.canvas.getBoundingClientRect().top + window.scrollY;
    const height = viewport.arrange(isDivided ? 1 : contents.length, width, top);
    const density = window.devicePixelRatio || 1;
    Object.assign(this.canvas, {
      width: Math.round(width * density),
      height: Math.round(height * density),
    });
    this.canvas.style.height = `${height}px`;
    this.context.setTransform(density, 0, 0, density, 0, 0);
    viewport.panes.forEach((pane, place) => {
      const content = isDivided ? contents[1] : contents[place];
      this.context.fillStyle = "#000";
      this.context.fillRect(pane.left, pane.top, pane.width, pane.height);
      this.clipped(pane, () => this.image(view, viewport, pane, content, density));
      if (isDivided)
        this.clipped({ ...pane, width: pane.width * view.split }, () =>
          this.image(view, viewport, pane, contents[0], density),
        );
      this.clipped(pane, () =>
        outlines.forEach(([box, colour]) => this.outline(viewport.frame(view, pane, box), colour)),
      );
      this.label(isDivided ? contents[0].title : content.title, pane, isDivided);
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
  image(view, viewport, pane, { picture }, density) {
    const [left, top, width, height] = viewport.frame(view, pane, [
      0,
      0,
      viewport.width,
      viewport.height,
    ]);
    this.context.imageSmoothingEnabled = width * density < picture.width;
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
    this.label(title, pane, true, 1);
  }

  /**
   * Words in a lower corner of a pane, in as many lines as they need: left, or (1) right.
   * @param {string} text
   * @param {Box} pane
   * @param {boolean} isHalf whether the other corner has words, too
   */
  label(text, pane, isHalf, align = 0) {
    const { context } = this;
    context.font = "12px system-ui, sans-serif";
    const widthOf = (/** @type {string} */ words) => context.measureText(words).width + 2 * MARGIN;
    const room = (pane.width - 3 * MARGIN) / (isHalf ? 2 : 1);
    const lines = [""];
    for (const word of text.split(" ")) {
      const longer = `${lines.at(-1)} ${word}`.trim();
      if (widthOf(longer) > room && lines.at(-1)) lines.push(word);
      else lines.splice(-1, 1, longer);
    }
    const width = Math.max(...lines.map(widthOf));
    const left = pane.left + MARGIN + align * (pane.width - 2 * MARGIN - width);
    const top = pane.top + pane.height - MARGIN - LINE * lines.length;
    context.fillStyle = OVERLAY.label;
    context.fillRect(left, top, width, LINE * lines.length);
    Object.assign(context, { fillStyle: OVERLAY.line, textBaseline: "middle" });
    lines.forEach((line, place) =>
      context.fillText(line, left + MARGIN, top + (place + 0.5) * LINE),
    );
  }
}
