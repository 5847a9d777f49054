
// What the page knows: one object, so that every part sees the same.
const state = {
  hello: null, // what is shown, as the server told it
  role: "watch",
  rest: null, // positions at the start (m), three numbers a node
  restNormals: null,
  positions: null, // as they are drawn (m)
  stress: null, // equivalent stress of each node (Pa), while it is shown
  surfaces: 0, // different ones that were drawn so far
  triangles: null, // corners, three a triangle
  size: 0.1, // largest extent of the body (m)
  diagonal: 0.17, // of its extents (m)
  centre: [0, 0, 0],
  time: 0, // of the newest tools (s)
  tools: [], // as they are drawn: position, orientation, computed, commanded, pointer, mode
  touches: [], // place, force, triangle, device
  device: 0, // whose numbers and strips are shown, and which tool a drag moves
  isChosen: false, // by the visitor
  colourBy: "depth",
  deepest: 0, // m
  deepestPlace: null,
  stats: null,
  isNew: { topology: false, surface: false },
};
// What moves by itself moves less: strips, and what a gamepad does to the hand.
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const element = (id) => document.getElementById(id);
const MODES = ["free", "sticks", "slips", "lost: every node is held"];
