// The overview: one order and one filter for cards and table.

/** @typedef {Listed & {place: number, elements: HTMLElement[]}} Entry */

/** @param {HTMLElement} element @param {Listed[]} scenes @param {(changes: Partial<View>) => void} change */
function makeOverview(element, scenes, change) {
  const entries = scenes.map((scene, place) => {
    /** @type {NodeListOf<HTMLElement>} */
    const elements = element.querySelectorAll(`[data-scene="${CSS.escape(scene.id)}"]`);
    return { ...scene, place, elements: [...elements] };
  });

  /** @param {View} view */
  function show(view) {
    const ordered = [...entries].sort(byKey(view.sort));
    for (const entry of ordered) {
      const hidden = !isWanted(entry, view);
      for (const item of entry.elements) {
        item.hidden = hidden;
        item.parentElement?.append(item);
      }
    }
    element.dataset.list = view.list;
    showSettings(element, view);
    const seen = entries.filter((entry) => isWanted(entry, view)).length;
    const count = /** @type {HTMLElement} */ (element.querySelector(".count"));
    count.textContent = seen === entries.length ? counted(seen) : `${seen} of ${counted(entries.length)}`;
  }

  element.addEventListener("input", (event) => {
    const field = /** @type {HTMLInputElement} */ (event.target);
    if (field.name) change({ [field.name]: field.value });
  });
  element.addEventListener("click", (event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("button");
    if (button?.dataset.list) change({ list: button.dataset.list });
    const key = button?.dataset.sort;
    if (key) change({ sort: button.closest("th")?.ariaSort === "descending" ? `-${key}` : key });
  });
  element.querySelector("form")?.addEventListener("submit", (event) => event.preventDefault());
  return { show };
}

/** @param {number} scenes */
function counted(scenes) {
  return scenes === 1 ? "1 scene" : `${scenes} scenes`;
}

/**
 * Order by a key: names and the run's order from first to last, numbers from large to small; a minus
 * reverses it. Scenes without the number come last.
 * @param {string} sort
 */
function byKey(sort) {
  const key = sort.replace(/^-/, "");
  const sign = sort.startsWith("-") ? -1 : 1;
  return (/** @type {Entry} */ a, /** @type {Entry} */ b) => {
    if (key === "name") return sign * a.name.localeCompare(b.name);
    const [first, second] = [a.keys?.[key], b.keys?.[key]];
    if (first === undefined || second === undefined) {
      return Number(first === undefined) - Number(second === undefined) || sign * (a.place - b.place);
    }
    return sign * (second - first) || a.place - b.place;
  };
}

/** @param {Entry} entry @param {View} view */
function isWanted(entry, view) {
  const named = entry.name.toLowerCase().includes(view.q.trim().toLowerCase());
  return named && (!view.only || Boolean(entry[/** @type {"failed" | "significant"} */ (view.only)]));
}

/** @param {HTMLElement} element @param {View} view */
function showSettings(element, view) {
  for (const field of element.querySelectorAll("input[name], select[name]")) {
    const input = /** @type {HTMLInputElement} */ (field);
    const value = String(view[/** @type {keyof View} */ (input.name)]);
    if (input.value !== value) input.value = value;
  }
  for (const button of element.querySelectorAll("button[data-list]")) {
    button.setAttribute("aria-pressed", String(/** @type {HTMLElement} */ (button).dataset.list === view.list));
  }
  for (const button of element.querySelectorAll("button[data-sort]")) {
    const key = /** @type {HTMLElement} */ (button).dataset.sort ?? "";
    const heading = /** @type {HTMLElement} */ (button.closest("th"));
    const falling = key !== "name";
    if (view.sort.replace(/^-/, "") !== key) heading.removeAttribute("aria-sort");
    else heading.ariaSort = view.sort.startsWith("-") === falling ? "ascending" : "descending";
  }
}
