// In which order to paint balls and convex solids. Of two things that a plane parts, the one on the eye's side of it is
// never covered by the other.

// Numbers of things, balls first, then solids, each with its place in the picture: { left, right, top, bottom, away }.
function paintingOrder(things, isBehind) {
  const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  const state = new Uint8Array(things.length), order = [];
  const numbers = things.map((thing, number) => number).filter((number) => things[number]);
  numbers.sort((a, b) => things[b].away - things[a].away);
  for (const first of numbers) {
    const stack = [first];
    while (stack.length) {
      const number = stack[stack.length - 1];
      if (state[number]) {
        stack.pop();
        if (state[number] === 1) order.push(number);
        state[number] = 2;
        continue;
      }
      state[number] = 1;
      for (const other of numbers)
        if (!state[other] && overlap(things[other], things[number]) && isBehind(other, number)) stack.push(other);
    }
  }
  return order;
}

// The planes that part obstacles that move from all others: numbers of two, and a face of the first that the second
// is outside of.
function partingPlanes(solids, moving) {
  const planes = [], numbers = new Set(moving);
  for (let a = 0; a < solids.length; a++)
    for (let b = 0; b < solids.length; b++)
      if (a !== b && (numbers.has(a) || numbers.has(b))) {
        const { normals, offsets } = solids[a];
        const face = normals.findIndex((normal, f) => solids[b].vertices.every((v) => dot(normal, v) >= offsets[f]));
        if (face >= 0) planes.push([a, b, face]);
      }
  return planes;
}

// The face of a solid that a place is farthest outside of.
function faceBefore(solid, place) {
  let most = -Infinity, face = 0;
  for (let f = 0; f < solid.normals.length; f++) {
    const beyond = dot(solid.normals[f], place) - solid.offsets[f];
    if (beyond > most) { most = beyond; face = f; }
  }
  return face;
}

// Small things { place, away } in layers, farthest first: those to be painted before each solid of an order, and last
// those before all of them. seen[s][f] tells whether the eye is outside of face f of solid s.
function layersAmong(small, solids, order, seen) {
  const layers = [[], ...order.map(() => [])];
  for (const thing of small) {
    let slot = order.length;
    while (slot && !seen[order[slot - 1]][faceBefore(solids[order[slot - 1]], thing.place)]) slot--;
    layers[slot].push(thing);
  }
  for (const layer of layers) layer.sort((a, b) => b.away - a.away);
  return layers;
}

// Whether a thing is behind another: seen[s][f] tells whether the eye is outside of face f of solid s.
function behindness(solids, planes, centers, seen, things) {
  const balls = centers.length;
  const parting = new Map(planes.map(([a, b, face]) => [a * solids.length + b, face]));
  const inFront = centers.map((center) => solids.map((solid, s) => seen[s][faceBefore(solid, center)]));
  return (one, two) => {
    if (one < balls && two < balls) return things[one].away > things[two].away;
    if (one < balls) return !inFront[one][two - balls];
    if (two < balls) return inFront[two][one - balls];
    const a = one - balls, b = two - balls, there = parting.get(a * solids.length + b);
    if (there !== undefined) return seen[a][there];
    const here = parting.get(b * solids.length + a);
    return here === undefined ? things[one].away > things[two].away : !seen[b][here];
  };
}
