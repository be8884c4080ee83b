// What tells how large things are: a bar of a round length, and the distance of the closest two.
function drawScaleBar(pen, theme, perMetre, right, bottom, where = "") {
  const length = roundUp(Math.min(90, pen.width / 6) / perMetre), side = length * perMetre;
  const y = bottom - 12, rise = 4, left = right - 12 - side, text = `${Number(length.toPrecision(1))} m${where}`;
  const corners = [[left, y - rise], [left, y], [left + side, y], [left + side, y - rise]];
  const [width, spare] = [Math.max(side, pen.wide(text)), 5], edges = [right - 12 - width - spare, right - 12 + spare];
  pen.fill([[edges[0], y - 22], [edges[1], y - 22], [edges[1], y + spare], [edges[0], y + spare]], theme.ground, 0.75);
  pen.line(corners, 1.8, theme.ink);
  pen.write(text, [right - 12, y - 6], theme.ink, { align: "right", baseline: "bottom" });
}

// spots: of the line between the two, in the picture.
function drawClosest(pen, theme, spots, distance) {
  pen.line(spots, 2.5, theme.close);
  for (const spot of spots) pen.dot(spot, 3.5, theme.close, theme.ground);
  if (!spots.length) return;
  const [x, y] = spots[0], text = foundDistance(distance), room = x + 10 + pen.wide(text, 13) < pen.width;
  const style = { size: 12, weight: 600, rim: theme.ground, align: room ? "left" : "right" };
  pen.write(text, [room ? x + 8 : x - 8, y - 12], theme.close, style);
}
