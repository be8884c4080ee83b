// What is chosen beside the time: the curves that are shown, and from where the picture is seen.
function option(select, text, value) {
  const entry = document.createElement("option");
  Object.assign(entry, { textContent: text, value });
  select.append(entry);
}

// A list of curves, all of them chosen where there is room; returns what gives the numbers of those chosen now.
function chooserOf(select, curves, room, changed) {
  const all = [...curves.keys()];
  if (all.length > 1) option(select, "all curves", "all");
  curves.forEach((curve, number) => option(select, curve.label, number));
  if (room < LEAST * all.length) select.value = 0;
  select.addEventListener("change", changed);
  return () => select.value === "all" ? all : [Number(select.value)];
}

function followPointer(canvas, seek) {
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); seek(event); });
  canvas.addEventListener("pointermove", (event) => { if (event.buttons) seek(event); });
}

function listViews(place, views) {
  for (const { name, run } of views) {
    const button = place.appendChild(document.createElement("button"));
    Object.assign(button, { type: "button", textContent: name, className: name.toLowerCase() });
    button.addEventListener("click", run);
  }
}
