// An arm in the plane, to scale, on axes in metres.
const FRAME = { left: 44, right: 10, top: 10, bottom: 26 };

// The outline of an obstacle whose frame moves: origin x, y, and first axis u, v.
const outlineAt = ({ outline }, [x, y, u, v]) => outline.map(([p, q]) => [x + p * u - q * v, y + p * v + q * u]);

function planeStage(motion) {
  const seen = [...motion.joints, motion.points, ...motion.obstacles].flat();
  let roomiest = { of: "" };  // of the corners of the picture: the one with the fewest things

  function placesOf(pen) {
    const [left, right, bottom, top] = motion.extent;
    const box = { ...FRAME, right: pen.width - FRAME.right, bottom: pen.height - FRAME.bottom };
    const unit = Math.min((box.right - box.left) / (right - left), (box.bottom - box.top) / (top - bottom));
    const middle = [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
    const center = [(left + right) / 2, (bottom + top) / 2];
    return {
      box, unit,
      at: ([x, y]) => [middle[0] + (x - center[0]) * unit, middle[1] - (y - center[1]) * unit],
      low: [center[0] + (box.left - middle[0]) / unit, center[1] - (box.bottom - middle[1]) / unit],
      high: [center[0] + (box.right - middle[0]) / unit, center[1] - (box.top - middle[1]) / unit],
    };
  }
  function paintAxes(pen, theme, { box, unit, at, low, high }) {
    const span = Math.min(high[0] - low[0], high[1] - low[1]), step = stepOf(span, span * unit / 55);
    const digits = digitsOf(step), below = { align: "center", baseline: "top" };
    for (const tick of ticksOf(low[0], high[0], step)) {
      const x = at([tick, 0])[0];
      pen.line([[x, box.top], [x, box.bottom]], 1, theme.grid);
      if (x < box.right - 44) pen.write(written(tick, digits), [x, box.bottom + 7], theme.ink, below);
    }
    for (const tick of ticksOf(low[1], high[1], step)) {
      const y = at([0, tick])[1];
      pen.line([[box.left, y], [box.right, y]], 1, theme.grid);
      if (y > box.top + 18) pen.write(written(tick, digits), [box.left - 6, y], theme.ink, { align: "right" });
    }
    pen.write("x [m]", [box.right, box.bottom + 7], theme.ink, { align: "right", baseline: "top", weight: 600 });
    pen.write("y [m]", [box.left - 6, box.top], theme.ink, { align: "right", baseline: "top", weight: 600 });
  }
  function cornerFor(pen, { box, at }) {
    const of = `${pen.width} ${pen.height}`, wide = pen.width / 5 + 60, high = 44;
    if (roomiest.of === of) return roomiest;
    const spots = seen.map(at), rights = [box.right, box.left + wide];
    for (const bottom of [box.bottom, box.top + high]) for (const right of rights) {
      const held = spots.filter(([x, y]) => x < right && x > right - wide && y < bottom && y > bottom - high).length;
      if (roomiest.of !== of || held < roomiest.held) roomiest = { of, right, bottom, held };
    }
    return roomiest;
  }
  function paintObstacles(pen, theme, at, row) {
    for (const { way } of motion.moving) pen.line(way.map(at), 1.2, theme.edge, { alpha: 0.7, dashes: [4, 3] });
    const moved = motion.moving.map((moving) => outlineAt(moving, between(moving.frames, row)));
    for (const outline of [...motion.obstacles, ...moved]) {
      const corners = outline.map(at);
      pen.fill(corners, theme.obstacle, 0.35);
      pen.line([...corners, corners[0]], 1.2, theme.edge, { alpha: 0.8 });
    }
  }
  function paintArm(pen, theme, { at, unit }, joints) {
    for (const [start, end, radius] of motion.bodies)
      pen.line([at(joints[start]), at(joints[end])], 2 * radius * unit, theme.ink, { alpha: 0.25 });
    pen.line(joints.map(at), 3, theme.ink);
    joints.forEach((joint, index) => pen.dot(at(joint), index ? 4.5 : 6, index ? theme.ground : theme.ink, theme.ink));
  }

  return {
    views: [],
    bindings: [],
    dress() {},
    paint(pen, theme, { row, joints, ways, passed, close }) {
      const places = placesOf(pen), { box, at, unit } = places, corner = cornerFor(pen, places);
      paintAxes(pen, theme, places);
      pen.within(box, () => {
        drawScaleBar(pen, theme, unit, corner.right, corner.bottom);
        paintObstacles(pen, theme, at, row);
        pen.line(ways[0].map(at), 1.5, theme.way, { alpha: 0.35 });
        pen.line(passed[0].map(at), 2.5, theme.way);
        paintArm(pen, theme, places, joints);
        for (const point of motion.points) pen.dot(at(point), 4, theme.task, theme.ground);
        if (close) drawClosest(pen, theme, close.points.map(at), close.distance);
      });
    },
  };
}
