
// Numbers beside the picture, ten times a second: faster than that nobody reads.
function readOut() {
  const tool = state.tools[state.device];
  const own = ring(state.device);
  if (!tool) return;
  const put = (id, text) => { if (element(id).textContent !== text) element(id).textContent = text; };
  put("n-computed", withUnit(norm(tool.computed), "N"));
  put("n-commanded", withUnit(norm(tool.commanded), "N"));
  put("n-parts", `${tool.commanded.map((c) => (Math.round(100 * c) / 100 + 0).toFixed(2)).join(", ")} N`);
  put("n-contact", MODES[tool.mode] ?? "–");
  put("n-depth", withUnit(state.deepest, "m"));
  element("n-stress").parentElement.hidden = state.colourBy !== "stress";
  if (state.stress) put("n-stress", withUnit(state.stress.reduce((most, value) => Math.max(most, value), 0), "Pa"));
  put("n-time", `${state.time.toFixed(2)} s`);
  const row = own.newest >= 0 ? own.row(rowPlace(own)) : null;
  const commanded = element("n-commanded");
  if (row) {
    put("n-pressure", row.pressure > 0 ? withUnit(1000 * row.pressure, "Pa") : "–");
    put("n-age", withUnit(row.age / 1000, "s"));
    const acting = (state.hello?.stages ?? []).filter((_, bit) => (row.limits >> bit) & 1);
    put("n-limits", acting.length > 0 ? acting.join(", ").replaceAll("_", " ") : "none");
    // Which tick it is, for whoever compares it with the log.
    Object.assign(commanded.dataset, { tick: row.time, x: row.cx, y: row.cy, z: row.cz });
  }
  const isLog = state.hello?.mode === "log";
  element("n-skipped").parentElement.hidden = isLog;
  if (isLog) {
    // Of the seconds that are shown: a log has no sums.
    const places = [...own.within(state.time - SPAN_S, state.time)];
    const p99 = (column) => places.map((n) => own.columns[column][n]).sort((a, b) => a - b)[Math.ceil(0.99 * places.length) - 1] * 1e-6;
    put("n-lateness", withUnit(p99("lateness"), "s"));
    put("n-execution", withUnit(p99("execution"), "s"));
  }
  const haptic = state.stats?.groups?.[0];
  if (haptic) {
    put("n-lateness", withUnit(haptic.lateness_us.p99 * 1e-6, "s"));
    put("n-execution", withUnit(haptic.execution_us.p99 * 1e-6, "s"));
    put("n-skipped", `${haptic.skipped}, ${haptic.missed} of ${haptic.released}`);
  }
}

// The newest row, or in a log the one of the time that is shown.
function rowPlace(own) {
  if (state.hello?.mode !== "log") return own.newest;
  let found = own.newest;
  for (const place of own.within(state.time - 0.05, state.time + 5e-4)) found = place;
  return found;
}
