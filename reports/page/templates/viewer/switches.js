// The switches of effects: small pictures of the textbook with some effects, and of the error left.

/** In the maps: steps of ΔE2000, and the code of a pixel that does not count (scene_view.py). */
const STEP = 0.1, UNCOUNTED = 255;

class Switches {
  /** @param {Scene} scene @param {Board} board @param {CanvasImageSource} pictures @param {CanvasImageSource} maps */
  constructor(scene, board, pictures, maps) {
    this.board = board;
    this.names = scene.effects?.names ?? [];
    this.pictures = pictures;
    this.maps = maps;
    this.places = new Map(board.hybrids.map((hybrid, place) => [hybrid.on.join(), place]));
    this.buttons = this.names.map((name, place) => {
      const button = Object.assign(document.createElement("button"), { type: "button" });
      button.dataset.effect = String(place);
      button.append(keyOf(name, scene.effects?.colours[place] ?? ""));
      return button;
    });
  }

  /** Those of a scene, once their pictures are there. @param {Scene} scene @param {Board} board @param {HTMLElement} section */
  static async of(scene, board, section) {
    const sheets = /** @type {NodeListOf<HTMLImageElement>} */ (section.querySelectorAll("img[data-sheet]"));
    await Promise.all([...sheets].map((sheet) => sheet.decode()));
    return new Switches(scene, board, sheets[0], sheets[1]);
  }

  /** The effects that are on after switching one of them; unchanged if that was not rendered. @param {number[] | null} on @param {number} effect */
  after(on, effect) {
    const before = on ?? [];
    const next = before.includes(effect) ? before.filter((one) => one !== effect) : [...before, effect].sort((a, b) => a - b);
    return !this.places.has(next.join()) ? on : next.length ? next : null;
  }

  /** @param {number[] | null} on */
  show(on) {
    this.buttons.forEach((button, effect) => {
      const cannot = this.after(on, effect) === on;
      button.setAttribute("aria-pressed", String(Boolean(on?.includes(effect))));
      button.setAttribute("aria-disabled", String(cannot));
      button.title = cannot ? "This combination was not rendered; switch another effect first." : "";
    });
  }

  /** The hybrid with some effects, if it was rendered. @param {number[]} on */
  find(on) {
    const place = this.places.get(on.join());
    if (place === undefined) return undefined;
    const values = () => this.valuesAt(place);
    return {
      name: on.map((effect) => this.names[effect]).join(" + "),
      mean: this.board.hybrids[place].mean,
      picture: this.tile(this.pictures, place),
      map: (/** @type {number} */ t, /** @type {number} */ top) => {
        const colour = differenceColours(t, top);
        return painted(this.board.width, this.board.height, (pixels) => values().forEach((value, at) => { pixels[at] = colour(Number.isNaN(value) ? 0 : value); }));
      },
      share: (/** @type {number} */ t) => {
        const counted = values().filter((value) => !Number.isNaN(value));
        return counted.filter((value) => value > t).length / Math.max(counted.length, 1);
      },
    };
  }

  /** @param {CanvasImageSource} sheet @param {number} place */
  tile(sheet, place) {
    const { width, height, columns } = this.board;
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    canvas.getContext("2d", { willReadFrequently: true })?.drawImage(sheet, -(place % columns) * width, -Math.floor(place / columns) * height);
    return canvas;
  }

  /** The error left at each pixel; NaN where none counts. @param {number} place */
  valuesAt(place) {
    const { width, height } = this.board;
    const data = this.tile(this.maps, place).getContext("2d")?.getImageData(0, 0, width, height).data ?? [];
    return Array.from({ length: width * height }, (_, at) => (data[4 * at] === UNCOUNTED ? NaN : STEP * data[4 * at]));
  }
}
