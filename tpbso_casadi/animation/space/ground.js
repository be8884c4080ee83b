// The ground: a grid with numbers in metres along the two sides that are nearer to the eye, and the axes at the base.
const APART = 58;  // pixels between two numbers

function paintGround(motion, pen, theme, view) {
  for (const line of motion.ground) pen.line(view.line(line), 1, theme.faint, { alpha: 0.35 });
  const taken = [];
  for (const axis of [0, 1])
    paintPlaces(motion.ground.filter(([from, to]) => from[axis] === to[axis]), axis, pen, theme, view, taken);
  motion.axes.forEach(([name, from, to]) => {
    const spot = view.point(to), colour = theme[`axis-${name}`];
    pen.line(view.line([from, to]), 2, colour);
    if (spot) pen.write(name, spot, colour, { size: 12, weight: 600, rim: theme.ground });
  });
}

// At the ends of the lines on which one coordinate stays the same, what it is there; taken: where numbers are already.
function paintPlaces(lines, axis, pen, theme, view, taken) {
  const away = (end) => lines.reduce((sum, line) => sum + view.away(line[end]), 0), end = away(0) < away(1) ? 0 : 1;
  const named = lines[Math.floor(lines.length / 2)];  // the first to be written
  for (const line of new Set([named, ...lines])) {
    const spot = line && view.point(line[end]), inner = spot && view.point(line[1 - end]);
    if (!inner) continue;
    const length = Math.hypot(spot[0] - inner[0], spot[1] - inner[1]) || 1;
    const [x, y] = [0, 1].map((k) => spot[k] + 14 * (spot[k] - inner[k]) / length);
    const number = written(line[end][axis], 2);
    if (taken.some(([a, b]) => Math.abs(a - x) < APART && Math.abs(b - y) < APART / 3)) continue;
    const text = line === named ? `${"xy"[axis]} = ${number} m` : number;
    pen.write(text, [x, y], theme.ink, { size: 10.5, align: "center", rim: theme.ground });
    taken.push([x, y]);
  }
}
