
// WebGL2: the surface and the shapes, lit from the viewer's side.
const painter = { gl: null, surface: null, shapes: null, buffers: {}, count: 0 };

const SURFACE_VERTEX = `#version 300 es
uniform mat4 projection;
in vec3 place; in vec3 normal; in float value;
out vec3 n; out vec3 p; out float s;
void main() { n = normal; p = place; s = value; gl_Position = projection * vec4(place, 1.0); }`;
const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 eye; uniform vec3 side; uniform vec3 scale[9]; uniform float steps; uniform bool coloured; uniform vec3 plain;
in vec3 n; in vec3 p; in float s;
out vec4 colour;
void main() {
  vec3 view = normalize(eye - p);
  vec3 normal = normalize(n) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 light = normalize(view + 0.6 * side);
  float diffuse = 0.42 + 0.58 * max(dot(normal, light), 0.0);
  float shine = 0.12 * pow(max(dot(normal, normalize(light + view)), 0.0), 30.0);
  vec3 base = plain;
  if (coloured) {
    float at = clamp(s, 0.0, 1.0) * 8.0;
    int low = min(int(at), 7);
    base = mix(scale[low], scale[low + 1], at - float(low));
    // Lines at the steps of the legend.
    float level = s * steps;
    float near = abs(fract(level + 0.5) - 0.5) / max(fwidth(level), 1e-6);
    if (s > 0.5 / steps && s < 1.001) base = mix(base, s < 0.6 ? base * 0.35 : mix(base, vec3(1.0), 0.75), 1.0 - smoothstep(0.6, 1.4, near));
  }
  colour = vec4(base * diffuse + shine, 1.0);
}`;
const SHAPE_VERTEX = `#version 300 es
uniform mat4 projection; uniform mat4 model;
in vec3 place; in vec3 normal;
out vec3 n; out vec3 p;
void main() {
  p = (model * vec4(place, 1.0)).xyz;
  vec3 widths = vec3(dot(model[0], model[0]), dot(model[1], model[1]), dot(model[2], model[2]));
  n = mat3(model) * (normal / max(widths, vec3(1e-20)));
  gl_Position = projection * vec4(p, 1.0);
}`;
const SHAPE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 eye; uniform vec4 tint; uniform float glow;
in vec3 n; in vec3 p;
out vec4 colour;
void main() {
  float diffuse = mix(0.45 + 0.55 * max(dot(normalize(n), normalize(eye - p)), 0.0), 1.0, glow);
  colour = vec4(tint.rgb * diffuse, 1.0) * tint.a;
}`;

// Begins a program of shaders; whoever asks for its result waits for it.
function begun(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return made;
}

function program(gl, made) {
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || "no shader program");
  return new Proxy({ made }, { get: (own, name) => (name === "made" ? own.made : (own[name] ??= gl.getUniformLocation(made, name))) });
}

function startPainter(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return false;
  painter.gl = gl;
  // Both are compiled at once, where the browser can.
  const made = [begun(gl, SURFACE_VERTEX, SURFACE_FRAGMENT), begun(gl, SHAPE_VERTEX, SHAPE_FRAGMENT)];
  [painter.surface, painter.shapes] = made.map((one) => program(gl, one));
  painter.array = gl.createVertexArray();
  gl.bindVertexArray(painter.array);
  for (const [name, size] of [["place", 3], ["normal", 3], ["value", 1]]) {
    painter.buffers[name] = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, painter.buffers[name]);
    const at = gl.getAttribLocation(painter.surface.made, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
  }
  painter.corners = gl.createBuffer();
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, painter.corners);
  painter.made = {};
  for (const [name, data] of Object.entries(SHAPES)) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    [["place", 0], ["normal", 12]].forEach(([attribute, offset]) => {
      const at = gl.getAttribLocation(painter.shapes.made, attribute);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 24, offset);
    });
    painter.made[name] = { array, count: data.length / 6 };
  }
  gl.enable(gl.DEPTH_TEST);
  return true;
}

// A graphics card that is reset, or a phone that needs its memory, takes all that was handed to it; it is asked for again and handed over anew.
function keepPainting(canvas) {
  canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); say("The browser has lost the picture; it comes back when the browser can draw again."); });
  canvas.addEventListener("webglcontextrestored", () => { startPainter(canvas); state.isNew.topology = true; say(""); });
}

// Hands the newest surface to the graphics card, if there is a newer one.
function uploadSurface() {
  const { gl, buffers } = painter;
  if (!state.positions || !(state.isNew.topology || state.isNew.surface || state.isNew.colour)) return;
  gl.bindVertexArray(painter.array);
  if (state.isNew.topology) {
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, state.triangles, gl.STATIC_DRAW);
    painter.count = state.triangles.length;
    painter.normals = new Float32Array(state.positions.length);
    painter.values = new Float32Array(state.positions.length / 3);
    painter.pressures = new Float32Array(state.positions.length / 3);
    painter.areas = areasOf(state.rest, state.triangles);
  }
  normalsOf(state.positions, state.triangles, painter.normals);
  depths(painter.values);
  const deepest = painter.values.reduce((best, value, node) => (value > painter.values[best] ? node : best), 0);
  state.deepest = Math.max(0, painter.values[deepest]);
  state.deepestPlace = [...state.positions.subarray(3 * deepest, 3 * deepest + 3)];
  let values = painter.values;
  if (state.colourBy === "pressure") {
    pressures(painter.pressures, painter.normals, painter.areas);
    values = painter.pressures;
  } else if (state.colourBy === "stress") {
    values = state.stress ?? painter.pressures.fill(0);
  }
  if (COLOURINGS[state.colourBy]) {
    const most = values.reduce((most, value) => Math.max(most, value), 0);
    if (most > colouring.top[state.colourBy]) colouring.top[state.colourBy] = niceTop(most);
    const top = colouring.top[state.colourBy];
    values = values.map((value) => value / top);
  }
  for (const [name, data] of [["place", state.positions], ["normal", painter.normals], ["value", values]]) {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
  }
  Object.assign(state.isNew, { topology: false, surface: false, colour: false });
}

// Colours of the page in numbers from 0 to 1.
function pageColour(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
}

function paint(canvas) {
  const { gl } = painter;
  uploadSurface();
  const matrix = projection(canvas.width / canvas.height);
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(...pageColour("--stage"), 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  if (painter.count > 0) {
    const { right, up } = axes();
    const own = painter.surface;
    gl.useProgram(own.made);
    gl.bindVertexArray(painter.array);
    gl.uniformMatrix4fv(own.projection, false, matrix);
    gl.uniform3fv(own.eye, eye());
    gl.uniform3fv(own.side, plus(up, right, -0.5));
    gl.uniform3fv(own["scale[0]"], SCALE.flat().map((c) => c / 255));
    gl.uniform1f(own.steps, STEPS);
    gl.uniform1i(own.coloured, COLOURINGS[state.colourBy] ? 1 : 0);
    gl.uniform3f(own.plain, 0.85, 0.55, 0.48);
    gl.drawElements(gl.TRIANGLES, painter.count, gl.UNSIGNED_INT, 0);
  }
  const own = painter.shapes;
  gl.useProgram(own.made);
  gl.uniformMatrix4fv(own.projection, false, matrix);
  gl.uniform3fv(own.eye, eye());
  const draw = (name, model, tint, glow = 0) => {
    gl.bindVertexArray(painter.made[name].array);
    gl.uniformMatrix4fv(own.model, false, model);
    gl.uniform4f(own.tint, ...tint, 1);
    gl.uniform1f(own.glow, glow);
    gl.drawArrays(gl.TRIANGLES, 0, painter.made[name].count);
  };
  state.tools.forEach((tool, number) => paintTool(draw, tool, state.hello?.tools[number]));
  state.touches.forEach((touch) => draw("sphere", ball(touch.place, 0.008 * state.size), [1, 1, 1], 1));
}

// Length of an arrow (m/N): a newton is a sixth of the body.
const perNewton = () => state.size / 6;

function paintTool(draw, tool, about) {
  const thin = 0.006 * state.size;
  const shape = about?.shape ?? { kind: "point" };
  const steel = [0.45, 0.5, 0.56];
  const radius = shape.radius ?? 0.016 * state.size;
  const half = shape.half_axis ? turned(tool.orientation, shape.half_axis) : null;
  if (half) {
    const ends = [minus(tool.position, half), plus(tool.position, half)];
    draw("cylinder", along(ends[0], ends[1], radius), steel);
    ends.forEach((end) => draw("sphere", ball(end, radius), steel));
  } else {
    draw("sphere", ball(tool.position, radius), steel);
  }
  if (about?.pointer) {
    // The spring between pointer and tool.
    draw("sphere", ball(tool.pointer, 0.01 * state.size), pageColour("--ink"), 1);
    if (norm(minus(tool.pointer, tool.position)) > 1e-5) draw("cylinder", along(tool.position, tool.pointer, 0.3 * thin), pageColour("--ink"), 1);
  }
  // The computed force is thin and long-headed, the commanded one thick: apart without colour.
  arrow(draw, tool.position, tool.computed, 0.55 * thin, pageColour("--two"));
  arrow(draw, tool.position, tool.commanded, thin, pageColour("--one"));
}

function arrow(draw, from, force, width, tint) {
  const length = norm(force) * perNewton();
  // Also of no number.
  if (!(length >= 2 * width)) return;
  const head = Math.min(0.5 * length, 5 * width);
  const way = unit(force);
  const neck = plus(from, way, length - head);
  draw("cylinder", along(from, neck, width), tint, 0.4);
  draw("cone", along(neck, plus(from, way, length), 2.4 * width), tint, 0.4);
}
