
// A log: play, pause, step, scrub, slower and faster. The server shows the time that is asked for.
const player = { plays: false, at: 0, asked: NaN, before: 0 };

function play(now) {
  const seconds = Math.min(0.1, (now - player.before) / 1000);
  player.before = now;
  const { hello } = state;
  if (hello?.mode !== "log") return;
  if (player.plays) {
    player.at += seconds * Number(element("speed").value);
    if (player.at >= hello.to) { player.at = hello.to; setPlaying(false); }
    element("scrub").value = player.at;
  }
  if (player.at !== player.asked && wire.socket?.readyState === WebSocket.OPEN) {
    player.asked = player.at;
    send({ do: "seek", time: player.at });
  }
  const text = `${player.at.toFixed(3)} of ${hello.to.toFixed(3)} s`;
  if (element("scrub-value").textContent !== text) element("scrub-value").textContent = text;
}

function setPlaying(plays) {
  player.plays = plays;
  element("play").textContent = plays ? "pause" : "play";
  element("play").setAttribute("aria-label", plays ? "pause" : "play");
}

function goTo(time) {
  const { from, to } = state.hello;
  player.at = Math.max(from, Math.min(to, time));
  element("scrub").value = player.at;
}

// To the next or the last picture.
function stepPicture(direction) {
  setPlaying(false);
  const { times } = state.hello;
  const near = direction > 0 ? times.find((time) => time > player.at + 1e-6) : times.findLast((time) => time < player.at - 1e-6);
  if (near !== undefined) goTo(near);
}

function showPlayer() {
  const isLog = state.hello.mode === "log";
  element("player").hidden = !isLog;
  if (!isLog) return;
  Object.assign(element("scrub"), { min: state.hello.from, max: state.hello.to });
  player.asked = NaN;
  goTo(player.at);
}

function startPlayer() {
  element("play").addEventListener("click", () => {
    if (state.hello?.mode !== "log") return;
    if (!player.plays && player.at >= state.hello.to) goTo(state.hello.from);
    setPlaying(!player.plays);
  });
  element("back").addEventListener("click", () => stepPicture(-1));
  element("step").addEventListener("click", () => stepPicture(1));
  element("scrub").addEventListener("input", (event) => { setPlaying(false); player.at = Number(event.target.value); });
}
