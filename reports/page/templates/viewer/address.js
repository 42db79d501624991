// Where the view is kept: in the address, so that it can be sent and the browser's arrows work.

/**
 * @typedef {object} Address
 * @property {() => string} read                    the fragment
 * @property {(fragment: string) => void} go        see another view; the way back leads here
 * @property {(fragment: string) => void} replace   keep another view, without a step back
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

/** A frame in a notebook has no address of its own: the notebook's must not change. @returns {Address} */
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
