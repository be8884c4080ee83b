// What time of the motion it is, s, and how fast it passes.
const REST = 0.8;  // s for which the end is shown before it starts again

function clockOf(end, playing) {
  let beyond = 0;
  const clock = {
    end,
    playing,
    time: playing ? 0 : end,
    speed: 1,
    // Let so many seconds of the one who looks pass.
    pass(seconds) {
      if (clock.time >= end) beyond += seconds;
      else clock.time = Math.min(end, clock.time + seconds * clock.speed);
      if (beyond > REST) { clock.time = 0; beyond = 0; }
    },
    goTo(time) {
      clock.playing = false;
      clock.time = within(time, 0, end);
      beyond = 0;
    },
    toggle() {
      clock.playing = !clock.playing;
      if (clock.playing && clock.time >= end) clock.time = 0;
      beyond = 0;
    },
  };
  return clock;
}
