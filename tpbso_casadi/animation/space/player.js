// Each figure.space-player plays the motion in its JSON.
const REST = 0.8, SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2];

function between(rows, place) {
  const end = rows.length - 1, row = Math.min(Math.floor(place), end), next = Math.min(row + 1, end);
  const share = place - row;
  const mixed = (a, b) => Array.isArray(a) ? a.map((value, i) => mixed(value, b[i])) : a + share * (b - a);
  return mixed(rows[row], rows[next]);
}

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
    zoom(camera, Math.exp(0.0015 * Math.max(-200, Math.min(200, event.deltaY))), home);
    changed();
  }, { passive: false });
}

function start(figure) {
  const motion = JSON.parse(figure.querySelector("script").textContent);
  const find = (name) => figure.querySelector(`.${name}`);
  const canvas = find("scene"), slider = find("time"), button = find("play"), clock = find("clock");
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const last = motion.times.length - 1, end = motion.times[last];
  const home = { ...motion.camera }, camera = { ...home };
  let playing = !calm, seen = false, time = calm ? end : 0, before = null, waiting = false, paint, curves, colours;

  function option(select, text, value, chosen) {
    const entry = document.createElement("option");
    entry.textContent = text;
    entry.value = value;
    entry.selected = chosen;
    select.append(entry);
  }
  const fitting = SPEEDS.map((speed) => Math.abs(Math.log(speed * motion.seconds / end)));
  SPEEDS.forEach((speed, i) => option(find("speed"), `${speed}\u00d7`, speed, fitting[i] === Math.min(...fitting)));
  motion.curves.forEach((curve, i) => option(find("quantity"), curve.label, i, i === 0));
  const values = motion.joint_names.map((name, joint) => {
    const [entry, chip, value] = ["li", "i", "output"].map((name) => document.createElement(name));
    chip.style.background = motion.colours[joint % motion.colours.length];
    entry.append(chip, `${name} `, value);
    find("joints").append(entry);
    return value;
  });

  function restyle() {
    const colour = (name) => getComputedStyle(figure).getPropertyValue(`--${name}`).trim();
    const names = ["ground", "ink", "faint", "grid", "way", "task", "obstacle", "edge", "close"];
    colours = Object.fromEntries(names.map((name) => [name, colour(name)]));
    colours.axes = ["x", "y", "z"].map((name) => colour(`axis-${name}`));
    colours.bodies = [colour("body"), colour("body-two")];
    colours.joints = motion.colours;
    paint = painterOf(motion, canvas.getContext("2d"), colours);
    curves = curvesOf(motion, find("curves"), colours);
    ask();
  }
  function draw() {
    const scale = Math.min(devicePixelRatio || 1, 2), place = time / end * last, row = Math.floor(place);
    const width = Math.round(canvas.clientWidth * scale), height = Math.round(canvas.clientHeight * scale);
    if (width && height) {
      if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
      const joints = between(motion.joints, place), nearest = Math.round(place), closest = motion.closest;
      const close = closest && { points: closest.points[nearest], distance: closest.distances[nearest] };
      const passed = [...motion.way.slice(0, row + 1), joints[joints.length - 1]];
      const frames = motion.moving.map((obstacle) => between(obstacle.frames, place));
      const state = { centers: between(motion.centers, place), joints, frames, passed, close };
      paint(viewOf(camera, width, height), state, scale);
      const names = close && closest.names[closest.numbers[nearest]];
      find("near").textContent = close ? `Closest: ${names}, ${inMillimetres(close.distance)}` : "";
    }
    const curve = motion.curves[find("quantity").value], now = between(curve.values, place);
    curves.draw(curve, time, now);
    values.forEach((value, joint) => { value.textContent = `${now[joint].toFixed(3)} ${curve.units[joint]}`; });
    slider.value = Math.round(1000 * time / end);
    clock.textContent = `${time.toFixed(3)} s`;
    find("note").textContent = motion.notes.findLast(([from]) => from <= time)?.[1] ?? "";
    button.textContent = playing ? "Pause" : "Play";
  }
  function ask() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(step);
  }
  let beyond = 0;
  function step(now) {
    waiting = false;
    if (playing && seen && before !== null) {
      const passed = (now - before) / 1000;
      if (time >= end) beyond += passed;
      else time = Math.min(end, time + passed * find("speed").value);
      if (beyond > REST) { time = 0; beyond = 0; }
    }
    before = playing && seen ? now : null;
    draw();
    if (playing && seen) ask();
  }
  function goTo(moment) { playing = false; beyond = 0; time = Math.max(0, Math.min(end, moment)); ask(); }
  function toggle() { playing = !playing; if (playing && time >= end) time = 0; beyond = 0; ask(); }

  button.addEventListener("click", toggle);
  slider.addEventListener("input", () => goTo(slider.value / 1000 * end));
  find("quantity").addEventListener("change", ask);
  for (const name of ["pointerdown", "pointermove"])
    find("curves").addEventListener(name, (event) => { if (event.buttons) goTo(curves.timeAt(event)); });
  canvas.addEventListener("keydown", (event) => {
    const keys = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    if (event.key === " ") toggle();
    else if (event.key === "+" || event.key === "-") zoom(camera, event.key === "+" ? 0.9 : 1.1, home);
    else if (keys[event.key]) turn(camera, ...keys[event.key]);
    else return;
    event.preventDefault();
    ask();
  });
  const quarter = Math.PI / 2, reset = [home.azimuth, home.elevation];
  const views = { top: [-quarter, quarter], front: [-quarter, 0], side: [0, 0], fit: reset };
  for (const [name, [azimuth, elevation]] of Object.entries(views))
    find(name).addEventListener("click", () => { Object.assign(camera, home, { azimuth, elevation }); ask(); });
  steer(canvas, camera, home, ask);
  new IntersectionObserver((entries) => { seen = entries[entries.length - 1].isIntersecting; ask(); }).observe(figure);
  const resized = new ResizeObserver(ask);
  resized.observe(canvas);
  resized.observe(find("curves"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", restyle);
  restyle();
  draw();  // at once: a browser that is busy may take long to give the first frame
}

document.querySelectorAll("figure.space-player").forEach(start);
