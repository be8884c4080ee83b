// A robot in space, seen by a camera that can be turned.
function spaceStage(motion, canvas, changed) {
  const home = { ...motion.camera }, camera = { ...home }, quarter = Math.PI / 2;
  let paint = null, cover = false;  // for the colours of now; whether the spheres around links are shown
  const turnCover = () => { cover = !cover; changed(); };
  const look = (azimuth, elevation) => () => { Object.assign(camera, home, { azimuth, elevation }); changed(); };
  const views = [
    { name: "Top", run: look(-quarter, quarter) },
    { name: "Front", run: look(-quarter, 0) },
    { name: "Side", run: look(0, 0) },
    { name: "Reset", run: look(home.azimuth, home.elevation) },
    ...(motion.looks.length ? [{ name: "Cover", run: turnCover }] : []),
  ];
  const turned = (across, along) => { turn(camera, across, along); changed(); };
  const zoomed = (factor) => { zoom(camera, factor, home); changed(); };
  steer(canvas, camera, home, changed);
  return {
    views,
    bindings: [
      {
        keys: ["Shift+ArrowLeft", "Shift+ArrowRight"], shown: "shift \u2190 \u2192", what: "turn the camera",
        run: (on) => turned(on ? 0.1 : -0.1, 0),
      },
      {
        keys: ["Shift+ArrowUp", "Shift+ArrowDown"], shown: "shift \u2191 \u2193", what: "raise or lower the camera",
        run: (down) => turned(0, down ? -0.1 : 0.1),
      },
      { keys: ["+", "-"], shown: "+ \u2212", what: "zoom in, or out", run: (out) => zoomed(out ? 1.1 : 0.9) },
      {
        keys: ["1", "2", "3", "0"], shown: "1 2 3 0", what: "from the top, front, side, or as at first",
        run: (view) => views[view].run(),
      },
      ...(motion.looks.length
        ? [{ keys: ["c"], shown: "c", what: "show or hide the spheres of the cover", run: turnCover }] : []),
    ],
    dress() { paint = null; },
    paint(pen, theme, { row, joints, ways, passed, close }) {
      paint ??= painterOf(motion, pen, theme);
      const view = viewOf(camera, pen.width, pen.height), centers = between(motion.centers, row);
      const frames = motion.moving.map((moving) => between(moving.frames, row)), bodies = between(motion.bodies, row);
      paint(view, { centers, joints, ways, passed, close, frames, bodies, cover });
      drawScaleBar(pen, theme, view.point(camera.center)[2], pen.width, pen.height, " at the middle");
    },
  };
}
