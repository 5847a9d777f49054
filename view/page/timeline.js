
// What is drawn between two surfaces. The global model tells the surface some thirty times a second, tools come sixty times: everything is
// drawn as it was at one time, so long ago that the surface after it is there too. Nothing is guessed ahead, so nothing springs back.
const timeline = {
  surfaces: [], // time, positions, stress
  tools: [], // time, tools, touches
  offset: NaN, // of the session's time against the page's (s)
  delay: 0.04, // between the newest tools and what is drawn (s)
  shown: NaN, // the time of the surface that is drawn
  positions: null, // working memory
  stress: null,
};
const MOST_DELAY = 0.25;

function forgetTimeline() {
  Object.assign(timeline, { surfaces: [], tools: [], offset: NaN, delay: 0.04, shown: NaN, positions: null, stress: null });
}

function addSurface(surface) {
  const { surfaces, tools } = timeline;
  const last = surfaces.at(-1);
  if (last && surface.time <= last.time) surfaces.length = 0;
  surfaces.push(surface);
  while (surfaces.length > 4) surfaces.shift();
  // How long after the surface before this one came: so long has what is drawn to wait for it.
  const wait = last && tools.length > 0 ? tools.at(-1).time - last.time : 0;
  if (wait > 0) timeline.delay = Math.min(MOST_DELAY, Math.max(wait + 0.01, timeline.delay * 0.98));
}

function addTools(frame) {
  const { tools } = timeline;
  if (tools.length > 0 && frame.time < tools.at(-1).time) tools.length = 0;
  tools.push(frame);
  while (tools.length > 40) tools.shift();
  // Frames come late now and then, never early.
  const offset = frame.time - performance.now() / 1000;
  const change = offset - timeline.offset;
  if (!(Math.abs(change) < 0.3)) timeline.offset = offset; else timeline.offset += change * (change > 0 ? 0.3 : 0.02);
}

// The two of a list that lie around a time, and the share of the second.
function around(list, time) {
  const after = list.findIndex((entry) => entry.time > time);
  if (after === 0) return [list[0], list[0], 0];
  if (after < 0) return [list.at(-1), list.at(-1), 0];
  const [a, b] = [list[after - 1], list[after]];
  return [a, b, (time - a.time) / (b.time - a.time)];
}

// Puts what is to be drawn now into the state. A log is drawn as it is.
function showTime(now) {
  const { surfaces, tools } = timeline;
  const isLog = state.hello?.mode === "log";
  const time = isLog ? Infinity : now / 1000 + timeline.offset - timeline.delay;
  if (tools.length > 0) {
    const [a, b, share] = around(tools, time);
    showTools(a, b, share, tools.at(-1));
  }
  if (surfaces.length > 0) showSurface(...around(surfaces, time));
}

function showTools(a, b, share, newest) {
  const mixed = (one, other) => one.map((c, n) => c + share * (other[n] - c));
  state.time = newest.time;
  state.tools = a.tools.map((tool, n) => {
    const other = b.tools[n] ?? tool;
    // The nearer of the two quaternions that are the same turn.
    const sign = tool.orientation.reduce((sum, c, k) => sum + c * other.orientation[k], 0) < 0 ? -1 : 1;
    const turn = mixed(tool.orientation, other.orientation.map((c) => sign * c));
    const length = Math.hypot(...turn) || 1;
    return {
      position: mixed(tool.position, other.position),
      orientation: turn.map((c) => c / length),
      computed: mixed(tool.computed, other.computed),
      commanded: mixed(tool.commanded, other.commanded),
      // The hand's own: it is drawn where it is now.
      pointer: newest.tools[n]?.pointer ?? other.pointer,
      mode: other.mode,
    };
  });
  state.touches = b.touches;
}

function showSurface(a, b, share) {
  const time = a.time + share * (b.time - a.time);
  if (time === timeline.shown || a.positions.length !== state.rest.length) return;
  timeline.shown = time;
  state.isNew.surface = true;
  state.surfaces += 1;
  if (a === b) {
    [state.positions, state.stress] = [a.positions, a.stress];
    return;
  }
  if (timeline.positions?.length !== a.positions.length) timeline.positions = new Float32Array(a.positions.length);
  blend(a.positions, b.positions, share, timeline.positions);
  state.positions = timeline.positions;
  if (a.stress && b.stress) {
    if (timeline.stress?.length !== a.stress.length) timeline.stress = new Float32Array(a.stress.length);
    blend(a.stress, b.stress, share, timeline.stress);
    state.stress = timeline.stress;
  } else {
    state.stress = b.stress;
  }
}

function blend(a, b, share, out) {
  for (let n = 0; n < out.length; n += 1) out[n] = a[n] + share * (b[n] - a[n]);
}
