// The links as they look: triangles that are seen from their outside, each in the shade that the light gives it.
const LIGHT = [-0.37, 0.46, 0.81];  // in the axes of the view: right, up, toward the eye
const CLOSED = 0.8;  // pixels of a triangle's own colour around it, so that nothing shines through between two

function lightOf({ right, up, toward }) {
  return right.map((_, k) => LIGHT[0] * right[k] + LIGHT[1] * up[k] + LIGHT[2] * toward[k]);
}

function placedPoint(v, [origin, one, two, three]) {
  return [
    origin[0] + v[0] * one[0] + v[1] * two[0] + v[2] * three[0],
    origin[1] + v[0] * one[1] + v[1] * two[1] + v[2] * three[1],
    origin[2] + v[0] * one[2] + v[1] * two[2] + v[2] * three[2],
  ];
}

function normalOf(p, q, r) {
  const a = [q[0] - p[0], q[1] - p[1], q[2] - p[2]], b = [r[0] - p[0], r[1] - p[1], r[2] - p[2]];
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// What is seen of the looks on bodies in their frames: { place, away, paint } each.
function trianglesSeen(looks, frames, view, pen) {
  const light = lightOf(view.axes), seen = [], { context } = pen;
  for (const { body, vertices, faces, shades } of looks) {
    const places = vertices.map((v) => placedPoint(v, frames[body])), spots = places.map(view.point);
    for (const [one, two, three] of faces) {
      const [a, b, c] = [spots[one], spots[two], spots[three]];
      // Pixels count down, so that what is counter-clockwise from outside is clockwise here.
      if (!a || !b || !c || (b[0] - a[0]) * (c[1] - a[1]) >= (c[0] - a[0]) * (b[1] - a[1])) continue;
      const p = places[one], q = places[two], r = places[three], normal = normalOf(p, q, r);
      const lit = Math.max(0, dot(normal, light) / (Math.hypot(...normal) || 1));
      const colour = shades[Math.round((shades.length - 1) * Math.min(lit, 1))];
      seen.push({
        place: [(p[0] + q[0] + r[0]) / 3, (p[1] + q[1] + r[1]) / 3, (p[2] + q[2] + r[2]) / 3],
        away: (a[3] + b[3] + c[3]) / 3,
        paint() {
          context.beginPath();
          context.moveTo(a[0], a[1]);
          context.lineTo(b[0], b[1]);
          context.lineTo(c[0], c[1]);
          context.closePath();
          context.fillStyle = context.strokeStyle = colour;
          context.lineWidth = CLOSED;
          context.fill();
          context.stroke();
        },
      });
    }
  }
  return seen;
}
