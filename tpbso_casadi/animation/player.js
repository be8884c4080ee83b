"use strict";
// Each figure.player plays the motion in its JSON: played when in sight, in as many seconds as that says.
(() => {
  const REST = 0.8;
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;

  // The outline of an obstacle whose frame moves: origin x, y, and first axis u, v, at each time.
  function outlineAt(moving, frame) {
    const [x, y, u, v] = moving.frames[frame];
    return moving.outline.map(([p, q]) => [x + p * u - q * v, y + p * v + q * u]);
  }

  function start(figure) {
    const motion = JSON.parse(figure.querySelector("script").textContent);
    const canvas = figure.querySelector("canvas"), slider = figure.querySelector("input");
    const button = figure.querySelector("button"), output = figure.querySelector("output");
    const note = figure.querySelector("p"), last = motion.times.length - 1;
    let playing = !calm, seen = false, share = calm ? 1 : 0, before = null;

    function colour(name) { return getComputedStyle(figure).getPropertyValue(name); }

    function draw() {
      const size = canvas.clientWidth, scale = devicePixelRatio || 1;
      if (!size) return;
      canvas.width = canvas.height = Math.round(size * scale);
      const [left, right, bottom, top] = motion.extent;
      const unit = canvas.width / Math.max(right - left, top - bottom);
      const x = (value) => (value - (left + right) / 2) * unit + canvas.width / 2;
      const y = (value) => ((bottom + top) / 2 - value) * unit + canvas.height / 2;
      const pen = canvas.getContext("2d");
      pen.lineJoin = pen.lineCap = "round";

      function line(points, width, style) {
        pen.beginPath();
        points.forEach((point, index) => pen[index ? "lineTo" : "moveTo"](x(point[0]), y(point[1])));
        pen.lineWidth = width * scale;
        pen.strokeStyle = style;
        pen.stroke();
      }
      function dot(point, radius, fill, stroke) {
        pen.beginPath();
        pen.arc(x(point[0]), y(point[1]), radius * scale, 0, 2 * Math.PI);
        pen.fillStyle = fill;
        pen.fill();
        if (stroke) { pen.lineWidth = 1.5 * scale; pen.strokeStyle = stroke; pen.stroke(); }
      }

      const frame = Math.round(share * last), joints = motion.joints[frame];
      for (const { way } of motion.moving) line(way, 1, colour("--obstacle"));
      for (const outline of [...motion.obstacles, ...motion.moving.map((moving) => outlineAt(moving, frame))]) {
        pen.beginPath();
        outline.forEach((point, index) => pen[index ? "lineTo" : "moveTo"](x(point[0]), y(point[1])));
        pen.closePath();
        pen.fillStyle = colour("--obstacle");
        pen.fill();
      }
      motion.points.forEach((point) => dot(point, 3, colour("--task")));
      line(motion.joints.slice(0, frame + 1).map((posture) => posture[posture.length - 1]), 2, colour("--way"));
      pen.globalAlpha = 0.25;
      for (const [start, end, radius] of motion.bodies)
        line([joints[start], joints[end]], 2 * radius * unit / scale, colour("--ink"));
      pen.globalAlpha = 1;
      line(joints, 3, colour("--ink"));
      joints.forEach((joint, index) => dot(joint, index ? 4 : 6, colour(index ? "--ground" : "--ink"), colour("--ink")));
      slider.value = frame;
      output.value = motion.times[frame].toFixed(3) + " s";
      note.textContent = motion.notes.findLast(([time]) => time <= motion.times[frame])?.[1] ?? "";
      button.textContent = playing ? "Pause" : "Play";
    }

    function step(now) {
      if (playing && seen) {
        if (before !== null) share += (now - before) / 1000 / motion.seconds;
        if (share > 1 + REST / motion.seconds) share = 0;
        const drawn = share;
        share = Math.min(share, 1);
        draw();
        share = drawn;
      }
      before = now;
      if (seen) requestAnimationFrame(step); else before = null;
    }

    button.addEventListener("click", () => { playing = !playing; if (playing && share >= 1) share = 0; draw(); });
    slider.addEventListener("input", () => { playing = false; share = slider.value / last; draw(); });
    new IntersectionObserver((entries) => {
      const was = seen;
      seen = entries[entries.length - 1].isIntersecting;
      if (seen && !was) requestAnimationFrame(step);
    }).observe(figure);
    new ResizeObserver(draw).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    draw();
  }

  document.querySelectorAll("figure.player").forEach(start);
})();
