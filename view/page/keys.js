
// Everything by keys too, while the picture has the focus.
const MILLIMETRE = 1e-3;
function startKeys(canvas) {
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = (event.shiftKey ? 5 : 1) * MILLIMETRE;
    const keys = {
      ArrowLeft: () => pushBy(-step, 0, 0),
      ArrowRight: () => pushBy(step, 0, 0),
      ArrowUp: () => pushBy(0, step, 0),
      ArrowDown: () => pushBy(0, -step, 0),
      PageUp: () => pushBy(0, 0, -step),
      PageDown: () => pushBy(0, 0, step),
      j: () => orbit(-0.1, 0),
      l: () => orbit(0.1, 0),
      i: () => orbit(0, 0.1),
      k: () => orbit(0, -0.1),
      "+": () => zoom(1 / 1.15),
      "=": () => zoom(1 / 1.15),
      "-": () => zoom(1.15),
      h: goHome,
      r: () => element("reset").click(),
      c: nextColouring,
      p: () => element("save-png").click(),
      " ": () => element("play").click(),
      ",": () => element("back").click(),
      ".": () => element("step").click(),
    };
    const act = /^[0-6]$/.test(event.key) ? () => look(Number(event.key)) : keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
}

function goHome() {
  const home = state.hello?.tools[state.device]?.home;
  if (home) want([...home]);
}

function nextColouring() {
  const select = element("colour");
  do select.selectedIndex = (select.selectedIndex + 1) % select.options.length; while (select.selectedOptions[0].disabled);
  select.dispatchEvent(new Event("change"));
}
