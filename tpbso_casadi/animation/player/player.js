// Each figure.player plays the motion in its JSON, on the stage that it names, when it is in sight.
const STAGES = { plane: planeStage, space: spaceStage };

function start(figure) {
  let seen = false, before = null, waiting = false, theme = null;
  const motion = JSON.parse(figure.querySelector("script").textContent);
  const find = (name) => figure.querySelector(`.${name}`);
  const last = motion.times.length - 1, calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const clock = clockOf(motion.times[last], !calm);
  const scene = find("scene"), pen = penOf(scene), plots = find("curves");
  const stage = STAGES[figure.dataset.stage](motion, scene, ask);
  const transport = transportOf(find, clock, { steps: last, seconds: motion.seconds, broken: motion.broken }, ask);
  const stages = stagesOf(find("stages"), motion.stages, clock, transport.goTo);
  const curves = curvesOf(motion, plots), legend = legendOf(find("joints"), motion.joint_names);
  const ways = motion.strokes.map((stroke) => motion.joints.map((posture) => posture[stroke.at(-1)]));

  function restyle() {
    theme = themeOf(figure, motion.lines);
    stage.dress(theme);
    legend.dress(theme);
    ask();
  }
  function stateAt(row) {
    const joints = between(motion.joints, row), until = Math.floor(row) + 1;
    const passed = ways.map((way, tool) => [...way.slice(0, until), joints[motion.strokes[tool].at(-1)]]);
    const { points, distances, numbers, names } = motion.closest ?? {}, near = Math.round(row);
    const close = points && { points: points[near], distance: distances[near], names: names[numbers[near]] };
    return { row, joints, ways, passed, close };
  }
  function draw() {
    const row = clock.time / clock.end * last, state = stateAt(row);
    if (pen.clear()) stage.paint(pen, theme, state);
    if (state.close) find("near").textContent = `Closest now: ${state.close.names}, ${foundDistance(state.close.distance)}`;
    find("note").textContent = motion.notes.findLast(([from]) => from <= clock.time)?.[1] ?? "";
    const numbers = shown(), first = motion.curves[numbers[0]];
    curves.draw(numbers, clock.time, row, theme);
    legend.show(first, between(first.values, row));
    transport.show();
    stages.show();
  }
  function ask() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(step);
  }
  function step(now) {
    waiting = false;
    const moving = clock.playing && seen;
    if (moving && before !== null) clock.pass((now - before) / 1000);
    before = moving ? now : null;
    draw();
    if (moving) ask();
  }

  find("near").hidden = !motion.closest;
  find("whole-way").hidden = !motion.clearance;
  find("whole-way").textContent = `Over the whole motion: ${motion.clearance}`;
  find("note").hidden = !motion.notes.length;
  const shown = chooserOf(find("quantity"), motion.curves, plots.parentElement.clientHeight, ask);
  followPointer(plots, (event) => transport.goTo(curves.timeAt(event)));
  listViews(find("views"), stage.views);
  bindKeys(figure, find, clock, transport, [...stages.bindings, ...stage.bindings]);
  new IntersectionObserver((entries) => { seen = entries[entries.length - 1].isIntersecting; ask(); }).observe(figure);
  const resized = new ResizeObserver(ask);
  for (const element of [scene, plots, plots.parentElement]) resized.observe(element);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", restyle);
  restyle();
  draw();  // at once: a browser that is busy may take long to give the first frame
}

document.querySelectorAll("figure.player").forEach(start);
