
// The socket: what comes is read into the state, what the visitor does is sent. The token is in the part of the address that
// browsers keep to themselves.
const LEAST_WAIT = 500;
const MOST_WAIT = 8000;
// The server says something every two seconds at least.
const MOST_QUIET = 8;
// It does not know the token: there is no use in coming again.
const REFUSED = 1008;
const wire = { socket: null, key: null, wait: LEAST_WAIT, timer: 0, quiet: 0, isRefused: false };
const TOOL = 17;
const CONTACT = 8;

function connect() {
  clearTimeout(wire.timer);
  const token = location.hash.slice(1);
  if (!token) { wire.isRefused = true; return away("This address lacks its token: open the whole address that the command printed."); }
  const socket = new WebSocket(`ws://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  Object.assign(wire, { socket, quiet: 0, isRefused: false });
  const own = (act) => (event) => { if (wire.socket === socket) act(event); };
  // With its key a page takes the place that it had, although the server may not know yet that it was gone.
  socket.onopen = own(() => { socket.send(JSON.stringify({ do: "enter", token, again: wire.key })); wishStress(); });
  socket.onmessage = own(({ data }) => { wire.quiet = 0; if (typeof data === "string") hear(JSON.parse(data)); else see(data); });
  socket.onclose = own(lost);
  return undefined;
}

// The connection is lost. What is seen stays, marked as old, and it is tried again, less and less often.
function lost({ code, reason }) {
  wire.socket = null;
  wire.isRefused = code === REFUSED;
  if (wire.isRefused) return away("The server does not know the token of this address. If it was started anew, open the address that it printed then.");
  const why = reason ? `The connection was closed: ${reason}.` : "The connection is lost.";
  away(`${why} The tool stays where it is; picture and numbers are the last ones. Trying again in ${Number((wire.wait / 1000).toFixed(1))}\u00a0s.`);
  wire.timer = setTimeout(connect, wire.wait);
  wire.wait = Math.min(MOST_WAIT, 2 * wire.wait);
  return undefined;
}

// Ends a connection on which nothing comes any more: of one that is dead no browser tells.
function watchOver() {
  if (!wire.socket) return;
  wire.quiet += 1;
  if (wire.quiet < MOST_QUIET) return;
  const { socket } = wire;
  wire.socket = null;
  socket.close();
  lost({ code: 0, reason: "" });
}

// Somebody looks again, or the network is back: nobody waits for the next try.
function comeAgain() {
  if (wire.socket || wire.isRefused || document.hidden) return;
  wire.wait = LEAST_WAIT;
  connect();
}

function startWire() {
  setInterval(watchOver, 1000);
  document.addEventListener("visibilitychange", comeAgain);
  addEventListener("online", comeAgain);
  addEventListener("pageshow", comeAgain);
  element("try").addEventListener("click", () => { wire.isRefused = false; comeAgain(); });
  // Another address in the same tab loads no other page.
  addEventListener("hashchange", () => { const { socket } = wire; Object.assign(wire, { socket: null, key: null, wait: LEAST_WAIT }); socket?.close(); connect(); });
  connect();
}

// Says over the picture why it stands still; nothing while it does not.
function away(text) {
  element("away").hidden = !text;
  document.body.classList.toggle("is-away", Boolean(text));
  if (!text) return;
  Object.assign(state, { role: "away" });
  hand.target = null;
  setPlaying(false);
  showHello();
  status("not connected");
  element("away-text").textContent = text;
}

function send(message) {
  if (wire.socket?.readyState === WebSocket.OPEN) wire.socket.send(JSON.stringify(message));
}

// True while what was sent before has not gone: of places only the newest counts.
const isBehind = () => wire.socket?.readyState !== WebSocket.OPEN || wire.socket.bufferedAmount > 1000;

function status(text) { if (element("status").textContent !== text) element("status").textContent = text; }
function say(text) { element("note").textContent = text; }

function hear(message) {
  if (message.kind === "hello") {
    state.hello = message;
    state.role = message.role;
    Object.assign(wire, { key: message.key, wait: LEAST_WAIT });
    away("");
    hand.target = null;
    // Until a visitor chooses one: the tool that can be pushed.
    state.device = state.isChosen ? Math.min(state.device, Math.max(0, message.tools.length - 1)) : Math.max(0, message.tools.findIndex((tool) => tool.pointer));
    state.stats = null;
    rings.clear();
    forgetTimeline();
    changes.length = 0;
    Object.assign(colouring.top, COLOUR_TOPS);
    say(message.warning ?? "");
    showHello();
  } else if (message.kind === "settings") {
    markChange(state.hello?.settings, message.settings);
    if (state.hello) state.hello.settings = message.settings;
    showSettings();
  } else if (message.kind === "role") {
    state.role = message.role;
    hand.target = null;
    showHello();
  } else if (message.kind === "note") {
    say(message.text);
  } else if (message.kind === "clear") {
    rings.clear();
  } else if (message.kind === "stats") {
    state.stats = message;
    if (message.ended) say("The session has ended. Reset starts another one, where that can be.");
  }
}

function see(buffer) {
  const head = new DataView(buffer);
  const u32 = (at) => head.getUint32(at, true);
  const f64 = (at) => head.getFloat64(at, true);
  const kind = u32(0);
  if (kind === 1) {
    const [nodes, triangles] = [u32(4), u32(8)];
    state.rest = new Float32Array(buffer, 16, 3 * nodes);
    state.positions = state.rest;
    state.stress = null;
    state.triangles = new Uint32Array(buffer, 16 + 12 * nodes, 3 * triangles);
    state.restNormals = normalsOf(state.rest, state.triangles);
    const isFirst = measureBody();
    if (isFirst) look(0);
    state.isNew.topology = true;
  } else if (kind === 2) {
    const tools = u32(4);
    const time = f64(8);
    const numbers = new Float32Array(buffer, 24);
    const vector = (at) => [numbers[at], numbers[at + 1], numbers[at + 2]];
    const shown = Array.from({ length: tools }, (_, n) => {
      const at = TOOL * n;
      return { position: vector(at), orientation: [...numbers.subarray(at + 3, at + 7)], computed: vector(at + 7), commanded: vector(at + 10), pointer: vector(at + 13), mode: numbers[at + 16] };
    });
    const first = TOOL * tools;
    const touches = Array.from({ length: (numbers.length - first) / CONTACT }, (_, n) => {
      const at = first + CONTACT * n;
      return { place: vector(at), force: vector(at + 3), triangle: numbers[at + 6], device: numbers[at + 7] };
    });
    addTools({ time, tools: shown, touches });
    state.isNew.colour ||= state.colourBy === "pressure";
  } else if (kind === 3) {
    ring(u32(4)).push(f64(8), f64(16), new Float32Array(buffer, 24));
  } else if (kind === 4 && state.rest && u32(4) * 3 === state.rest.length) {
    const positions = new Float32Array(buffer, 16, state.rest.length);
    const at = 16 + 4 * state.rest.length;
    const stress = buffer.byteLength > at ? new Float32Array(buffer, at, state.rest.length / 3) : null;
    addSurface({ time: f64(8), positions, stress });
  }
}

// Extents of the body; true if it is another one than before.
function measureBody() {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  state.rest.forEach((c, n) => { low[n % 3] = Math.min(low[n % 3], c); high[n % 3] = Math.max(high[n % 3], c); });
  const centre = [0, 1, 2].map((n) => (low[n] + high[n]) / 2);
  const size = Math.max(...[0, 1, 2].map((n) => high[n] - low[n])) || 0.1;
  const isOther = norm(minus(centre, state.centre)) > 0.01 * size || Math.abs(size - state.size) > 0.01 * size || painter.count === 0;
  [state.centre, state.size, state.diagonal] = [centre, size, norm(minus(high, low)) || 0.1];
  return isOther;
}
