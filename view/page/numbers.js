
// Numbers with units.
const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];

function withUnit(value, unit, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return `0 ${unit}`;
  const [scale, prefix] = PREFIXES.find(([least]) => Math.abs(value) >= 0.9995 * least) ?? PREFIXES[PREFIXES.length - 1];
  const shown = value / scale;
  const places = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(shown))));
  return `${shown.toFixed(Math.min(places, 6))} ${prefix}${unit}`;
}

// A range of round numbers around low to high, in about so many steps.
function ticks(low, high, count) {
  const raw = (high - low) / count || 1;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((n) => n * power).find((n) => n >= raw);
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n += 1) found.push(n * step);
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return found.map((value) => [value, (Math.abs(value) < step / 2 ? 0 : value).toFixed(places)]);
}

const norm = ([x, y, z]) => Math.hypot(x, y, z);
const plus = (a, b, scale = 1) => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];
const minus = (a, b) => plus(a, b, -1);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const length = norm(a) || 1; return [a[0] / length, a[1] / length, a[2] / length]; };
// v turned by the unit quaternion w, x, y, z.
const turned = ([w, ...q], v) => { const t = cross(q, v).map((c) => 2 * c); return plus(plus(v, t, w), cross(q, t)); };
