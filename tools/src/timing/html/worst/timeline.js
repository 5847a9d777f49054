"use strict";
// The timeline around a worst tick. All figures come from the page; this only places and scales them.
(() => {
  const data = JSON.parse(document.getElementById("moments").textContent);
  const byId = (id) => document.getElementById(id);
  const box = byId("timeline"), plot = byId("tl-plot"), info = byId("tl-info");
  const links = [...document.querySelectorAll("[data-moment]")];
  const causes = new Map(data.causes.map((cause) => [cause.number, cause]));
  if (!data.moments.length) return;
  document.documentElement.classList.add("scripted");
  box.hidden = false;

  const LANE = 46, BAR = [20, 18], LATE = [27, 4], FORCE = 100, FOOT = 34, SIDE = 4, LEAST_SPAN = 2000;
  let moment, from, to, lane = 0, chosen = null, width = 0;

  const escape = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const x = (t) => SIDE + (t - from) / (to - from) * (width - 2 * SIDE);
  const px = (t) => Math.max(-9, Math.min(width + 9, x(t)));
  const time = (px) => from + (px - SIDE) / (width - 2 * SIDE) * (to - from);

  function duration(ns) {
    const sign = ns < 0 ? "\u2212" : "", size = Math.abs(ns);
    const [scale, unit] = size < 1e3 ? [1, "ns"] : size < 1e6 ? [1e3, "us"] : size < 1e9 ? [1e6, "ms"] : [1e9, "s"];
    return `${sign}${+(size / scale).toPrecision(4)} ${unit}`;
  }

  function roundStep(step) {
    const power = 10 ** Math.floor(Math.log10(step));
    return [1, 2, 5, 10].map((n) => n * power).find((round) => round >= step * (1 - 1e-9));
  }

  const rect = (a, b, y, high) => `M${a.toFixed(1)} ${y}h${Math.max(0.8, b - a).toFixed(1)}v${high}H${a.toFixed(1)}z`;
  const sign = (cause, at, y, hollow) =>
    `<path class="sign cause${cause}${hollow}" transform="translate(${at.toFixed(1)} ${y})" d="${causes.get(cause).sign}"/>`;

  function drawAxis(height) {
    const step = roundStep((to - from) / Math.max(3, Math.floor(width / 120)));
    let out = "";
    for (let n = Math.ceil(from / step); n * step <= to; n++) {
      const at = x(n * step).toFixed(1);
      out += `<path class="${n === 0 ? "due" : "grid"}" d="M${at} 0V${height}"/>`;
      if (at > 24 && at < width - 24) out += `<text x="${at}" y="${height + 14}" text-anchor="middle">${duration(n * step)}</text>`;
    }
    return out + `<text x="${width / 2}" y="${height + 29}" text-anchor="middle">time from ${moment.due_s.toFixed(6)} s</text>`;
  }

  function drawLane(one, number) {
    const top = number * LANE;
    let late = "", work = "", deadlines = "", above = "";
    one.ticks.forEach(([, due, lateness, start, execution, deadline, missed, cause, skipped], place) => {
      for (const [why, a, b] of skipped) {
        if (b < from || a > to) continue;
        const [left, right] = [px(a), px(b)], wide = Math.max(0.8, right - left);
        above += `<rect class="skipped cause${why}" x="${left.toFixed(1)}" y="${top + BAR[0]}" width="${wide.toFixed(1)}" height="${BAR[1]}" fill="url(#hatch${why})"/>`;
        if (wide >= 11) above += sign(why, left + wide / 2, top + 13, "");
      }
      if (Math.max(start + execution, deadline) < from || due > to) return;
      late += rect(px(due), px(due + lateness), top + LATE[0], LATE[1]);
      const bar = rect(px(start), px(start + execution), top + BAR[0], BAR[1]);
      if (missed) {
        above += `<path class="missed cause${cause}" d="${bar}"/>` + sign(cause, Math.max(px(start), px(start + execution) - 6), top + 13, " hollow");
      } else work += bar;
      if (deadline > due && deadline >= from && deadline <= to) deadlines += `M${x(deadline).toFixed(1)} ${top + 16}v26`;
      const frame = (kind) => {
        const left = px(start) - 2;
        above += `<rect class="${kind}" x="${left.toFixed(1)}" y="${top + BAR[0] - 3}" width="${(Math.max(0.8, px(start + execution) - px(start)) + 4).toFixed(1)}" height="${BAR[1] + 6}"/>`;
      };
      if (chosen && chosen[0] === number && chosen[1] === place) frame("chosen");
      else if (moment.worst && moment.worst[0] === number && moment.worst[1] === place) frame("worst");
    });
    const mark = number === lane ? "\u25b8 " : "";
    return `<path class="deadlines" d="${deadlines}"/><path class="late" d="${late}"/><path class="work" d="${work}"/>${above}` +
      `<text class="label c0" x="${SIDE}" y="${top + 11}">${mark}${escape(one.name)}</text><path class="lane" d="M0 ${top + LANE}H${width}"/>`;
  }

  function drawForces(top) {
    const shown = moment.forces.map((one) => one.points.filter(([t]) => t >= from && t <= to));
    const values = shown.flat().flatMap(([, before, after]) => [before, after]).filter((value) => value !== null);
    const title = (text) => `<text class="label c0" x="${SIDE}" y="${top + 12}">${text}</text>`;
    if (!values.length) return title("no force here");
    let low = Math.min(...values), high = Math.max(...values);
    if (high === 0) return title("|force| is 0 N");
    low = low > 0.6 * high ? low - 0.15 * Math.max(high - low, 1e-3 * high) : 0;
    high = high > low ? high + 0.05 * (high - low) : low + 1;
    const y = (value) => (top + 18 + (FORCE - 20) * (1 - (value - low) / (high - low))).toFixed(1);
    let out = "";
    shown.forEach((points, device) => {
      [[1, `c${2 * device % 6 + 1}`], [2, `dashed c${2 * device % 6 + 2}`]].forEach(([column, kind]) => {
        const known = points.filter((point) => point[column] !== null);
        out += `<path class="line ${kind}" d="${known.map((point, n) => `${n ? "L" : "M"}${x(point[0]).toFixed(1)} ${y(point[column])}`).join("")}"/>`;
      });
    });
    return out + title(`|force| from ${+low.toPrecision(3)} to ${+high.toPrecision(3)} N`);
  }

  function draw() {
    width = Math.max(200, plot.clientWidth);
    const lanes = moment.lanes.length * LANE, height = lanes + (moment.forces.length ? FORCE + 8 : 0);
    plot.innerHTML = `<svg width="${width}" height="${height + FOOT}" viewBox="0 0 ${width} ${height + FOOT}" aria-hidden="true">` +
      drawAxis(height) + moment.lanes.map(drawLane).join("") + (moment.forces.length ? drawForces(lanes + 4) : "") + "</svg>";
    plot.dataset.from = from;
    plot.dataset.to = to;
    plot.setAttribute("aria-label", `${moment.title}: ${moment.lanes.map((one) => one.name).join(", ")}; ${duration(from)} to ${duration(to)}`);
  }

  function show(a, b) {
    const [first, last] = moment.range, whole = last - first;
    const span = Math.min(whole, Math.max(LEAST_SPAN, b - a));
    const start = Math.max(first, Math.min(last - span, (a + b - span) / 2));
    [from, to] = [start, start + span];
    draw();
  }

  const zoom = (factor, around = (from + to) / 2) => show(around - (around - from) * factor, around + (to - around) * factor);
  const move = (share) => show(from + share * (to - from), to + share * (to - from));

  function describe() {
    if (!chosen) return;
    const one = moment.lanes[chosen[0]];
    const [number, due, lateness, , execution, deadline, missed, cause, skipped, spent] = one.ticks[chosen[1]];
    const parts = [`${one.name}, release ${number}: due at ${duration(due)}, woke ${duration(lateness)} late, worked ${duration(execution)}`];
    if (spent.length) parts.push(`of it ${spent.map((ns, actor) => `${one.actors[actor]} ${duration(ns)}`).join(", ")}`);
    if (deadline > due) parts.push(`deadline at ${duration(deadline)}${missed ? ` missed: ${causes.get(cause).name}` : " met"}`);
    for (const [why, a, b] of skipped) parts.push(`skipped before it, from ${duration(a)} to ${duration(b)}: ${causes.get(why).name}`);
    info.textContent = parts.join("; ");
  }

  function choose(place) {
    chosen = place;
    lane = place[0];
    describe();
    draw();
  }

  function step(by) {
    const ticks = moment.lanes[lane].ticks;
    let next = chosen && chosen[0] === lane ? chosen[1] + by : ticks.findIndex((tick) => tick[1] >= from);
    next = Math.max(0, Math.min(ticks.length - 1, next));
    const tick = ticks[next], end = tick[3] + tick[4];
    if (tick[1] < from || end > to) {
      const half = (to - from) / 2, middle = (tick[1] + end) / 2;
      [from, to] = [middle - half, middle + half];
    }
    choose([lane, next]);
    show(from, to);
  }

  function tickAt(event) {
    const area = plot.getBoundingClientRect();
    const number = Math.floor((event.clientY - area.top) / LANE), at = time(event.clientX - area.left);
    if (number < 0 || number >= moment.lanes.length) return null;
    const close = 6 / width * (to - from);
    let best = null, least = Infinity;
    moment.lanes[number].ticks.forEach(([, due, , start, execution, , , , skipped], place) => {
      const first = skipped.length ? skipped[0][1] : due;
      const away = Math.max(0, first - at, at - (start + execution));
      if (away < least) [best, least] = [[number, place], away];
    });
    return least <= close ? best : null;
  }

  function select(number) {
    moment = data.moments[number];
    links.forEach((link, place) => place === number ? link.setAttribute("aria-current", "true") : link.removeAttribute("aria-current"));
    byId("tl-title").textContent = `${number + 1}. ${moment.title}`;
    byId("tl-words").textContent = moment.words;
    plot.dataset.shown = number;
    chosen = moment.worst;
    lane = chosen ? chosen[0] : 0;
    info.textContent = "";
    [from, to] = moment.focus;
    describe();
    show(from, to);
  }

  links.forEach((link, number) => link.addEventListener("click", (event) => {
    event.preventDefault();
    select(number);
    box.scrollIntoView({ block: "nearest" });
  }));
  byId("tl-in").onclick = () => zoom(0.5);
  byId("tl-out").onclick = () => zoom(2);
  byId("tl-left").onclick = () => move(-0.3);
  byId("tl-right").onclick = () => move(0.3);
  byId("tl-tick").onclick = () => show(...moment.focus);
  byId("tl-all").onclick = () => show(...moment.range);

  plot.addEventListener("keydown", (event) => {
    const keys = {
      "+": () => zoom(0.5), "=": () => zoom(0.5), "-": () => zoom(2), "0": () => show(...moment.range),
      ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2), n: () => step(1), p: () => step(-1),
      ArrowUp: () => { lane = Math.max(0, lane - 1); draw(); },
      ArrowDown: () => { lane = Math.min(moment.lanes.length - 1, lane + 1); draw(); },
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  // Without focus or a pinch the page scrolls on: it must not get stuck on the timeline.
  plot.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== plot) return;
    event.preventDefault();
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) return move(event.deltaX / width);
    zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) / 150), time(event.clientX - plot.getBoundingClientRect().left));
  }, { passive: false });

  const pointers = new Map();
  let dragged = false;
  plot.addEventListener("pointerdown", (event) => {
    pointers.set(event.pointerId, event.clientX);
    dragged = false;
    plot.focus({ preventScroll: true });
  });
  plot.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) {
      const place = event.pointerType === "mouse" ? tickAt(event) : null;
      if (place && (!chosen || place[0] !== chosen[0] || place[1] !== chosen[1])) choose(place);
      return;
    }
    const before = [...pointers.values()];
    const left = plot.getBoundingClientRect().left;
    pointers.set(event.pointerId, event.clientX);
    const now = [...pointers.values()];
    if (Math.abs(now[0] - before[0]) > 0 || now.length > 1) {
      if (!dragged) plot.setPointerCapture(event.pointerId);
      dragged = true;
    }
    if (now.length === 1) return move((before[0] - now[0]) / width);
    const gap = (all) => Math.max(10, Math.abs(all[0] - all[1]));
    zoom(gap(before) / gap(now), time((now[0] + now[1]) / 2 - left));
  });
  const release = (event) => {
    if (!pointers.delete(event.pointerId) || dragged || event.type !== "pointerup") return;
    const place = tickAt(event);
    if (place) choose(place);
  };
  ["pointerup", "pointercancel"].forEach((type) => plot.addEventListener(type, release));
  new ResizeObserver(() => { if (plot.clientWidth && Math.max(200, plot.clientWidth) !== width) draw(); }).observe(plot);
  select(0);
})();
