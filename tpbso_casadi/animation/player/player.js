// Each figure.player plays the motion in its JSON, on the stage that it names, when it is in sight.
const STAGES = { plane: planeStage, space: spaceStage };

function start(figure) {
  let seen = false, before = null, waiting = false, theme = null;
  const motion = JSON.parse(figure.querySelector("script").textContent);
  const find = (name) => figure.querySelector(`.${name}`);
  const last = motion.times.length - 1, calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const clock = clockOf(motion.times[last], !calm);
  const scene = find("scene"), pen = penOf(scene), quantity = find("quantity"), plots = find("curves");
  const stage = STAGES[figure.dataset.stage](motion, scene, ask);
  const transport = transportOf(find, clock, { steps: last, seconds: motion.seconds }, ask);
  const curves = curvesOf(motion, plots), all = [...motion.curves.keys()];
  const legend = legendOf(find("joints"), motion.joint_names);
  const way = motion.joints.map((posture) => posture[posture.length - 1]);

  function restyle() {
    theme = themeOf(figure, motion.lines);
    stage.dress(theme);
    legend.dress(theme);
    ask();
  }
  function stateAt(row) {
    const joints = between(motion.joints, row), tip = joints[joints.length - 1];
    const passed = [...way.slice(0, Math.floor(row) + 1), tip];
    const { points, distances, numbers, names } = motion.closest ?? {}, near = Math.round(row);
    const close = points && { points: points[near], distance: distances[near], names: names[numbers[near]] };
    return { row, joints, way, passed, close };
  }
  function draw() {
    const row = clock.time / clock.end * last, state = stateAt(row);
    if (pen.clear()) stage.paint(pen, theme, state);
    if (state.close) find("near").textContent = `Closest: ${state.close.names}, ${inMillimetres(state.close.distance)}`;
    find("note").textContent = motion.notes.findLast(([from]) => from <= clock.time)?.[1] ?? "";
    const shown = quantity.value === "all" ? all : [Number(quantity.value)];
    curves.draw(shown, clock.time, row, theme);
    legend.show(motion.curves[shown[0]], between(motion.curves[shown[0]].values, row));
    transport.show();
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

  function listCurves() {
    if (all.length > 1) option(quantity, "all curves", "all");
    motion.curves.forEach((curve, number) => option(quantity, curve.label, number));
    if (plots.parentElement.clientHeight < LEAST * all.length) quantity.value = 0;
    quantity.addEventListener("change", ask);
    const seek = (event) => { if (event.buttons) transport.goTo(curves.timeAt(event)); };
    plots.addEventListener("pointerdown", (event) => { plots.setPointerCapture(event.pointerId); seek(event); });
    plots.addEventListener("pointermove", seek);
  }
  function listViews() {
    for (const { name, run } of stage.views) {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: name, className: name.toLowerCase() });
      button.addEventListener("click", run);
      find("views").append(button);
    }
  }
  function listBindings() {
    const help = find("keys"), screen = find("screen"), alone = figure.classList.contains("full");
    const { toggle, step, goTo, faster, slower } = transport;
    const fill = () => document.fullscreenElement ? document.exitFullscreen() : figure.requestFullscreen();
    const bindings = [
      { keys: [" "], shown: "space", what: "play or pause", run: toggle },
      {
        keys: ["ArrowLeft", "ArrowRight"], shown: "\u2190 \u2192", what: "one step back, or on",
        run: (on) => step(on ? 1 : -1),
      },
      {
        keys: ["Home", "End"], shown: "Home, End", what: "to the start, or the end",
        run: (on) => goTo(on ? clock.end : 0),
      },
      {
        keys: ["ArrowUp", "ArrowDown"], shown: "\u2191 \u2193", what: "faster, or slower",
        run: (down) => (down ? slower : faster)(),
      },
      ...stage.bindings,
      { keys: ["f"], shown: "f", what: "full screen", run: fill },
      { keys: ["?"], shown: "?", what: "this list", run: () => help.showModal() },
    ];
    bind(alone ? document : figure, bindings);
    listKeys(find("list"), bindings);
    find("help").addEventListener("click", () => help.showModal());
    screen.hidden = !document.fullscreenEnabled;
    screen.addEventListener("click", fill);
  }

  find("near").hidden = !motion.closest;
  find("note").hidden = !motion.notes.length;
  listCurves();
  listViews();
  listBindings();
  new IntersectionObserver((entries) => { seen = entries[entries.length - 1].isIntersecting; ask(); }).observe(figure);
  const resized = new ResizeObserver(ask);
  for (const element of [scene, plots, plots.parentElement]) resized.observe(element);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", restyle);
  restyle();
  draw();  // at once: a browser that is busy may take long to give the first frame
}

document.querySelectorAll("figure.player").forEach(start);
