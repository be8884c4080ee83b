// Orbit by dragging, move with the right button, shift or two fingers, zoom by wheel or fingers.
function steer(canvas, camera, home, changed) {
  const held = new Map();
  const spread = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const old = held.get(event.pointerId);
    if (!old) return;
    const now = { x: event.clientX, y: event.clientY }, side = Math.min(canvas.clientWidth, canvas.clientHeight);
    const dx = now.x - old.x, dy = now.y - old.y;
    const other = [...held].filter(([id]) => id !== event.pointerId).map(([, place]) => place)[0];
    if (other) {
      zoom(camera, spread(old, other) / Math.max(spread(now, other), 1), home);
      shift(camera, dx / 2, dy / 2, side);
    } else if (event.shiftKey || event.buttons === 2) shift(camera, dx, dy, side);
    else turn(camera, 4 * dx / side, 4 * dy / side);
    held.set(event.pointerId, now);
    changed();
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => held.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(camera, Math.exp(0.0015 * within(event.deltaY, -200, 200)), home);
    changed();
  }, { passive: false });
}
