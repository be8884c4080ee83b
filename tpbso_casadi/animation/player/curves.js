// Curves of all joints over time, one plot below the other, with a cursor.
const WIDTH = 1.8, LEAST = 96;  // of a line, and of the height of a plot
const BOX = { left: 46, right: 12, top: 19, bottom: 7, last: 22 };

function rangeOf(curve) {
  const values = curve.values.flat();
  let low = Math.min(...values), high = Math.max(...values);
  if (curve.limits) { low = Math.min(low, -1); high = Math.max(high, 1); }
  const spare = 0.06 * (high - low || 1);
  return [low - spare, high + spare];
}

const boxOf = (left, top, right, bottom) => [[left, top], [right, top], [right, bottom], [left, bottom]];

function curvesOf(motion, canvas) {
  const pen = penOf(canvas), end = motion.times[motion.times.length - 1], ranges = motion.curves.map(rangeOf);
  const still = document.createElement("canvas");  // all but the cursor: thousands of points do not move
  let drawn = "";

  function placesOf(shown) {
    const height = (pen.height - (BOX.last - BOX.bottom)) / shown.length;
    return shown.map((number, index) => {
      const [low, high] = ranges[number], top = index * height + BOX.top, bottom = (index + 1) * height - BOX.bottom;
      const y = (value) => top + (high - value) / (high - low) * (bottom - top);
      return { number, low, high, top, bottom, y };
    });
  }
  const x = (time) => BOX.left + time / end * (pen.width - BOX.left - BOX.right);

  function drawAxes({ number, low, high, top, bottom, y }, theme, last) {
    const left = BOX.left, right = pen.width - BOX.right, below = { align: "center", baseline: "top" };
    const across = (value, colour, style) => pen.line([[left, y(value)], [right, y(value)]], 1, colour, style);
    const step = stepOf(high - low, (bottom - top) / 24), seconds = stepOf(end, pen.width / 80);
    for (const tick of ticksOf(low, high, step)) {
      across(tick, theme.grid);
      pen.write(written(tick, digitsOf(step)), [left - 5, y(tick)], theme.ink, { align: "right" });
    }
    for (const tick of ticksOf(0, end, seconds)) {
      pen.line([[x(tick), top], [x(tick), bottom]], 1, theme.grid);
      if (last && x(tick) < pen.width - 34)
        pen.write(tick.toFixed(digitsOf(seconds)), [x(tick), bottom + 6], theme.ink, below);
    }
    for (const { start } of motion.stages.filter((stage) => stage.end > stage.start).slice(1))
      pen.line([[x(start), top], [x(start), bottom]], 1, theme.ink, { alpha: 0.35, dashes: [1, 3] });
    for (const [from, to] of motion.broken)  // what lasts a moment is a line
      pen.fill(boxOf(x(from), top, Math.max(x(to), x(from) + 1.5), bottom), theme.broken, 0.25);
    if (last) pen.write("s", [right, bottom + 6], theme.ink, { align: "right", baseline: "top" });
    if (motion.curves[number].limits) for (const bound of [-1, 1]) across(bound, theme.ink, { dashes: [5, 4] });
    pen.write(motion.curves[number].label, [BOX.left, top - 10], theme.ink, { weight: 600 });
  }
  function drawCurve({ number, top, bottom, y }, theme) {
    const { values, bounds } = motion.curves[number];
    const box = { left: BOX.left, right: pen.width - BOX.right, top, bottom };
    pen.within(box, () => theme.joints.forEach(({ colour, dashes }, joint) => {
      for (const bound of bounds?.[joint] ?? [])
        pen.line([[box.left, y(bound)], [box.right, y(bound)]], 1, colour, { alpha: 0.6, dashes: [5, 4] });
      pen.line(motion.times.map((time, row) => [x(time), y(values[row][joint])]), WIDTH, colour, { dashes });
    }));
  }
  function drawStill(places, theme) {
    places.forEach((place, index) => {
      drawAxes(place, theme, index === places.length - 1);
      drawCurve(place, theme);
    });
    Object.assign(still, { width: canvas.width, height: canvas.height });
    still.getContext("2d").drawImage(canvas, 0, 0);
  }

  return {
    // The plots of the curves of these numbers, at a time and as many rows of data into the motion.
    draw(shown, time, row, theme) {
      const least = shown.length > 1 ? LEAST * shown.length : 0;
      const height = `${Math.max(canvas.parentElement.clientHeight, least)}px`;
      if (canvas.style.height !== height) canvas.style.height = height;
      if (!pen.clear()) return;
      const places = placesOf(shown), wanted = [canvas.width, canvas.height, shown, theme.ground].join();
      if (wanted === drawn) pen.context.drawImage(still, 0, 0, pen.width, pen.height);
      else drawStill(places, theme);
      drawn = wanted;
      for (const { number, top, bottom, y } of places) {
        pen.line([[x(time), top], [x(time), bottom]], 1.2, theme.ink);
        between(motion.curves[number].values, row).forEach((value, joint) =>
          pen.dot([x(time), y(value)], 3.5, theme.joints[joint].colour, theme.ground));
      }
    },
    timeAt(event) {
      const place = canvas.getBoundingClientRect();
      return within((event.clientX - place.left - BOX.left) / (place.width - BOX.left - BOX.right), 0, 1) * end;
    },
  };
}
