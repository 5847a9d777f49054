
// The loop: one picture per frame of the screen, strips thirty and numbers ten times a second. For who asked for less motion, strips
// are drawn anew twice a second: they do not run.
function fit(canvas) {
  const ratio = devicePixelRatio || 1;
  const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
  if (canvas.width === width && canvas.height === height) return false;
  [canvas.width, canvas.height] = [Math.max(1, width), Math.max(1, height)];
  return true;
}

// Values at the arrows, and the axes in the corner.
function drawLabels(canvas) {
  fit(canvas);
  const ratio = devicePixelRatio || 1;
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  context.clearRect(0, 0, width, height);
  const style = getComputedStyle(document.documentElement);
  const [ink, paper] = ["--ink", "--paper"].map((name) => style.getPropertyValue(name));
  context.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  const write = (text, x, y, tint) => {
    context.lineWidth = 3;
    context.strokeStyle = paper;
    context.strokeText(text, x, y);
    context.fillStyle = tint;
    context.fillText(text, x, y);
  };
  // Where the tool and the deepest node are in the picture, and how far off the pointer is, for whoever tests the page.
  const place = (at) => (at ? onScreen(at, width, height)?.map(Math.round).join() ?? "" : "");
  Object.assign(element("picture").dataset, { tool: place(state.tools[state.device]?.position), deepest: place(state.deepestPlace), deepestMm: (1000 * state.deepest).toFixed(3), distance: norm(minus(wantedPlace() ?? [0, 0, 0], eye())).toFixed(5) });
  context.textAlign = "left";
  context.textBaseline = "middle";
  const taken = [];
  // The legend stays free.
  const legend = element("legend");
  const [legendLeft, legendEnd] = legend.hidden ? [width, 0] : [legend.offsetLeft, legend.offsetTop + legend.offsetHeight];
  state.tools.forEach((tool, number) => {
    // A label of a short arrow stands beside the tool, not on it.
    const centre = onScreen(tool.position, width, height);
    const radius = (state.hello?.tools[number]?.shape.radius ?? 0) / pixel(tool.position, height);
    for (const [force, name, tint] of [[tool.commanded, "commanded", "--one"], [tool.computed, "computed", "--two"]]) {
      const at = norm(force) > 0.02 && onScreen(plus(tool.position, force, perNewton()), width, height);
      if (!at) continue;
      // Both arrows end at the same place as a rule: the second label goes below the first.
      const right = at[1] < legendEnd + 45 ? legendLeft : width;
      const isOnTool = centre && Math.hypot(at[0] - centre[0], at[1] - centre[1]) < radius + 4;
      const left = isOnTool ? centre[0] + radius : at[0];
      const place = [Math.max(4, Math.min(left + 10, right - 132)), Math.max(12, Math.min(at[1], height - 40))];
      while (taken.some(([x, y]) => Math.abs(x - place[0]) < 130 && Math.abs(y - place[1]) < 15)) place[1] += 15;
      taken.push(place);
      write(`${name} ${withUnit(norm(force), "N")}`, ...place, style.getPropertyValue(tint));
    }
  });
  const { right, up } = axes();
  const [x, y] = [38, 38];
  ["x", "y", "z"].forEach((name, n) => {
    const [dx, dy] = [24 * right[n], -24 * up[n]];
    context.strokeStyle = ink;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
    context.stroke();
    if (Math.hypot(dx, dy) > 5) write(name, x + 1.35 * dx - 3, y + 1.35 * dy, ink);
  });
}

const clock = { strips: 0, numbers: 0, frames: 0, drawnStrips: 0 };
function frame(now) {
  const picture = element("picture");
  if (fit(picture)) keepInPicture(picture);
  readGamepad(now);
  play(now);
  tellPointer();
  showTime(now);
  paint(picture);
  drawLabels(element("labels"));
  clock.frames += 1;
  Object.assign(picture.dataset, { frames: clock.frames, surfaces: state.surfaces, strips: clock.drawnStrips });
  // When the body was first seen (ms after the page was asked for).
  if (painter.count > 0) picture.dataset.firstMs ??= Math.round(performance.now());
  if (now - clock.strips > (calm.matches ? 500 : 33)) { clock.strips = now; clock.drawnStrips += 1; drawStrips(); showLegend(); }
  if (now - clock.numbers > 100) { clock.numbers = now; readOut(); }
  requestAnimationFrame(frame);
}

nameLines();
if (startPainter(element("picture"))) {
  keepPainting(element("picture"));
  startPointer(element("picture"));
  startKeys(element("picture"));
  startPanel();
  startPlayer();
  startWire();
  requestAnimationFrame(frame);
} else {
  say("This browser has no WebGL2, without which the body cannot be drawn.");
}
