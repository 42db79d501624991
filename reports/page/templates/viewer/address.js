// The view is kept in the address: it can be sent, and the browser's arrows work.

/**
 * @typedef {object} Address
 * @property {() => string} read                    the fragment
 * @property {(fragment: string) => void} go        show another view; the browser's back button returns here
 * @property {(fragment: string) => void} replace   keep another view, without an entry in the history
 * @property {(seen: () => void) => void} listen    call after each step
 */

/** @returns {Address} */
function makeAddress() {
  return location.protocol === "about:" ? insideFrame() : ofPage();
}

/** @returns {Address} */
function ofPage() {
  return {
    read: () => location.hash,
    go: (fragment) => { location.hash = fragment; },
    replace: (fragment) => history.replaceState(null, "", fragment),
    listen: (seen) => window.addEventListener("hashchange", seen),
  };
}

/** In a notebook's frame, which must not change the notebook's address. @returns {Address} */
function insideFrame() {
  let fragment = "";
  /** @type {() => void} */
  let tell = () => {};
  const go = (/** @type {string} */ next) => {
    fragment = next;
    tell();
  };
  document.addEventListener("click", (event) => {
    const link = /** @type {HTMLElement} */ (event.target).closest('a[href^="#"]');
    if (!link) return;
    event.preventDefault();
    go(link.getAttribute("href") ?? "");
  });
  return {
    read: () => fragment,
    go,
    replace: (next) => { fragment = next; },
    listen: (seen) => { tell = seen; },
  };
}
