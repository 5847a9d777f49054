
// Mouse, finger and pen: on the body or the tool they move the tool, beside it they turn the view.
const hand = { grabs: false, pointers: new Map(), pinch: 0, target: null, told: null };

const canPush = () => state.role === "hand" && state.hello?.tools[state.device]?.pointer;

// Where the pointer of the tool is wanted; it goes from there.
function wantedPlace() {
  return hand.target ?? state.tools[state.device]?.pointer ?? null;
}

function want(place) {
  if (!canPush() || !place.every(Number.isFinite)) return;
  // No farther than the server lets it, so that the way back begins at once.
  const [low, high] = state.hello.bounds;
  hand.target = place.map((c, axis) => Math.max(low[axis], Math.min(high[axis], c)));
}

// Once per picture, the newest place.
function tellPointer() {
  if (!hand.target || hand.target === hand.told || isBehind()) return;
  hand.told = hand.target;
  send({ do: "move", device: state.device, to: hand.target.map((c) => Number(c.toFixed(7))) });
}

function pushBy(right, up, away) {
  const from = wantedPlace();
  if (!from) return;
  const a = axes();
  want(plus(plus(plus(from, a.right, right), a.up, up), a.back, -away));
}

function isOnBody(x, y, canvas) {
  const tool = state.tools[state.device];
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  for (const place of tool ? [tool.position, tool.pointer] : []) {
    const at = onScreen(place, width, height);
    const radius = (state.hello.tools[state.device].shape.radius ?? 0) / pixel(place, height);
    if (at && Math.hypot(at[0] - x, at[1] - y) < Math.max(28, radius + 8)) return true;
  }
  return state.positions !== null && hit(eye(), ray(x, y, width, height)) !== null;
}

function startPointer(canvas) {
  const place = (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
  const spread = () => { const [a, b] = [...hand.pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    hand.pointers.set(event.pointerId, place(event));
    if (hand.pointers.size === 1) {
      hand.grabs = event.button === 0 && !event.shiftKey && canPush() && isOnBody(...place(event), canvas);
      hand.shifts = event.button !== 0 || event.shiftKey;
      canvas.classList.toggle("grabbing", hand.grabs);
    } else if (hand.pointers.size === 2) {
      hand.pinch = spread();
    }
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = hand.pointers.get(event.pointerId);
    if (!before) return;
    const now = place(event);
    hand.pointers.set(event.pointerId, now);
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    const height = canvas.clientHeight;
    if (hand.pointers.size > 2) return;
    if (hand.pointers.size === 2) {
      const wide = spread();
      // Fingers that part come nearer: of a grabbed tool it goes in.
      if (hand.grabs) pushBy(0, 0, (wide - hand.pinch) * pixel(wantedPlace(), height)); else if (wide > 0) zoom(hand.pinch / wide);
      hand.pinch = wide;
    } else if (hand.grabs) {
      const metres = pixel(wantedPlace(), height);
      pushBy(dx * metres, -dy * metres, 0);
    } else if (hand.shifts) {
      const { right, up } = axes();
      const metres = pixel(camera.target, height);
      camera.target = plus(plus(camera.target, right, -dx * metres), up, dy * metres);
    } else {
      orbit(-dx * 0.008, dy * 0.008);
    }
  });
  const end = (event) => {
    hand.pointers.delete(event.pointerId);
    if (hand.pointers.size === 2) hand.pinch = spread();
    if (hand.pointers.size === 0) { hand.grabs = false; canvas.classList.remove("grabbing"); }
  };
  ["pointerup", "pointercancel", "lostpointercapture"].forEach((name) => canvas.addEventListener(name, end));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const notches = event.deltaY * (event.deltaMode === 1 ? 16 : 1) / 100;
    const isDeep = !event.ctrlKey && canPush() && (hand.grabs || isOnBody(...place(event), canvas));
    if (isDeep) pushBy(0, 0, -notches * 0.01 * state.size); else zoom(1.1 ** notches);
  }, { passive: false });
}
