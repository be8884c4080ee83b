// Buttons, slider and speed: what moves the clock, and what shows it.
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4], SLIDES = 1000;

// steps: of the motion; seconds: that "fit" takes for it.
// broken: from when to when any limit is; marked on the slider.
function transportOf(find, clock, { steps, seconds, broken }, changed) {
  const button = find("play"), slider = find("time"), speed = find("speed"), fit = clock.end / seconds;
  if (Math.abs(fit - 1) > 1e-6) option(speed, `fit (${Number(fit.toPrecision(2))}\u00d7)`, fit);
  SPEEDS.forEach((factor) => option(speed, `${factor}\u00d7`, factor));
  speed.value = Math.abs(fit - 1) > 1e-6 ? fit : 1;
  find("whole").textContent = `of ${clock.end.toFixed(3)} s`;

  function pace() {
    clock.speed = Number(speed.value);
    const shown = (clock.end / clock.speed).toFixed(1);
    find("pace").textContent = `real duration ${clock.end.toFixed(3)} s, shown in ${shown} s`;
    changed();
  }
  const transport = {
    toggle() { clock.toggle(); changed(); },
    goTo(time) { clock.goTo(time); changed(); },
    step(count) { transport.goTo((Math.round(clock.time / clock.end * steps) + count) * clock.end / steps); },
    faster() { transport.choose(SPEEDS.find((factor) => factor > 1.001 * clock.speed) ?? SPEEDS[SPEEDS.length - 1]); },
    slower() { transport.choose(SPEEDS.findLast((factor) => factor < 0.999 * clock.speed) ?? SPEEDS[0]); },
    choose(factor) { speed.value = factor; pace(); },
    show() {
      const now = `${clock.time.toFixed(3)} s`;
      slider.value = Math.round(SLIDES * clock.time / clock.end);
      slider.setAttribute("aria-valuetext", now);
      find("clock").setAttribute("aria-live", clock.playing ? "off" : "polite");
      find("clock").textContent = now;
      button.textContent = clock.playing ? "Pause" : "Play";
    },
  };
  slider.max = SLIDES;
  slider.style.background = markedBy(broken, clock.end);
  button.addEventListener("click", transport.toggle);
  find("back").addEventListener("click", () => transport.step(-1));
  find("next").addEventListener("click", () => transport.step(1));
  slider.addEventListener("input", () => transport.goTo(slider.value / SLIDES * clock.end));
  speed.addEventListener("change", pace);
  pace();
  return transport;
}

// A background that is red from when to when a limit is broken, no narrower than can be seen.
function markedBy(spans, end) {
  const layers = spans.map(([from, to]) => {
    const left = 100 * from / end, right = Math.max(100 * to / end, left + 0.6);
    return `linear-gradient(to right, transparent ${left}%, var(--broken) ${left}% ${right}%, transparent ${right}%)`;
  });
  return layers.join() || "none";
}
