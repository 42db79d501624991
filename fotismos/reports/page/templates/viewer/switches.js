// The switches of effects: the textbook with some of them, and the error that is left, at a small
// size.

/** @typedef {{name: string, mean: string, painter: Painter}} Added */

class Switches {
  /** @param {Painter} painter of the scene @param {Board} board @param {Images} images */
  constructor(painter, board, images) {
    const { effects } = painter.scene;
    this.painter = painter;
    this.board = board;
    this.images = images;
    this.names = effects?.names ?? [];
    this.places = new Map(board.hybrids.map((hybrid, place) => [hybrid.on.join(), place]));
    /** @type {Map<number, Painter>} */
    this.painters = new Map();
    this.buttons = this.names.map((name, place) => {
      const button = Object.assign(document.createElement("button"), { type: "button" });
      button.dataset.effect = String(place);
      button.append(keyOf(name, effects?.colours[place] ?? ""));
      return button;
    });
  }

  /**
   * The effects that are on after switching one of them; unchanged if that was not rendered.
   * @param {number[] | null} on
   * @param {number} effect
   */
  after(on, effect) {
    const before = on ?? [];
    const next = before.includes(effect)
      ? before.filter(one => one !== effect)
      : [...before, effect].sort((a, b) => a - b);
    return !this.places.has(next.join()) ? on : next.length ? next : null;
  }

  /** @param {number[] | null} on */
  show(on) {
    this.buttons.forEach((button, effect) => {
      const cannot = this.after(on, effect) === on;
      button.setAttribute("aria-pressed", String(Boolean(on?.includes(effect))));
      button.setAttribute("aria-disabled", String(cannot));
      button.title = cannot
        ? "This combination was not rendered; switch another effect first."
        : "";
    });
  }

  /**
   * The textbook with some effects, if it was rendered.
   * @param {number[]} on
   * @returns {Added | null}
   */
  find(on) {
    const place = this.places.get(on.join());
    if (place === undefined) return null;
    const painter = this.painters.get(place) ?? this.painterOf(place);
    this.painters.set(place, painter);
    return {
      name: on.map(effect => this.names[effect]).join(" + "),
      mean: this.board.hybrids[place].mean,
      painter,
    };
  }

  /** A hybrid beside the last one, which has all effects. @param {number} place */
  painterOf(place) {
    const { codes } = this.images;
    const last = this.board.hybrids.length - 1;
    const halves = ["R", "G", "B"].flatMap(channel => [
      [`heuristic.${channel}`, codes[`${place}.${channel}`]],
      [`reference.${channel}`, codes[`${last}.${channel}`]],
    ]);
    const own = {
      ...Object.fromEntries(halves),
      dE2000: codes[`${place}.dE2000`],
      flags: codes.flags,
    };
    return new Painter(this.painter.scene, { ...this.images, codes: own }, this.painter);
  }
}
