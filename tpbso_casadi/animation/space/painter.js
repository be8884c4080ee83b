// Pictures of a scene: ground, obstacles, balls of the robot, its joints, the way of the tool, the closest two.
const SPRITE = 128, ROUND = 24;

const inMillimetres = (metres) => `${(1000 * metres).toFixed(1)} mm`;

// The convex hull of points in the picture.
function hullOf(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const left = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  const half = (chain, point) => {
    while (chain.length > 1 && !left(chain[chain.length - 2], chain[chain.length - 1], point)) chain.pop();
    chain.push(point);
    return chain;
  };
  return [...sorted.reduce(half, []).slice(0, -1), ...sorted.reverse().reduce(half, []).slice(0, -1)];
}

function spriteOf(colour) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d"), r = SPRITE / 2;
  canvas.width = canvas.height = SPRITE;
  const shade = pen.createRadialGradient(0.72 * r, 0.6 * r, 0.08 * r, r, r, r);
  shade.addColorStop(0, `color-mix(in srgb, ${colour}, white 55%)`);
  shade.addColorStop(0.55, colour);
  shade.addColorStop(1, `color-mix(in srgb, ${colour}, black 45%)`);
  pen.fillStyle = shade;
  pen.arc(r, r, r - 1, 0, 2 * Math.PI);
  pen.fill();
  return canvas;
}

// A solid whose frame is elsewhere: its origin, and its three axes.
function placedSolid(solid, [origin, ...axes]) {
  const turned = (v) => origin.map((_, k) => v[0] * axes[0][k] + v[1] * axes[1][k] + v[2] * axes[2][k]);
  const placed = (v) => turned(v).map((value, k) => value + origin[k]);
  const normals = solid.normals.map(turned);
  return {
    ...solid, vertices: solid.vertices.map(placed), center: placed(solid.center), normals,
    offsets: solid.offsets.map((offset, f) => offset + dot(normals[f], origin)),
  };
}

function painterOf(motion, pen, colours) {
  const { radii, kinds, moving } = motion;
  const sprites = colours.bodies.map(spriteOf);

  function stroke(points, width, style, alpha = 1) {
    if (points.length < 2) return;
    pen.beginPath();
    points.forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](x, y));
    pen.lineWidth = width;
    pen.strokeStyle = style;
    pen.globalAlpha = alpha;
    pen.stroke();
    pen.globalAlpha = 1;
  }
  function disc(spot, radius, style, edge) {
    if (!spot) return;
    pen.beginPath();
    pen.arc(spot[0], spot[1], radius, 0, 2 * Math.PI);
    pen.fillStyle = style;
    pen.fill();
    if (edge) { pen.lineWidth = radius / 3; pen.strokeStyle = edge; pen.stroke(); }
  }
  function write(text, spot, style, size) {
    pen.font = `600 ${size}px system-ui, sans-serif`;
    pen.lineWidth = size / 4;
    pen.strokeStyle = colours.ground;
    pen.strokeText(text, spot[0], spot[1]);
    pen.fillStyle = style;
    pen.fillText(text, spot[0], spot[1]);
  }

  function fill(corners, alpha) {
    pen.beginPath();
    corners.forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](x, y));
    pen.globalAlpha = alpha;
    pen.fillStyle = colours.obstacle;
    pen.fill();
    pen.globalAlpha = 1;
  }
  function paintEdges(view, solid, seen, front) {
    for (const [one, two, f, g, sharp] of solid.edges)
      if ((seen[f] || seen[g]) === front && (sharp || seen[f] !== seen[g]))
        stroke(view.line([solid.vertices[one], solid.vertices[two]]), pen.scale, colours.edge, front ? 0.8 : 0.3);
  }
  // Of something round the outline alone is filled: it has hundreds of faces.
  function paintRound(view, solid, seen, spots) {
    const outline = hullOf(spots);
    paintEdges(view, solid, seen, false);
    fill(outline, 0.38);
    stroke([...outline, outline[0]], pen.scale, colours.edge, 0.8);
    paintEdges(view, solid, seen, true);
  }
  function paintSolid(view, solid, seen) {
    const spots = solid.faces.length > ROUND ? solid.vertices.map(view.point) : [null];
    if (spots.every(Boolean)) return paintRound(view, solid, seen, spots);
    const faces = solid.faces.map((face) => face.map((corner) => solid.vertices[corner]));
    for (const front of [false, true]) {
      faces.forEach((corners, f) => {
        if (seen[f] === front) fill(view.polygon(corners), (front ? 0.3 : 0.14) * solid.shades[f]);
      });
      paintEdges(view, solid, seen, front);
    }
  }
  function paintThings(view, centers, frames) {
    const solids = [...motion.solids];
    moving.forEach(({ number }, i) => { solids[number] = placedSolid(solids[number], frames[i]); });
    const planes = [...motion.planes, ...partingPlanes(solids, moving.map(({ number }) => number))];
    const seen = solids.map((solid) => solid.normals.map((normal, f) => dot(normal, view.eye) > solid.offsets[f]));
    const spots = centers.map(view.point);
    const things = spots.map((spot, ball) => {
      const r = spot && radii[ball] * spot[2];
      return spot && { left: spot[0] - r, right: spot[0] + r, top: spot[1] - r, bottom: spot[1] + r, away: spot[3] };
    });
    for (const solid of solids) {
      const shown = solid.vertices.map(view.point).filter(Boolean), cut = shown.length < solid.vertices.length;
      const xs = shown.map((spot) => spot[0]), ys = shown.map((spot) => spot[1]);
      things.push(shown.length ? {
        left: cut ? -Infinity : Math.min(...xs), right: cut ? Infinity : Math.max(...xs),
        top: cut ? -Infinity : Math.min(...ys), bottom: cut ? Infinity : Math.max(...ys), away: view.away(solid.center),
      } : null);
    }
    for (const number of paintingOrder(things, behindness(solids, planes, centers, seen, things))) {
      if (number >= centers.length) paintSolid(view, solids[number - centers.length], seen[number - centers.length]);
      else {
        const { left, right, top, bottom } = things[number];
        pen.drawImage(sprites[kinds[number] % sprites.length], left, top, right - left, bottom - top);
      }
    }
  }
  function paintGround(view) {
    for (const line of motion.ground) stroke(view.line(line), pen.scale, colours.faint, 0.35);
    motion.axes.forEach(([name, from, to], axis) => {
      stroke(view.line([from, to]), 2 * pen.scale, colours.axes[axis]);
      const spot = view.point(to);
      if (spot) write(name, spot, colours.axes[axis], 12 * pen.scale);
    });
  }
  function paintClosest(view, close) {
    const spots = close.points.map(view.point);
    stroke(view.line(close.points), 2.5 * pen.scale, colours.close);
    for (const spot of spots) disc(spot, 3.5 * pen.scale, colours.close);
    const [spot] = spots, text = inMillimetres(close.distance);
    if (spot) write(text, [spot[0] + 8 * pen.scale, spot[1]], colours.close, 12 * pen.scale);
  }

  // state: centers, joints, frames (of what moves by itself), passed (points of the way until now), close ({ points, distance } or null).
  return (view, state, scale) => {
    pen.scale = scale;
    pen.lineJoin = pen.lineCap = "round";
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.clearRect(0, 0, pen.canvas.width, pen.canvas.height);
    paintGround(view);
    for (const { way } of moving) stroke(view.line(way), 1.2 * scale, colours.edge, 0.6);
    paintThings(view, state.centers, state.frames);
    stroke(view.line(motion.way), 1.5 * scale, colours.way, 0.35);
    stroke(view.line(state.passed), 2.5 * scale, colours.way);
    stroke(view.line(state.joints), 1.5 * scale, colours.ink, 0.7);
    for (const joint of state.joints) disc(view.point(joint), 2.5 * scale, colours.ground, colours.ink);
    for (const point of motion.points) disc(view.point(point), 4 * scale, colours.task, colours.ground);
    if (state.close) paintClosest(view, state.close);
  };
}
