// The colours of a figure, light or dark, as its style sheet says them.
const NAMES = ["ground", "ink", "faint", "grid", "way", "task", "obstacle", "edge", "close", "body", "body-two",
  "axis-x", "axis-y", "axis-z", "broken"];
const FAINTEST = 1.5;  // contrast of a line with the ground: one that has less takes the ink's colour
const CLEAR = 3;  // on a dark ground lines are lightened to this contrast

function brightness(colour) {
  const parts = [1, 3, 5].map((place) => parseInt(colour.slice(place, place + 2), 16) / 255);
  const [r, g, b] = parts.map((part) => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function lightened(colour) {
  const parts = [1, 3, 5].map((place) => Math.ceil(0.9 * parseInt(colour.slice(place, place + 2), 16) + 25.5));
  return `#${parts.map((part) => Math.min(part, 255).toString(16).padStart(2, "0")).join("")}`;
}

function themeOf(figure, lines) {
  const style = getComputedStyle(figure);
  const theme = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  const ground = brightness(theme.ground) + 0.05;
  const seen = (colour) => Math.max(ground / (brightness(colour) + 0.05), (brightness(colour) + 0.05) / ground);
  const readable = (colour) => {
    if (seen(colour) < FAINTEST) return theme.ink;
    return ground < 0.2 && seen(colour) < CLEAR ? readable(lightened(colour)) : colour;
  };
  theme.joints = lines.map(({ colour, dashes }) => ({ colour: readable(colour), dashes }));
  return theme;
}
