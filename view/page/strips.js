
// Strips of what every tick did. Lines differ by their dashes too, and are named beside the title.
const SPAN_S = 4;
const STRIPS = [
  { id: "force", unit: "N", least: 0.2, lines: [
    { column: "cx", name: "x", colour: "--one", dash: [] },
    { column: "cy", name: "y", colour: "--two", dash: [6, 3] },
    { column: "cz", name: "z", colour: "--three", dash: [2, 2] },
    { name: "computed, magnitude", colour: "--quiet", dash: [1, 3], of: (c, n) => Math.hypot(c.fx[n], c.fy[n], c.fz[n]) },
  ] },
  { id: "time", unit: "µs", least: 100, zero: true, lines: [
    { column: "execution", name: "execution", colour: "--one", dash: [] },
    { column: "lateness", name: "lateness", colour: "--two", dash: [2, 2] },
  ], level: { name: "deadline", of: (r) => r.deadline * 1e6 } },
  { id: "age", unit: "ms", least: 10, zero: true, lines: [{ column: "age", name: "age", colour: "--one", dash: [] }], marks: { name: "resync", column: "resync" } },
  { id: "energy", unit: "mJ", least: 1, lines: [
    { column: "energy", name: "given by the tool", colour: "--one", dash: [] },
    { column: "ledger", name: "passivity ledger", colour: "--two", dash: [6, 3] },
  ] },
];

// Names of the lines, each with a sample of it, as text of the page: it is read aloud too.
function nameLines() {
  for (const strip of STRIPS) {
    const names = strip.lines.map((line) => [line.name, line.dash.length === 0 ? "—" : line.dash[0] > 3 ? "– –" : line.dash[1] > 2 ? "·  ·" : "···", line.colour]);
    if (strip.level) names.push([strip.level.name, "▔", "--warn"]);
    if (strip.marks) names.push([strip.marks.name, "┆", "--quiet"]);
    element(`key-${strip.id}`).replaceChildren(...names.map(([name, sign, colour]) => {
      const part = document.createElement("span");
      const mark = Object.assign(document.createElement("b"), { textContent: sign });
      mark.style.color = `var(${colour})`;
      part.append(mark, ` ${name}`);
      return part;
    }), `${strip.unit}`);
  }
}

// What was changed while it ran, and when: marks in the strip of the force, which shows the difference.
const changes = [];
function markChange(before, now) {
  if (!before || !now) return;
  const said = [];
  if (before.model !== now.model) said.push(now.model);
  if (before.friction !== now.friction || before.static_friction !== now.static_friction) said.push(`µ ${now.friction?.toFixed(2) ?? "sticks"}`);
  if (before.stiffness !== now.stiffness) said.push(`k × ${now.stiffness.toFixed(2)}`);
  if (said.length === 0) return;
  // A slider that is moved is one change.
  const last = changes.at(-1);
  const isSame = last && said.length === 1 && last.what.slice(0, 2) === said[0].slice(0, 2) && state.time - last.time < 0.5;
  if (isSame) Object.assign(last, { time: state.time, what: said[0] }); else changes.push({ time: state.time, what: said.join(", ") });
  while (changes.length > 20) changes.shift();
}

function drawStrips() {
  const own = ring(state.device);
  const end = state.hello?.mode === "log" ? Math.max(SPAN_S, state.time) : Math.max(SPAN_S, own.newestTime());
  const places = [...own.within(end - SPAN_S, end)];
  STRIPS.forEach((strip) => drawStrip(strip, own, places, end));
}

function drawStrip(strip, own, places, end) {
  const canvas = element(`strip-${strip.id}`);
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (width === 0) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  const box = { left: 62, right: width - 10, top: 8, bottom: height - 20 };
  const value = (line, place) => (line.of ? line.of(own.columns, place) : own.columns[line.column][place]);
  let [low, high] = [strip.zero ? 0 : Infinity, strip.zero ? strip.least : -Infinity];
  for (const line of strip.lines) {
    for (const place of places) { const v = value(line, place); if (v < low) low = v; if (v > high) high = v; }
  }
  if (!(low <= high)) [low, high] = [0, strip.least];
  if (high - low < strip.least) {
    const middle = (low + high) / 2;
    [low, high] = strip.zero ? [0, strip.least] : [middle - strip.least / 2, middle + strip.least / 2];
  }
  const level = strip.level ? strip.level.of(own) : 0;
  if (level > 0) high = Math.max(high, Math.min(level * 1.05, 4 * high));
  const room = 0.06 * (high - low);
  [low, high] = [strip.zero ? 0 : low - room, high + room];
  const x = (time) => box.right - ((end - time) / SPAN_S) * (box.right - box.left);
  const y = (v) => box.bottom - ((v - low) / (high - low)) * (box.bottom - box.top);
  context.font = "11px system-ui, 'DejaVu Sans', sans-serif";
  context.textBaseline = "middle";
  context.textAlign = "right";
  context.fillStyle = colour("--quiet");
  context.strokeStyle = colour("--line");
  context.lineWidth = 1;
  context.setLineDash([]);
  const shown = ticks(low, high, 3);
  shown.forEach(([at, text], n) => {
    context.beginPath();
    context.moveTo(box.left, Math.round(y(at)) + 0.5);
    context.lineTo(box.right, Math.round(y(at)) + 0.5);
    context.stroke();
    context.fillText(n === shown.length - 1 ? `${text} ${strip.unit}` : text, box.left - 4, y(at));
  });
  context.textAlign = "center";
  context.textBaseline = "top";
  for (let s = Math.ceil(end - SPAN_S); s <= end; s += 1) {
    if (x(s) > box.left + 12 && x(s) < box.right - 12) context.fillText(`${s} s`, x(s), box.bottom + 5);
  }
  context.save();
  context.beginPath();
  context.rect(box.left, box.top - 4, box.right - box.left, box.bottom - box.top + 8);
  context.clip();
  if (strip.marks) {
    context.strokeStyle = colour("--quiet");
    context.setLineDash([2, 3]);
    context.beginPath();
    for (const place of places) {
      if (own.columns[strip.marks.column][place] !== 0) {
        const at = Math.round(x(own.times[place])) + 0.5;
        context.moveTo(at, box.top);
        context.lineTo(at, box.bottom);
      }
    }
    context.stroke();
  }
  if (level > 0) {
    context.strokeStyle = colour("--warn");
    context.setLineDash([]);
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(box.left, y(level));
    context.lineTo(box.right, y(level));
    context.stroke();
  }
  if (strip.id === "force") {
    context.setLineDash([1, 2]);
    context.lineWidth = 1;
    context.strokeStyle = context.fillStyle = colour("--ink");
    context.textAlign = "left";
    context.textBaseline = "top";
    let free = -Infinity;
    for (const change of changes.filter(({ time }) => time > end - SPAN_S && time <= end)) {
      const at = Math.round(x(change.time)) + 0.5;
      context.beginPath();
      context.moveTo(at, box.top - 4);
      context.lineTo(at, box.bottom);
      context.stroke();
      // Words that would lie on those before are left out.
      const width = context.measureText(change.what).width;
      if (at > free && at + 3 + width < box.right) { context.fillText(change.what, at + 3, box.top - 4); free = at + 8 + width; }
    }
  }
  for (const line of strip.lines) {
    context.strokeStyle = colour(line.colour);
    context.setLineDash(line.dash);
    context.lineWidth = 1.4;
    context.beginPath();
    drawLine(context, places, own.times, (place) => value(line, place), x, y);
    context.stroke();
  }
  context.restore();
  canvas.dataset.shown = JSON.stringify({ low, high, unit: strip.unit, ticks: places.length });
  canvas.dataset.labels = JSON.stringify(shown.map(([at]) => Math.round(y(at))));
}

// Least and largest of each column of pixels: no peak is lost, however many ticks there are.
function drawLine(context, places, times, value, x, y) {
  let [column, low, high, last, isFirst] = [NaN, 0, 0, 0, true];
  const flush = () => {
    if (Number.isNaN(column)) return;
    if (isFirst) context.moveTo(column, y(low)); else context.lineTo(column, y(low));
    if (high !== low) context.lineTo(column, y(high));
    context.lineTo(column, y(last));
    isFirst = false;
  };
  for (const place of places) {
    const at = Math.round(x(times[place]));
    const v = value(place);
    if (at !== column) { flush(); [column, low, high] = [at, v, v]; }
    low = Math.min(low, v);
    high = Math.max(high, v);
    last = v;
  }
  flush();
}
