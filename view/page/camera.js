
// Where the picture is seen from: around a point, z up.
const TANGENT = Math.tan((35 * Math.PI) / 360);
const VIEWS = [[-1, 0.5], [0, 0], [Math.PI, 0], [Math.PI / 2, 0], [-Math.PI / 2, 0], [-Math.PI / 2, Math.PI / 2], [-Math.PI / 2, -Math.PI / 2]];
const camera = { yaw: -1.0, pitch: 0.5, distance: 0.3, narrowness: 1, target: [0, 0, 0] };

// The axes of the view: right, up and towards the viewer.
function axes() {
  const [cy, sy, cp, sp] = [Math.cos(camera.yaw), Math.sin(camera.yaw), Math.cos(camera.pitch), Math.sin(camera.pitch)];
  return { right: [-sy, cy, 0], up: [-sp * cy, -sp * sy, cp], back: [cp * cy, cp * sy, sp] };
}

const eye = () => plus(camera.target, axes().back, camera.distance);

function projection(aspect) {
  const { right, up, back } = axes();
  const at = eye();
  const view = new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, at), -dot(up, at), -dot(back, at), 1,
  ]);
  return times(perspective(TANGENT, aspect, camera.distance / 50, camera.distance * 20), view);
}

// How much farther a narrow picture is seen from, so that the body fits it as well.
const narrowness = ({ clientWidth, clientHeight }) => Math.max(1, (1.1 * clientHeight) / Math.max(1, clientWidth));

// A picture that becomes wider or narrower, as when a phone is turned, shows as much of the body as before.
function keepInPicture(picture) {
  const now = narrowness(picture);
  camera.distance *= now / camera.narrowness;
  camera.narrowness = now;
}

// The whole body with room for a tool above it, in a picture of any shape.
function look(number) {
  [camera.yaw, camera.pitch] = VIEWS[number];
  camera.distance = 1.85 * state.diagonal * camera.narrowness;
  camera.target = plus(state.centre, [0, 0, 1], 0.12 * state.size);
}

function orbit(yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, camera.pitch + pitch));
}

function zoom(factor) {
  camera.distance = Math.max(0.2 * state.size, Math.min(20 * state.size, camera.distance * factor));
}

// Metres of a pixel at a place.
const pixel = (place, height) => (2 * TANGENT * dot(minus(eye(), place), axes().back)) / height;

// Where a place is on a canvas of this size, or null behind the viewer.
function onScreen(place, width, height) {
  const { right, up, back } = axes();
  const from = minus(place, eye());
  const depth = -dot(from, back);
  if (depth <= 0) return null;
  const scale = height / (2 * TANGENT * depth);
  return [width / 2 + scale * dot(from, right), height / 2 - scale * dot(from, up)];
}

// The direction in which a pixel is seen.
function ray(x, y, width, height) {
  const { right, up, back } = axes();
  const [u, v] = [((2 * x - width) / height) * TANGENT, ((height - 2 * y) / height) * TANGENT];
  return unit(plus(plus([-back[0], -back[1], -back[2]], right, u), up, v));
}
