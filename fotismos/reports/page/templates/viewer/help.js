// Help on technical terms at hover and focus: the sentences are those of the page's glossary.

/** What may name a term. */
const NAMING = "th, dt, label, summary, select, figcaption b, .key, button, h3";

/** What the keyboard reaches anyway, or what holds such a thing. */
const REACHED = "a[href], button, select, input, summary, [tabindex]";

/** Words alone, so that a term is found in any setting. @param {string} text */
function wordsOf(text) {
  return text
    .toLowerCase()
    .replace(/[^\p{L}\p{N}%*]+/gu, " ")
    .trim();
}

/** @type {Map<string, string>} */
const meanings = new Map(
  Object.entries(page.terms ?? {}).map(([name, meaning]) => [wordsOf(name), String(meaning)]),
);

/**
 * Give each term of an element its help; the keyboard reaches the first of each.
 * @param {Element} section
 */
function explainTerms(section) {
  const known = new Set();
  for (const element of elementsIn(NAMING, section)) {
    if (element.closest("[data-plain]")) continue; // the glossary itself, and other meanings
    const texts = [
      element.getAttribute("aria-label"),
      element.innerHTML.replace(/<[^>]*>/g, " "),
      element.firstChild?.textContent,
    ];
    const name = texts.map(text => wordsOf(text ?? "")).find(text => meanings.has(text));
    if (name === undefined) continue;
    element.dataset.term = name;
    if (!known.has(name) && !element.matches(REACHED) && !element.querySelector(REACHED))
      element.tabIndex = 0;
    known.add(name);
  }
}

/** @param {HTMLElement} tip the element that shows the help */
function listenForHelp(tip) {
  /** @type {HTMLElement | null} */
  let shown = null;

  function hide() {
    shown?.removeAttribute("aria-describedby");
    shown = null;
    tip.hidden = true;
  }

  /** @param {Event} event */
  function show(event) {
    const term = /** @type {HTMLElement | null} */ (
      event.target instanceof Element && event.target.closest("[data-term]")
    );
    if (term === shown || event.target === tip) return;
    hide();
    if (!term) return;
    shown = term;
    tip.textContent = meanings.get(term.dataset.term ?? "") ?? "";
    tip.hidden = false;
    term.setAttribute("aria-describedby", tip.id);
    place();
  }

  /** Put the help below its term, or else above. */
  function place() {
    if (!shown) return;
    const { left, bottom, top } = shown.getBoundingClientRect();
    const { width, height } = tip.getBoundingClientRect();
    const below = bottom + 6 + height < window.innerHeight;
    const rightmost = Math.max(8, document.documentElement.clientWidth - width - 8);
    tip.style.left = `${clamp(left, 8, rightmost)}px`;
    tip.style.top = `${below ? bottom + 6 : Math.max(8, top - 6 - height)}px`;
  }

  for (const name of ["pointerover", "focusin", "click"]) document.addEventListener(name, show);
  document.addEventListener("focusout", hide);
  window.addEventListener("scroll", place, { passive: true });
  document.addEventListener(
    "keydown",
    event => {
      if (event.key !== "Escape" || tip.hidden) return;
      hide();
      event.stopPropagation(); // Escape would also leave the scene
    },
    true,
  );
}

explainTerms(document.body);
listenForHelp(byId("tip"));
