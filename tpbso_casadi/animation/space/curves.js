// Curves of all joints over time, with a cursor.
function curvesOf(motion, canvas, colours) {
  const pen = canvas.getContext("2d"), end = motion.times[motion.times.length - 1];
  const box = { left: 44, right: 10, top: 8, bottom: 22 };

  function scaleOf(curve) {
    const values = curve.values.flat();
    let low = Math.min(...values), high = Math.max(...values);
    if (curve.bound) { low = Math.min(low, -1); high = Math.max(high, 1); }
    const spare = 0.06 * (high - low || 1);
    return [low - spare, high + spare];
  }
  function ticks(low, high, about) {
    const rough = (high - low) / about, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough), found = [];
    for (let tick = Math.ceil(low / step) * step; tick <= high + 1e-9 * step; tick += step) found.push(tick);
    return [found, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))];
  }

  function draw(curve, time, values) {
    const scale = Math.min(devicePixelRatio || 1, 2), width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    const [low, high] = scaleOf(curve);
    const x = (t) => box.left + t / end * (width - box.left - box.right);
    const y = (value) => box.top + (high - value) / (high - low) * (height - box.top - box.bottom);
    function line(points, style, thickness, dashes = []) {
      pen.beginPath();
      points.forEach(([a, b], index) => pen[index ? "lineTo" : "moveTo"](a, b));
      pen.setLineDash(dashes);
      pen.strokeStyle = style;
      pen.lineWidth = thickness;
      pen.stroke();
      pen.setLineDash([]);
    }
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = colours.ink;
    const [rows, digits] = ticks(low, high, height / 34), [columns, places] = ticks(0, end, width / 70);
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const tick of rows) {
      line([[box.left, y(tick)], [width - box.right, y(tick)]], colours.grid, 1);
      pen.fillText(tick.toFixed(digits).replace("-", "\u2212"), box.left - 5, y(tick));
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const tick of columns) {
      line([[x(tick), box.top], [x(tick), height - box.bottom]], colours.grid, 1);
      if (x(tick) < width - 20) pen.fillText(tick.toFixed(places), x(tick), height - box.bottom + 5);
    }
    pen.textAlign = "right";
    pen.fillText("s", width - box.right, height - box.bottom + 5);
    if (curve.bound) for (const bound of [-1, 1])
      line([[box.left, y(bound)], [width - box.right, y(bound)]], colours.ink, 1, [5, 4]);
    const colourOf = (joint) => colours.joints[joint % colours.joints.length];
    values.forEach((_, joint) =>
      line(motion.times.map((t, row) => [x(t), y(curve.values[row][joint])]), colourOf(joint), 1.6));
    line([[x(time), box.top], [x(time), height - box.bottom]], colours.ink, 1);
    values.forEach((value, joint) => {
      pen.beginPath();
      pen.arc(x(time), y(value), 3.5, 0, 2 * Math.PI);
      pen.fillStyle = colourOf(joint);
      pen.fill();
    });
  }
  const timeAt = (event) => {
    const place = canvas.getBoundingClientRect();
    const share = (event.clientX - place.left - box.left) / (place.width - box.left - box.right);
    return Math.max(0, Math.min(1, share)) * end;
  };
  return { draw, timeAt };
}
