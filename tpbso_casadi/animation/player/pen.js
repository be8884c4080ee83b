// Lines, areas, dots and words on a canvas, in CSS pixels however dense the screen is.
const DENSEST = 3;

function penOf(canvas) {
  const context = canvas.getContext("2d");

  function trace(points) {
    context.beginPath();
    points.forEach(([x, y], index) => context[index ? "lineTo" : "moveTo"](x, y));
  }
  const pen = {
    context,
    width: 0,
    height: 0,
    // Clear the canvas, as large as its place in the page now is; false where it has no place.
    clear() {
      const scale = Math.min(devicePixelRatio || 1, DENSEST);
      pen.width = canvas.clientWidth;
      pen.height = canvas.clientHeight;
      if (!pen.width || !pen.height) return false;
      const width = Math.round(pen.width * scale), height = Math.round(pen.height * scale);
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      context.setTransform(width / pen.width, 0, 0, height / pen.height, 0, 0);
      context.clearRect(0, 0, pen.width, pen.height);
      context.lineJoin = context.lineCap = "round";
      return true;
    },
    line(points, width, colour, { alpha = 1, dashes = [] } = {}) {
      if (points.length < 2) return;
      trace(points);
      context.lineCap = dashes.length ? "butt" : "round";
      context.setLineDash(dashes.map((length) => length * width));
      Object.assign(context, { lineWidth: width, strokeStyle: colour, globalAlpha: alpha });
      context.stroke();
      context.setLineDash([]);
      context.globalAlpha = 1;
    },
    fill(corners, colour, alpha = 1) {
      trace(corners);
      context.closePath();
      Object.assign(context, { fillStyle: colour, globalAlpha: alpha });
      context.fill();
      context.globalAlpha = 1;
    },
    dot([x, y], radius, colour, edge) {
      context.beginPath();
      context.arc(x, y, radius, 0, 2 * Math.PI);
      context.fillStyle = colour;
      context.fill();
      if (edge) Object.assign(context, { lineWidth: Math.max(1, radius / 3), strokeStyle: edge }).stroke();
    },
    // Words beside a spot, with a rim where they may lie on something.
    write(text, [x, y], colour, { size = 11, align = "left", baseline = "middle", rim = null, weight = 400 } = {}) {
      Object.assign(context, { font: `${weight} ${size}px system-ui, sans-serif`, textAlign: align });
      context.textBaseline = baseline;
      if (rim) {
        Object.assign(context, { lineWidth: size / 3, strokeStyle: rim });
        context.strokeText(text, x, y);
      }
      context.fillStyle = colour;
      context.fillText(text, x, y);
    },
    wide(text, size = 11) {
      context.font = `${size}px system-ui, sans-serif`;
      return context.measureText(text).width;
    },
    // Draw only within a rectangle.
    within({ left, top, right, bottom }, draw) {
      context.save();
      context.beginPath();
      context.rect(left, top, right - left, bottom - top);
      context.clip();
      draw();
      context.restore();
    },
  };
  return pen;
}
