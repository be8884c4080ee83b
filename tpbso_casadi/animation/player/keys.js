// Keys, and the list of them. A binding: the key's name, how the list shows it and what it does, and the deed.
function bind(target, bindings) {
  const deeds = new Map(bindings.flatMap(({ keys, run }) => keys.map((key, index) => [key, () => run(index)])));
  target.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest?.("select, dialog")) return;
    if (event.target.closest?.("button") && [" ", "Enter"].includes(event.key)) return;
    const deed = deeds.get(event.shiftKey && event.key.startsWith("Arrow") ? `Shift+${event.key}` : event.key);
    if (!deed) return;
    event.preventDefault();
    deed();
  });
}

function listKeys(list, bindings) {
  for (const { shown, what } of bindings) {
    const [term, meaning] = ["dt", "dd"].map((name) => list.appendChild(document.createElement(name)));
    term.textContent = shown;
    meaning.textContent = what;
  }
}

// The keys of a player and its stage; of the whole page where the player fills it.
function bindKeys(figure, find, clock, { toggle, step, goTo, faster, slower }, ofStage) {
  const help = () => find("keys").showModal();
  const fill = () => document.fullscreenElement ? document.exitFullscreen() : figure.requestFullscreen();
  const bindings = [
    { keys: [" "], shown: "space", what: "play or pause", run: toggle },
    {
      keys: ["ArrowLeft", "ArrowRight"], shown: "\u2190 \u2192", what: "one step back, or on",
      run: (on) => step(on ? 1 : -1),
    },
    { keys: ["Home", "End"], shown: "Home, End", what: "to the start, or the end", run: (on) => goTo(on && clock.end) },
    {
      keys: ["ArrowUp", "ArrowDown"], shown: "\u2191 \u2193", what: "faster, or slower",
      run: (down) => (down ? slower : faster)(),
    },
    ...ofStage,
    ...(document.fullscreenEnabled ? [{ keys: ["f"], shown: "f", what: "full screen", run: fill }] : []),
    { keys: ["?"], shown: "?", what: "this list", run: help },
  ];
  bind(figure.classList.contains("full") ? document : figure, bindings);
  listKeys(find("list"), bindings);
  find("help").addEventListener("click", help);
  find("screen").hidden = !document.fullscreenEnabled;
  find("screen").addEventListener("click", fill);
}
