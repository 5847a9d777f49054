
// Controls beside the picture.
function showHello() {
  const { hello } = state;
  if (!hello) return;
  // `full` has no other rate.
  const rates = `${hello.haptic_hz} Hz` + (hello.global_hz > 0 ? ` over ${Number(hello.global_hz).toFixed(0)} Hz` : "");
  const role = hello.mode === "log" ? "a log" : !hello.tools.some((tool) => tool.pointer) ? "the scene moves its tools" : state.role === "hand" ? "you hold the tool" : "somebody else holds the tool, you watch";
  status([`model ${hello.model}`, rates, role, hello.body ?? ""].filter(Boolean).join(" · "));
  const device = element("device");
  device.replaceChildren(...hello.tools.map((tool, n) => new Option(tool.name ?? `tool ${n + 1}`, n)));
  device.value = state.device;
  document.querySelectorAll(".several").forEach((part) => { part.hidden = hello.tools.length < 2; });
  element("changes").hidden = !hello.can_restart;
  const may = state.role === "hand";
  ["model", "friction", "stiffness", "reset", "home"].forEach((id) => { element(id).disabled = !may || hello.mode === "log"; });
  element("reset").hidden = !hello.can_restart;
  element("home").hidden = hello.mode === "log";
  showPlayer();
  element("save-log").hidden = !hello.has_samples || hello.mode === "log";
  if (hello.can_restart) {
    element("model").replaceChildren(...hello.models.map((name) => new Option(name, name)));
    element("model").value = hello.asked_model;
    element("friction").disabled ||= hello.friction === null;
    element("friction").value = hello.friction ?? 2;
    element("stiffness").value = Math.log10(hello.stiffness);
    showChanges();
  }
}

function showChanges() {
  element("friction-value").textContent = state.hello.friction === null ? "sticks" : Number(element("friction").value).toFixed(2);
  element("stiffness-value").textContent = `× ${(10 ** element("stiffness").value).toFixed(2)}`;
}

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
  const changed = (change) => send({ do: "restart", ...change });
  element("controls").addEventListener("submit", (event) => event.preventDefault());
  element("device").addEventListener("change", (event) => { state.device = Number(event.target.value); hand.target = null; });
  element("colour").addEventListener("change", (event) => { state.colourBy = event.target.value; state.isNew.colour = true; });
  element("model").addEventListener("change", (event) => changed({ model: event.target.value }));
  element("friction").addEventListener("change", (event) => changed({ friction: Number(event.target.value) }));
  element("stiffness").addEventListener("change", (event) => changed({ stiffness: Number((10 ** event.target.value).toFixed(4)) }));
  ["friction", "stiffness"].forEach((id) => element(id).addEventListener("input", showChanges));
  element("reset").addEventListener("click", () => changed({}));
  element("home").addEventListener("click", goHome);
  element("save-png").addEventListener("click", () => composed().toBlob((blob) => save(blob, "palpate.png")));
  element("save-log").addEventListener("click", async () => {
    const answer = await fetch("/log", { headers: { Authorization: `Bearer ${location.hash.slice(1)}` } });
    if (answer.ok) save(await answer.blob(), "palpate-view.mcap"); else say(await answer.text());
  });
  document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => look(Number(button.dataset.view))));
  document.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => zoom(button.dataset.zoom === "in" ? 1 / 1.2 : 1.2)));
}
