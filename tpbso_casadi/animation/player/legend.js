// Which line is which joint, and what the joint's value is now.
const ENTRY = '<svg width="26" height="8" aria-hidden="true"><line x2="26" y1="4" y2="4"/></svg>'
  + '<span></span><output aria-live="off"></output>';

function legendOf(list, names) {
  const entries = names.map((name) => {
    const entry = list.appendChild(document.createElement("li"));
    entry.innerHTML = ENTRY;
    entry.querySelector("span").textContent = name;
    return { line: entry.querySelector("line"), value: entry.querySelector("output") };
  });
  return {
    dress(theme) {
      theme.joints.forEach(({ colour, dashes }, joint) => {
        const strokeDasharray = dashes.map((length) => length * WIDTH).join(" ");
        Object.assign(entries[joint].line.style, { stroke: colour, strokeWidth: WIDTH, strokeDasharray });
      });
    },
    show({ limits, units }, values) {
      entries.forEach(({ value }, joint) => {
        const share = limits ? `, ${written(100 * values[joint], 0)} %` : "";
        value.textContent = `${written(values[joint] * (limits?.[joint] ?? 1), 3)} ${units[joint]}${share}`;
      });
    },
  };
}
