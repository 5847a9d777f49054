
// One scale from light to dark, so that it reads in grey too, with lines at the legend's steps.
const SCALE = [[250, 236, 217], [252, 211, 172], [251, 176, 131], [243, 138, 110], [221, 101, 106], [182, 72, 112], [138, 53, 113], [94, 38, 104], [50, 23, 78]];
const STEPS = 5;

function scaleColour(share) {
  const place = Math.max(0, Math.min(1, share)) * (SCALE.length - 1);
  const low = Math.min(Math.floor(place), SCALE.length - 2);
  return SCALE[low].map((c, n) => Math.round(c + (place - low) * (SCALE[low + 1][n] - c)));
}

// What the colour means: name, unit, and what one of the scale is in it. The scale grows with what is seen and never shrinks by itself.
const COLOUR_TOPS = { depth: 0.002, pressure: 500, stress: 500 };
const colouring = { top: { ...COLOUR_TOPS } };
const COLOURINGS = {
  depth: { title: "pushed in, along the normal at the start", unit: "m" },
  pressure: { title: "contact pressure", unit: "Pa" },
  stress: { title: "equivalent stress (von Mises)", unit: "Pa" },
};

function niceTop(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((n) => n * power).find((n) => n >= value * 0.999);
}

function showLegend() {
  const how = COLOURINGS[state.colourBy];
  element("legend").hidden = !how;
  if (!how) return;
  element("legend-title").textContent = how.title;
  const top = colouring.top[state.colourBy];
  const list = element("legend-ticks");
  const words = Array.from({ length: STEPS + 1 }, (_, n) => (n === 0 ? "0" : withUnit((n * top) / STEPS, how.unit, 2)));
  if (list.dataset.words === words.join()) return;
  list.dataset.words = words.join();
  list.replaceChildren(...words.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  const bar = element("legend-bar").getContext("2d");
  for (let y = 0; y < 160; y += 1) {
    bar.fillStyle = `rgb(${scaleColour(1 - y / 159)})`;
    bar.fillRect(0, y, 16, 1);
  }
  for (let n = 1; n < STEPS; n += 1) {
    bar.fillStyle = n / STEPS < 0.6 ? "rgba(0, 0, 0, 0.7)" : "rgba(255, 255, 255, 0.8)";
    bar.fillRect(0, Math.round(160 - (160 * n) / STEPS), 16, 1);
  }
}
