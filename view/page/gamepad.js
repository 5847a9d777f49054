
// A gamepad: the left stick in the plane, the right one in depth; it rumbles as hard as the force is, up to 2 N, unless less motion was
// asked for.
let padTime = 0;
function readGamepad(now) {
  const seconds = Math.min(0.05, (now - padTime) / 1000);
  padTime = now;
  const pad = [...(navigator.getGamepads?.() ?? [])].find((pad) => pad?.connected);
  if (!pad || !canPush()) return;
  const [x, y, , depth] = pad.axes.map((axis) => (Math.abs(axis) < 0.15 ? 0 : axis));
  const speed = 0.6 * state.size * seconds;
  if (x || y || depth) pushBy(x * speed, -y * speed, -(depth ?? 0) * speed);
  const strength = Math.min(1, norm(state.tools[state.device]?.commanded ?? [0, 0, 0]) / 2);
  if (strength > 0.02 && !calm.matches) pad.vibrationActuator?.playEffect?.("dual-rumble", { duration: 60, strongMagnitude: strength, weakMagnitude: strength / 2 }).catch(() => {});
}
