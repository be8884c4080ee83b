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
