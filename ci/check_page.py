"""Opens a page of `palpate timing --html` in chromium and checks that it renders, reacts and says what `--json` says.

Usage: check_page.py PAGE.html... [--shots FOLDER] [--chromium PROGRAM]; PAGE.json beside a page is what `--json` printed.

Drives the browser through its DevTools pipe; needs nothing but Python's standard library and chromium.
"""

import argparse
import base64
import contextlib
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--remote-debugging-pipe",
]
PATIENCE_S = 30
SLICE = 1400  # height of one screenshot


class Browser:
    """Chromium, spoken to over two pipes: messages are JSON, ended by a zero byte."""

    def __init__(self, program, flags=FLAGS):
        self.profile = tempfile.mkdtemp()
        (read_commands, self.commands), (self.answers, write_answers) = os.pipe(), os.pipe()
        # The browser reads from descriptor 3 and writes to 4.
        shell = f'exec "$@" 3<&{read_commands} 4>&{write_answers}'
        command = ["bash", "-c", shell, "bash", program, *flags, f"--user-data-dir={self.profile}", "about:blank"]
        self.process = subprocess.Popen(command, pass_fds=(read_commands, write_answers), stderr=subprocess.DEVNULL)
        os.close(read_commands)
        os.close(write_answers)
        self.rest, self.number, self.events, self.session = b"", 0, [], None
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def close(self):
        with contextlib.suppress(OSError, RuntimeError):
            self.session = None
            self.send("Browser.close")
        self.process.wait(PATIENCE_S)
        shutil.rmtree(self.profile, ignore_errors=True)

    def receive(self, deadline):
        while b"\0" not in self.rest:
            if not select.select([self.answers], [], [], max(0.0, deadline - time.monotonic()))[0]:
                raise RuntimeError("the browser does not answer")
            part = os.read(self.answers, 1 << 20)
            if not part:
                raise RuntimeError("the browser has gone")
            self.rest += part
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def send(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.commands, data):]
        deadline = time.monotonic() + PATIENCE_S
        while True:
            answer = self.receive(deadline)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer)

    def wait_for(self, method):
        deadline = time.monotonic() + PATIENCE_S
        while not any(event.get("method") == method for event in self.events):
            self.events.append(self.receive(deadline))

    def open(self, url):
        self.events.clear()
        self.send("Page.navigate", url=url)
        self.wait_for("Page.loadEventFired")

    def run(self, script):
        answer = self.send("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"]["exception"].get("description", script))
        return answer["result"].get("value")


# What is asked of the page. Elements that are not shown have no box and are left out.
SCRIPT = """(() => {
  const shown = (element) => element.getClientRects().length > 0;
  const inside = (element) => element.closest(".wide") && !element.matches(".wide");
  const page = innerWidth;
  const wider = [...document.body.querySelectorAll("*")].filter((e) => shown(e) && !inside(e) && !e.closest("svg svg") &&
    e.getBoundingClientRect().right > page + 1).map((e) => `${e.tagName}.${e.getAttribute("class")} ${e.textContent.slice(0, 40)}`);
  const charts = [...document.querySelectorAll("svg[role=img]")].filter(shown);
  const small = charts.filter((e) => e.getBoundingClientRect().width < 200 || e.getBoundingClientRect().height < 80).length;
  const empty = charts.filter((e) => !e.querySelector("path.line, path.bars, path.work, path.late, path.missed")).length;
  const clashes = [];
  for (const svg of [...document.querySelectorAll("figure svg, #tl-plot svg")].filter(shown)) {
    const outer = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll("text")].map((e) => [e.textContent, e.getBoundingClientRect()]);
    texts.forEach(([text, a], n) => {
      if (a.left < outer.left - 1 || a.right > outer.right + 1) clashes.push(`"${text}" leaves ${svg.getAttribute("aria-label")}`);
      texts.slice(0, n).forEach(([other, b]) => {
        const [wide, high] = [Math.min(a.right, b.right) - Math.max(a.left, b.left), Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top)];
        if (wide > 1 && high > 4) clashes.push(`"${other}" on "${text}" in ${svg.getAttribute("aria-label")}`);
      });
    });
  }
  const nameless = [...document.querySelectorAll("button, a, [tabindex], svg[role=img]")]
    .filter((e) => shown(e) && !(e.textContent.trim() || e.getAttribute("aria-label"))).length;
  return {
    wider, small, empty, clashes, nameless, charts: charts.length, scroll: document.documentElement.scrollWidth - page,
    paper: getComputedStyle(document.body).backgroundColor,
    figures: [...document.querySelectorAll("[data-figure]")].map((e) => [e.dataset.figure, e.dataset.value, e.textContent]),
    headings: [...document.querySelectorAll("h1, h2, h3")].map((e) => +e.tagName[1]),
    timeline: !!document.getElementById("tl-plot"),
  };
})()"""


class Check:
    def __init__(self):
        self.faults = []

    def that(self, holds, what):
        if not holds:
            self.faults.append(what)


def complaints(browser, url):
    """Errors that the browser reported, and everything that it fetched besides the page."""
    found = []
    for event in browser.events:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            found.append("exception: " + json.dumps(parameters["exceptionDetails"])[:300])
        elif method in ("Runtime.consoleAPICalled", "Log.entryAdded"):
            found.append(f"console: {json.dumps(parameters)[:300]}")
        elif method == "Network.requestWillBeSent" and parameters["request"]["url"] != url:
            found.append(f"request: {parameters['request']['url'][:200]}")
    return found


def check_figures(check, shown, figures):
    for name, raw, text in shown:
        if name not in figures:
            check.that(False, f"figure {name} is not in the JSON report")
            continue
        expected = figures[name]
        value = None if raw == "null" else float(raw)
        check.that(value == expected, f"figure {name} is {raw} in the page and {expected} in the JSON report")
        check.that(text.strip() != "", f"figure {name} has no text")
    names = {name for name, _, _ in shown}
    wanted = (".lateness.", ".execution.", ".period_error.", ".jitter.", ".skipped", ".missed", ".utilisation", "lost_records")
    missing = [name for name in figures if any(part in name for part in wanted) and name not in names]
    check.that(not missing, f"figures that the page lacks: {missing[:5]}")


def check_timeline(check, browser, is_phone):
    state = lambda: browser.run("(({from, to, shown}) => ({span: to - from, from: +from, shown, info: document.getElementById('tl-info')"
                                ".textContent, svg: !!document.querySelector('#tl-plot path.work, #tl-plot path.late')}))"
                                "(document.getElementById('tl-plot').dataset)")
    click = lambda name: browser.run(f"document.getElementById('{name}').click()")
    first = state()
    check.that(first["svg"], "the timeline is empty")
    click("tl-in")
    near = state()
    check.that(near["span"] < first["span"], "the button + does not zoom")
    click("tl-right")
    check.that(state()["from"] > near["from"], "the button -> does not move")
    click("tl-all")
    whole = state()
    check.that(whole["span"] >= first["span"], "the button for all does not zoom out")

    def key(name):
        for kind in ("keyDown", "keyUp"):
            browser.send("Input.dispatchKeyEvent", type=kind, key=name, text=name if kind == "keyDown" and len(name) == 1 else "")

    browser.run("document.getElementById('tl-plot').focus()")
    key("+")
    by_key = state()
    check.that(by_key["span"] < whole["span"], "the key + does not zoom")
    key("ArrowRight")
    check.that(state()["from"] > by_key["from"], "the arrow key does not move")
    before = state()["info"]
    key("n")
    key("n")
    check.that(state()["info"] != before, "the key n does not choose the next tick")
    click("tl-all")
    x, y = browser.run("(() => { const plot = document.getElementById('tl-plot'); plot.scrollIntoView({block: 'center'}); plot.focus();"
                       "const b = plot.getBoundingClientRect(); return [b.left + b.width / 2, b.top + 60]; })()")
    if is_phone:
        touches = lambda gap: [{"x": x - gap, "y": y, "id": 0}, {"x": x + gap, "y": y, "id": 1}]
        browser.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=touches(20))
        for gap in (30, 45, 60, 80):
            browser.send("Input.dispatchTouchEvent", type="touchMove", touchPoints=touches(gap))
        browser.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        check.that(state()["span"] < 0.6 * whole["span"], "pinching does not zoom")
    else:
        browser.send("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-240)
        browser.run("new Promise(requestAnimationFrame)")
        wheeled = state()
        check.that(wheeled["span"] < whole["span"], "the wheel does not zoom")
        for kind, at in (("mousePressed", x), ("mouseMoved", x - 80), ("mouseReleased", x - 80)):
            browser.send("Input.dispatchMouseEvent", type=kind, x=at, y=y, button="left", buttons=1, clickCount=1)
        check.that(state()["from"] > wheeled["from"], "dragging does not move")
    moments = browser.run("document.querySelectorAll('[data-moment]').length")
    if moments > 1:
        browser.run("document.querySelectorAll('[data-moment]')[1].click()")
        check.that(state()["shown"] == "1" and state()["svg"], "another tick cannot be chosen")
        check.that(browser.run("document.querySelectorAll('[data-moment][aria-current]').length") == 1, "no tick is marked")


def boxes(browser, selector):
    """Elements of a page without scripts that have a box."""
    root = browser.send("DOM.getDocument")["root"]["nodeId"]
    count = 0
    for node in browser.send("DOM.querySelectorAll", nodeId=root, selector=selector)["nodeIds"]:
        with contextlib.suppress(RuntimeError):
            count += browser.send("DOM.getBoxModel", nodeId=node)["model"]["height"] > 50
    return count


def shoot(browser, folder, name):
    folder.mkdir(parents=True, exist_ok=True)
    size = browser.send("Page.getLayoutMetrics")["cssContentSize"]
    for number, top in enumerate(range(0, int(size["height"]), SLICE)):
        clip = {"x": 0, "y": top, "width": size["width"], "height": min(SLICE, size["height"] - top), "scale": 1}
        image = browser.send("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)["data"]
        (folder / f"{name}-{number:02}.png").write_bytes(base64.b64decode(image))


def check_page(browser, url, figures, shots, name):
    check, papers = Check(), {}
    timeline = charts = 0
    for width, scheme in ((1280, "light"), (1280, "dark"), (360, "light"), (360, "dark")):
        what = f"{width} px, {scheme}"
        browser.send("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=width < 500)
        browser.send("Emulation.setTouchEmulationEnabled", enabled=width < 500)
        browser.send("Emulation.setEmulatedMedia", media="screen", features=[{"name": "prefers-color-scheme", "value": scheme}])
        browser.open(url)
        found = browser.run(SCRIPT)
        if shots:
            shoot(browser, shots, f"{name}-{width}-{scheme}")
        check.that(found["scroll"] <= 0, f"{what}: the page is {found['scroll']} px too wide")
        check.that(not found["wider"], f"{what}: too wide: {found['wider'][:5]}")
        check.that(found["small"] == 0, f"{what}: {found['small']} charts have no size")
        check.that(found["empty"] == 0, f"{what}: {found['empty']} charts are empty")
        check.that(found["nameless"] == 0, f"{what}: {found['nameless']} elements have no name")
        check.that(not found["clashes"], f"{what}: {len(found['clashes'])} labels clash: {found['clashes'][:5]}")
        check.that(found["headings"][:1] == [1] and found["headings"].count(1) == 1, f"{what}: not one first heading")
        check_figures(check, found["figures"], figures)
        if found["timeline"]:
            check_timeline(check, browser, width < 500)
        check.faults += [f"{what}: {complaint}" for complaint in complaints(browser, url)]
        papers[scheme] = found["paper"]
        timeline, charts = found["timeline"], max(charts, found["charts"])
    check.that(papers["light"] != papers["dark"], "light and dark have the same background")

    browser.send("Emulation.setDeviceMetricsOverride", width=1280, height=800, deviceScaleFactor=1, mobile=False)
    browser.send("Emulation.setEmulatedMedia", media="print", features=[])
    browser.open(url)
    if timeline:
        check.that(boxes(browser, ".live") == 0, "print: the timeline's controls are shown")
        check.that(boxes(browser, ".stills svg.moment") > 0, "print: the worst moments are not shown")
    pdf = base64.b64decode(browser.send("Page.printToPDF", printBackground=False, paperWidth=8.27, paperHeight=11.69)["data"])
    check.that(pdf.startswith(b"%PDF") and len(pdf) > 10_000, "print: no document")
    if shots:
        (shots / f"{name}.pdf").write_bytes(pdf)

    browser.send("Emulation.setEmulatedMedia", media="screen", features=[])
    browser.send("Emulation.setScriptExecutionDisabled", value=True)
    browser.open(url)
    if timeline:
        check.that(boxes(browser, ".live") == 0, "without scripts: an empty timeline is shown")
        check.that(boxes(browser, ".stills svg.moment") > 0, "without scripts: the worst moments are not shown")
    browser.send("Emulation.setScriptExecutionDisabled", value=False)
    return check.faults, charts, len(found["figures"])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("pages", nargs="+", type=Path, help="pages; PAGE.json beside each is what `--json` printed")
    arguments.add_argument("--shots", type=Path, help="keep screenshots here")
    arguments.add_argument("--chromium", default=shutil.which("chromium") or "chromium")
    args = arguments.parse_args()
    browser = Browser(args.chromium)
    bad = False
    try:
        for domain in ("Page", "Runtime", "Network", "Log", "DOM"):
            browser.send(f"{domain}.enable")
        for page in args.pages:
            started = time.monotonic()
            figures = json.loads(page.with_suffix(".json").read_text())["figures"]
            faults, charts, shown = check_page(browser, page.resolve().as_uri(), figures, args.shots, page.stem)
            size = page.stat().st_size / 1e3
            bad |= bool(faults)
            print(f"{page.stem}: {'FAILED' if faults else 'good'}, {size:.0f} kB, {charts} charts, {shown} figures, "
                  f"{time.monotonic() - started:.1f} s")
            for fault in faults:
                print(f"  {fault}")
    finally:
        browser.close()
    sys.exit(bad)


if __name__ == "__main__":
    main()
