// Numbers: what lies between two rows of data, round steps on axes, and how numbers are written.
function between(rows, place) {
  const end = rows.length - 1, row = Math.min(Math.floor(place), end), next = Math.min(row + 1, end);
  const share = place - row;
  const mixed = (a, b) => Array.isArray(a) ? a.map((value, i) => mixed(value, b[i])) : a + share * (b - a);
  return mixed(rows[row], rows[next]);
}

const within = (value, low, high) => Math.max(low, Math.min(high, value));

// 1, 2 or 5 times a power of ten: the least such number that is no less.
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= value * (1 - 1e-9));
}

// The step between about so many round numbers, the digits that tell them apart, and the numbers.
const stepOf = (span, about) => roundUp(span / Math.max(about, 1));
const digitsOf = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));

function ticksOf(low, high, step) {
  const ticks = [];
  for (let count = Math.ceil(low / step - 1e-9); count * step <= high + 1e-9 * step; count++) ticks.push(count * step);
  return ticks;
}

const written = (value, digits) => value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "\u2212");

const foundDistance = (metres) => `${(1000 * metres).toFixed(1)} mm found`;
