
// A log: play, pause, step, scrub, slower and faster. The server shows what is asked for.
const player = { plays: false, at: 0, asked: -1, before: 0 };
function play(now) { player.before = now; }
function startPlayer() {}
