// The stages of a sequence above the time line: names to jump to, and signals where they are told.
const SHORTEST = 34;  // px: a name with less room is its number alone

// stages: name, label, start and end in s, signal; jump: to a time.
function stagesOf(place, stages, clock, jump) {
  const end = clock.end;
  const lasting = stages.filter((stage) => stage.end > stage.start), told = stages.filter((stage) => stage.signal);
  const left = (time) => `${100 * time / end}%`;
  place.hidden = !stages.length;
  const parts = lasting.map((stage) => {
    const part = place.appendChild(document.createElement("button"));
    Object.assign(part, { type: "button", className: "part", title: `${stage.label}, from ${stage.start.toFixed(3)} s` });
    Object.assign(part.style, { left: left(stage.start), width: left(stage.end - stage.start) });
    part.setAttribute("aria-label", stage.label);
    part.addEventListener("click", () => jump(stage.start));
    return part;
  });
  told.forEach((stage, index) => {
    const mark = place.appendChild(document.createElement("span"));
    const next = told.slice(index + 1).find(({ start }) => start > stage.start)?.start ?? end;
    Object.assign(mark, { className: "signal", textContent: stage.signal, title: `${stage.signal}, ${stage.start.toFixed(3)} s` });
    Object.assign(mark.style, { left: left(stage.start), maxWidth: left(Math.max(next, stage.start) - stage.start) });
  });
  return {
    bindings: lasting.length ? [{
      keys: ["PageUp", "PageDown"], shown: "page \u2191 \u2193", what: "to the stage before, or the next",
      run: (on) => jump(on
        ? lasting.find(({ start }) => start > clock.time + 1e-6)?.start ?? end
        : lasting.findLast(({ start }) => start < clock.time - 1e-6)?.start ?? 0),
    }] : [],
    show() {
      lasting.forEach((stage, index) => {
        const part = parts[index], roomy = part.clientWidth >= SHORTEST;
        const text = roomy ? stage.name : stage.name.split(" ")[0];
        if (part.textContent !== text) part.textContent = text;
        part.classList.toggle("now", stage.start <= clock.time && (clock.time < stage.end || stage.end >= end));
      });
    },
  };
}
