
// Controls beside the picture.
function showHello() {
  const { hello } = state;
  if (!hello) return;
  showStatus();
  const device = element("device");
  device.replaceChildren(...hello.tools.map((tool, n) => new Option(tool.name ?? `tool ${n + 1}`, n)));
  device.value = state.device;
  document.querySelectorAll(".several").forEach((part) => { part.hidden = hello.tools.length < 2; });
  element("changes").hidden = !hello.settings;
  const stress = element("colour").querySelector("[value=stress]");
  stress.disabled = stress.hidden = !hello.has_stress;
  if (!hello.has_stress && state.colourBy === "stress") colourBy("depth");
  const may = state.role === "hand";
  ["model", "friction", "static", "stribeck", "stiffness", "reset", "home"].forEach((id) => { element(id).disabled = !may || hello.mode === "log"; });
  element("reset").hidden = !hello.can_restart;
  // Its key does what it does, hidden or not.
  element("reset").disabled ||= !hello.can_restart;
  element("home").hidden = hello.mode === "log";
  showPlayer();
  element("save-log").hidden = !hello.has_samples || hello.mode === "log";
  if (hello.settings) {
    // Where another session can begin, `auto` and models that need one are there too.
    const models = hello.can_restart ? hello.models : hello.settings.models;
    element("model").replaceChildren(...models.map((name) => new Option(name, name)));
    const others = models.filter((name) => !hello.settings.models.includes(name));
    const anew = others.length > 0 ? ` ${others.join(", ")} start${others.length > 1 ? "" : "s"} the body anew.` : "";
    element("hint").textContent = `Changes come with the next resync; the body goes on.${anew}`;
    showSettings();
  }
}

function showStatus() {
  const { hello } = state;
  // `full` alone has no other rate.
  const rates = `${hello.haptic_hz} Hz` + (hello.global_hz > 0 ? ` over ${Number(hello.global_hz).toFixed(0)} Hz` : "");
  const role = hello.mode === "log" ? "a log" : !hello.tools.some((tool) => tool.pointer) ? "the scene moves its tools" : state.role === "hand" ? "you hold the tool" : "somebody else holds the tool, you watch";
  status([`model ${hello.settings?.model ?? hello.model}`, rates, role, hello.body ?? ""].filter(Boolean).join(" · "));
}

// What can be changed, as it is now; what a visitor moves just now stays.
function showSettings() {
  const settings = state.hello?.settings;
  if (!settings) return;
  const put = (id, value) => { if (document.activeElement !== element(id) || !panel.moving.has(id)) element(id).value = value; };
  showStatus();
  put("model", settings.model);
  put("friction", settings.friction ?? 2);
  put("static", settings.static_friction ?? 2);
  put("stribeck", settings.stribeck_m_s);
  const [least, most] = settings.stiffness_limits.map(Math.log10);
  Object.assign(element("stiffness"), { min: Math.max(-1, least), max: Math.min(1, most) });
  put("stiffness", Math.log10(settings.stiffness));
  element("friction").disabled ||= settings.friction === null;
  showValues();
}

const panel = { moving: new Set() };

// What is set, which may lie between the steps of a slider or beyond its end; of one that is moved just now, what it says.
function showValues() {
  const { settings } = state.hello;
  const shown = (id, value) => (panel.moving.has(id) ? sliders[id].value(Number(element(id).value)) : value);
  const put = (id, value, text) => { element(`${id}-value`).textContent = value === null ? "sticks" : text(value); };
  const coefficient = (value) => value.toFixed(2);
  put("friction", shown("friction", settings.friction), coefficient);
  put("static", shown("static", settings.static_friction), coefficient);
  put("stribeck", shown("stribeck", settings.stribeck_m_s), (value) => withUnit(value, "m/s", 2));
  const most = settings.stiffness_limits[1];
  put("stiffness", shown("stiffness", settings.stiffness), (value) => `× ${value.toFixed(2)}${value >= most && most < 10 ? ", the most its steps bear" : ""}`);
}

// What each slider sets, and the value that it means.
const same = (value) => value;
const sliders = {
  friction: { field: "friction", value: same },
  static: { field: "static_friction", value: same },
  stribeck: { field: "stribeck_m_s", value: same },
  // The limit is on no step: the last one before it stands for it.
  stiffness: { field: "stiffness", value: (place) => {
    const { step, max } = element("stiffness");
    return place > max - step ? Math.min(10, state.hello.settings.stiffness_limits[1]) : 10 ** place;
  } },
};

function colourBy(name) {
  element("colour").value = name;
  [state.colourBy, state.isNew.colour] = [name, true];
  wishStress();
}

// Stress is computed while somebody looks at it.
function wishStress() { send({ do: "stress", shown: state.colourBy === "stress" }); }

function save(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// The picture with its labels and its legend.
function composed() {
  const [picture, labels] = [element("picture"), element("labels")];
  const out = Object.assign(document.createElement("canvas"), { width: picture.width, height: picture.height });
  const context = out.getContext("2d");
  context.drawImage(picture, 0, 0);
  context.drawImage(labels, 0, 0, out.width, out.height);
  if (!element("legend").hidden) {
    const ratio = picture.width / picture.clientWidth;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const left = picture.clientWidth - 90;
    context.drawImage(element("legend-bar"), left, 30);
    context.font = "12px system-ui, sans-serif";
    context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--ink");
    context.textAlign = "right";
    context.fillText(element("legend-title").textContent, left + 80, 20);
    context.textAlign = "left";
    [...element("legend-ticks").children].forEach((tick, n) => context.fillText(tick.textContent, left + 22, 190 - (160 * n) / STEPS));
  }
  return out;
}

function startPanel() {
  element("controls").addEventListener("submit", (event) => event.preventDefault());
  element("device").addEventListener("change", (event) => { Object.assign(state, { device: Number(event.target.value), isChosen: true }); hand.target = null; });
  element("colour").addEventListener("change", (event) => colourBy(event.target.value));
  element("model").addEventListener("change", (event) => send({ do: "change", model: event.target.value }));
  for (const [id, { field, value }] of Object.entries(sliders)) {
    // While it is moved, ten times a second at most: it is felt at once.
    let last = 0;
    const tell = () => { last = performance.now(); send({ do: "change", [field]: value(Number(element(id).value)) }); };
    element(id).addEventListener("input", () => { panel.moving.add(id); showValues(); if (performance.now() - last > 100) tell(); });
    element(id).addEventListener("change", () => { panel.moving.delete(id); tell(); });
  }
  element("reset").addEventListener("click", () => send({ do: "restart" }));
  element("home").addEventListener("click", goHome);
  element("save-png").addEventListener("click", () => composed().toBlob((blob) => save(blob, "palpate.png")));
  element("save-log").addEventListener("click", async () => {
    const answer = await fetch("/log", { headers: { Authorization: `Bearer ${location.hash.slice(1)}` } });
    if (answer.ok) save(await answer.blob(), "palpate-view.mcap"); else say(await answer.text());
  });
  document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => look(Number(button.dataset.view))));
  document.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => zoom(button.dataset.zoom === "in" ? 1 / 1.2 : 1.2)));
}
