// Charts: Vega makes the page's pictures live once they are seen.

/** Vega, which is packed text until a chart needs it. @type {Promise<any> | undefined} */
let vega;

/** @returns {Promise<any>} */
function loadVega() {
  return (vega ??= startVega());
}

/** @returns {Promise<any>} */
async function startVega() {
  const packed = document.getElementById("vega")?.textContent ?? "";
  const textContent = new TextDecoder().decode(await inflate(packed));
  return new Promise((done) => {
    window.addEventListener("vega", () => done(/** @type {any} */ (window).vegaEmbed));
    document.body.append(Object.assign(document.createElement("script"), { type: "module", textContent }));
  });
}

const seen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (!isIntersecting) continue;
    seen.unobserve(target);
    void enliven(target);
  }
}, { rootMargin: "200px" });

/** @param {Element} section */
function watchCharts(section) {
  if (!document.getElementById("vega")) return;
  for (const chart of section.querySelectorAll(".chart:not(.live)")) seen.observe(chart);
}

/** @param {Element} chart */
async function enliven(chart) {
  const embed = await loadVega();
  chart.classList.add("live");
  const spec = JSON.parse(chart.closest("figure")?.querySelector("script")?.textContent ?? "{}");
  // Expressions are interpreted, since the page's policy forbids code made from text.
  await embed(chart, spec, { ast: true, renderer: "svg", actions: false, mode: "vega-lite" });
  chart.querySelector("svg")?.setAttribute("aria-hidden", "true"); // the chart has a label
  await makePoints(chart);
}
