// Charts: the pictures in the page made live by Vega, where the page holds it.

/** @param {HTMLElement} section */
async function enliven(section) {
  const embed = /** @type {any} */ (window).vegaEmbed;
  if (!embed) return;
  for (const chart of section.querySelectorAll(".chart:not(.live)")) {
    chart.classList.add("live");
    const spec = JSON.parse(chart.closest("figure")?.querySelector("script")?.textContent ?? "{}");
    // Expressions are interpreted: the page's policy forbids code made of text.
    await embed(chart, spec, { ast: true, renderer: "svg", actions: false, mode: "vega-lite" });
    chart.querySelector("svg")?.setAttribute("aria-hidden", "true"); // the chart's label says it
  }
}
