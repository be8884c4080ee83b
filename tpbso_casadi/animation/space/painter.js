// Pictures of a scene: ground, obstacles, the robot as it looks or as balls, its joints, the way of the tool, the
// closest two.
const SPRITE = 128, ROUND = 24, COVER = 0.2;  // the last: opacity of balls around links that are seen

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

function painterOf(motion, pen, theme) {
  const { radii, kinds, moving, looks } = motion, bare = new Set(motion.bare);
  const sprites = [theme.body, theme["body-two"]].map(spriteOf);

  function paintEdges(view, solid, seen, front) {
    for (const [one, two, f, g, sharp] of solid.edges)
      if ((seen[f] || seen[g]) === front && (sharp || seen[f] !== seen[g]))
        pen.line(view.line([solid.vertices[one], solid.vertices[two]]), 1, theme.edge, { alpha: front ? 0.8 : 0.3 });
  }
  // Of something round the outline alone is filled: it has hundreds of faces.
  function paintRound(view, solid, seen, spots) {
    const outline = hullOf(spots);
    paintEdges(view, solid, seen, false);
    pen.fill(outline, theme.obstacle, 0.38);
    pen.line([...outline, outline[0]], 1, theme.edge, { alpha: 0.8 });
    paintEdges(view, solid, seen, true);
  }
  function paintSolid(view, solid, seen) {
    const spots = solid.faces.length > ROUND ? solid.vertices.map(view.point) : [null];
    if (spots.every(Boolean)) return paintRound(view, solid, seen, spots);
    const faces = solid.faces.map((face) => face.map((corner) => solid.vertices[corner]));
    for (const front of [false, true]) {
      faces.forEach((corners, f) => {
        if (seen[f] === front) pen.fill(view.polygon(corners), theme.obstacle, (front ? 0.3 : 0.14) * solid.shades[f]);
      });
      paintEdges(view, solid, seen, front);
    }
  }
  // Where a ball, and where a solid, is in the picture; null for what is not before the eye.
  function placeOfBall(view, center, ball) {
    const spot = view.point(center), r = spot && radii[ball] * spot[2];
    return spot && { left: spot[0] - r, right: spot[0] + r, top: spot[1] - r, bottom: spot[1] + r, away: spot[3] };
  }
  function placeOfSolid(view, solid) {
    const shown = solid.vertices.map(view.point).filter(Boolean), cut = shown.length < solid.vertices.length;
    const xs = shown.map((spot) => spot[0]), ys = shown.map((spot) => spot[1]);
    return shown.length ? {
      left: cut ? -Infinity : Math.min(...xs), right: cut ? Infinity : Math.max(...xs),
      top: cut ? -Infinity : Math.min(...ys), bottom: cut ? Infinity : Math.max(...ys), away: view.away(solid.center),
    } : null;
  }
  function paintBall({ left, right, top, bottom }, number) {
    pen.context.drawImage(sprites[kinds[number] % sprites.length], left, top, right - left, bottom - top);
  }
  function paintInBalls(view, centers, solids, planes, seen) {
    const things = [...centers.map((center, ball) => placeOfBall(view, center, ball)),
      ...solids.map((solid) => placeOfSolid(view, solid))];
    for (const number of paintingOrder(things, behindness(solids, planes, centers, seen, things))) {
      if (number >= centers.length) paintSolid(view, solids[number - centers.length], seen[number - centers.length]);
      else paintBall(things[number], number);
    }
  }
  // The balls of links without a look, and those of all others, which can be seen through, where the cover is shown.
  function ballsSeen(view, centers, cover) {
    const shown = [...centers.keys()].filter((ball) => cover || bare.has(ball));
    const places = shown.map((ball) => [ball, placeOfBall(view, centers[ball], ball)]).filter(([, place]) => place);
    return places.map(([ball, place]) => ({
      place: centers[ball], away: place.away - (bare.has(ball) ? 0 : radii[ball]),
      paint() {
        pen.context.globalAlpha = bare.has(ball) ? 1 : COVER;
        paintBall(place, ball);
        pen.context.globalAlpha = 1;
      },
    }));
  }
  function paintDressed(view, { centers, bodies, cover }, solids, planes, seen) {
    const places = solids.map((solid) => placeOfSolid(view, solid));
    const order = paintingOrder(places, behindness(solids, planes, [], seen, places));
    const small = [...ballsSeen(view, centers, cover), ...trianglesSeen(looks, bodies, view, pen)];
    layersAmong(small, solids, order, seen).forEach((layer, slot) => {
      for (const thing of layer) thing.paint();
      if (slot < order.length) paintSolid(view, solids[order[slot]], seen[order[slot]]);
    });
  }
  function paintThings(view, state) {
    const solids = [...motion.solids];
    moving.forEach(({ number }, i) => { solids[number] = placedSolid(solids[number], state.frames[i]); });
    const planes = [...motion.planes, ...partingPlanes(solids, moving.map(({ number }) => number))];
    const seen = solids.map((solid) => solid.normals.map((normal, f) => dot(normal, view.eye) > solid.offsets[f]));
    if (looks.length) paintDressed(view, state, solids, planes, seen);
    else paintInBalls(view, state.centers, solids, planes, seen);
  }
  const mark = (spot, ...style) => { if (spot) pen.dot(spot, ...style); };

  // state: centers, joints, frames (of what moves by itself), bodies (frames of the robot's), cover (whether it is
  // shown), ways of the tools, passed (points of them until now), close.
  return (view, state) => {
    paintGround(motion, pen, theme, view);
    for (const { way } of moving) pen.line(view.line(way), 1.2, theme.edge, { alpha: 0.7, dashes: [4, 3] });
    paintThings(view, state);
    for (const way of state.ways) pen.line(view.line(way), 1.5, theme.way, { alpha: 0.35 });
    for (const passed of state.passed) pen.line(view.line(passed), 2.5, theme.way);
    if (!looks.length || state.cover) {
      for (const stroke of motion.strokes)
        pen.line(view.line(stroke.map((joint) => state.joints[joint])), 1.5, theme.ink, { alpha: 0.7 });
      for (const joint of state.joints) mark(view.point(joint), 2.5, theme.ground, theme.ink);
    }
    for (const point of motion.points) mark(view.point(point), 4, theme.task, theme.ground);
    if (state.close) drawClosest(pen, theme, view.line(state.close.points), state.close.distance);
  };
}
