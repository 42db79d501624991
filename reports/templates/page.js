// The split view reuses the two pictures above it; without scripts it stays hidden.
for (const split of document.querySelectorAll(".split")) {
  const [left, right] = split.parentElement.querySelectorAll("img");
  if (!left || !right) continue;
  const stack = split.querySelector(".stack");
  const below = right.cloneNode(), above = left.cloneNode();
  above.alt = "";
  above.className = "above";
  below.alt = "Textbook shading on the left of the divide, physical reference on the right";
  stack.append(below, above);
  const range = split.querySelector("input");
  const move = (percent) => { range.value = percent; stack.style.setProperty("--at", percent + "%"); };
  range.addEventListener("input", () => move(range.value));
  const follow = (event) => {
    const box = stack.getBoundingClientRect();
    move(Math.min(100, Math.max(0, 100 * (event.clientX - box.left) / box.width)));
  };
  stack.addEventListener("pointerdown", (event) => { stack.setPointerCapture(event.pointerId); follow(event); });
  stack.addEventListener("pointermove", (event) => { if (event.buttons) follow(event); });
  split.hidden = false;
}
