// A camera that orbits around a point of interest: angles in rad, lengths in m, pictures in pixels.
const FOCAL = 1.7, STEEPEST = 1.55, NEAREST = 0.02;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function axesOf(camera) {
  const ca = Math.cos(camera.azimuth), sa = Math.sin(camera.azimuth);
  const ce = Math.cos(camera.elevation), se = Math.sin(camera.elevation);
  return { right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce], toward: [ce * ca, ce * sa, se] };
}

function turn(camera, across, along) {
  camera.azimuth -= across;
  camera.elevation = within(camera.elevation + along, -STEEPEST, STEEPEST);
}

function zoom(camera, factor, home) {
  camera.distance = within(camera.distance * factor, 0.05 * home.distance, 6 * home.distance);
}

// Move the point of interest with the pointer: by so many pixels in a picture of that size.
function shift(camera, across, along, side) {
  const { right, up } = axesOf(camera), metres = camera.distance / (FOCAL * side);
  camera.center = camera.center.map((c, i) => c - (across * right[i] - along * up[i]) * metres);
}

// What the camera sees: points become [x, y] in pixels.
function viewOf(camera, width, height) {
  const { right, up, toward } = axesOf(camera), focal = FOCAL * Math.min(width, height);
  const eye = camera.center.map((c, i) => c + camera.distance * toward[i]), near = NEAREST * camera.distance;
  const local = (p) => {
    const d = [p[0] - eye[0], p[1] - eye[1], p[2] - eye[2]];
    return [dot(d, right), dot(d, up), -dot(d, toward)];
  };
  const flat = (q) => [width / 2 + q[0] * focal / q[2], height / 2 - q[1] * focal / q[2]];
  // The part of a line, or of a polygon, that is before the eye.
  function before(points, closed) {
    const kept = [], from = points.map(local);
    for (let i = 0; i < from.length; i++) {
      const q = from[i], next = i + 1 < from.length ? from[i + 1] : closed ? from[0] : null;
      if (q[2] >= near) kept.push(flat(q));
      if (next && (q[2] < near) !== (next[2] < near)) {
        const share = (near - q[2]) / (next[2] - q[2]);
        kept.push(flat(q.map((value, k) => value + share * (next[k] - value))));
      }
    }
    return kept;
  }
  return {
    eye,
    axes: { right, up, toward },
    line: (points) => before(points, false),
    polygon: (points) => before(points, true),
    away: (p) => local(p)[2],
    // x, y, pixels per metre, and metres from the eye; null for what is not before the eye.
    point(p) {
      const q = local(p);
      return q[2] < near ? null : [...flat(q), focal / q[2], q[2]];
    },
  };
}
