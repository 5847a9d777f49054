"""Opens the page of `palpate view` in chromium, pushes the body, and compares what is shown with the log of that run.

Usage: check_view.py PALPATE FOLDER [--shots FOLDER] [--chromium PROGRAM]; writes logs to FOLDER

Drives the browser as check_page.py does. The picture is drawn by Chromium's own software renderer.
"""

import argparse
import base64
import contextlib
import csv
import io
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from check_page import FLAGS, Browser, Check, complaints

WEBGL = [flag for flag in FLAGS if flag != "--disable-gpu"] + ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_S = 60

# What does not fit, meets something else or has no name. A strip is a canvas: its labels say where they are.
LAYOUT = """(() => {
  const faults = [];
  const shown = (element) => element.getClientRects().length > 0;
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > width) faults.push(`the page is ${document.documentElement.scrollWidth - width} px too wide`);
  for (const element of document.querySelectorAll("body *"))
    if (shown(element) && element.getBoundingClientRect().right > width + 1) faults.push(`too wide: ${element.tagName} ${element.id}`);
  for (const element of document.querySelectorAll("button, input, select, canvas[role], summary"))
    if (shown(element) && !(element.textContent.trim() || element.getAttribute("aria-label") || element.labels?.length)) faults.push(`no name: ${element.tagName} ${element.id}`);
  const parts = [...document.querySelectorAll("#stage, #strips figure, #side, header")].filter(shown).map((element) => [element.id || element.textContent.trim().slice(0, 20), element.getBoundingClientRect()]);
  parts.forEach(([name, a], n) => parts.slice(n + 1).forEach(([other, b]) => {
    if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1) faults.push(`${name} lies on ${other}`);
  }));
  for (const canvas of document.querySelectorAll("#strips canvas")) {
    const { shown, labels } = canvas.dataset;
    if (!shown || !labels) { faults.push(`${canvas.id} is empty`); continue; }
    const at = JSON.parse(labels);
    if (at.some((y, n) => n > 0 && Math.abs(y - at[n - 1]) < 11)) faults.push(`${canvas.id}: labels meet: ${at}`);
    if (JSON.parse(shown).ticks < 100) faults.push(`${canvas.id} has ${JSON.parse(shown).ticks} ticks`);
    const caption = canvas.parentElement.querySelector("figcaption").textContent;
    if (!caption.trim().endsWith(JSON.parse(shown).unit)) faults.push(`${canvas.id} names no unit: ${caption}`);
    const box = canvas.getBoundingClientRect();
    if (box.width < 200 || box.height < 80) faults.push(`${canvas.id} is ${box.width} x ${box.height}`);
  }
  return faults;
})()"""
STATE = """(() => {
  const text = (id) => document.getElementById(id).textContent;
  const { tick, x, y, z } = document.getElementById("n-commanded").dataset;
  const { tool, deepest, deepestMm, frames, firstMs, distance } = document.getElementById("picture").dataset;
  const place = (text) => (text ? text.split(",").map(Number) : null);
  const box = document.getElementById("picture").getBoundingClientRect();
  return { status: text("status"), note: text("note"), time: parseFloat(text("n-time")), contact: text("n-contact"), commanded: text("n-commanded"),
    tick: tick === undefined ? null : [tick, x, y, z].map(Number), tool: place(tool), deepest: place(deepest), deepest_mm: +deepestMm, frames: +frames, first: firstMs ?? null, distance: +distance, left: box.left, top: box.top,
    scrub: document.getElementById("scrub").value, model: document.getElementById("model").value };
})()"""


class View:
    """`palpate view` and the address that it prints."""

    def __init__(self, palpate, *arguments):
        begin = time.monotonic()
        self.process = subprocess.Popen([palpate, "view", "--no-browser", *arguments], stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().split()[-1]
        self.ready_s = time.monotonic() - begin

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        report = self.process.communicate(timeout=PATIENCE_S)[0]
        if self.process.returncode != 0:
            raise RuntimeError(f"palpate view ended with {self.process.returncode}: {report}")


def wait(browser, holds, what):
    """The first state of the page that `holds`."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        state = browser.run(STATE)
        if holds(state):
            return state
        if time.monotonic() > deadline:
            raise RuntimeError(f"{what} did not happen: {state}")
        time.sleep(0.05)


def mouse(browser, kind, x, y):
    pressed = kind != "mouseReleased"
    browser.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(pressed), clickCount=1)


def key(browser, name):
    for kind in ("keyDown", "keyUp"):
        browser.send("Input.dispatchKeyEvent", type=kind, key=name)


def shoot(browser, folder, name):
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
        image = browser.send("Page.captureScreenshot", captureBeyondViewport=True)["data"]
        (folder / f"{name}.png").write_bytes(base64.b64decode(image))


def size(browser, width, scheme):
    browser.send("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=width < 500)
    browser.send("Emulation.setTouchEmulationEnabled", enabled=width < 500)
    browser.send("Emulation.setEmulatedMedia", media="screen", features=[{"name": "prefers-color-scheme", "value": scheme}])
    time.sleep(1.0)


def layouts(check, browser, shots, name):
    for width, scheme in ((1280, "light"), (1280, "dark"), (390, "light"), (390, "dark")):
        size(browser, width, scheme)
        shoot(browser, shots, f"{name}-{width}-{scheme}")
        for fault in browser.run(LAYOUT):
            check.that(False, f"{name}, {width} px, {scheme}: {fault}")
    size(browser, 1280, "light")


def push(check, browser):
    """Drags the tool down into the body, seen from the side: the surface gives way under it."""
    browser.run("document.getElementById('picture').focus()")
    key(browser, "4")
    first = wait(browser, lambda state: state["tool"] and state["frames"] > 5 and state["tick"], "the first picture")
    check.that("you hold the tool" in first["status"], f"the first visitor does not hold the tool: {first['status']}")
    time.sleep(0.5)
    first = browser.run(STATE)
    x, y = first["left"] + first["tool"][0], first["top"] + first["tool"][1]
    mouse(browser, "mousePressed", x, y)
    # Down until the tool is as deep as it should be, wherever the body begins.
    for step in range(1, 120):
        mouse(browser, "mouseMoved", x, y + 2 * step)
        time.sleep(0.05)
        if browser.run(STATE)["deepest_mm"] > 4:
            break
    mouse(browser, "mouseReleased", x, y + 2 * step)
    pushed = wait(browser, lambda state: state["deepest_mm"] > 3 and state["tick"] and abs(state["tick"][3]) > 0.3, "a force")
    check.that(pushed["contact"] in ("sticks", "slips"), f"there is a force, and the contact is {pushed['contact']}")
    check.that(pushed["tick"][3] > 0, f"the force pushes the tool down: {pushed['tick']}")
    gap = max(abs(a - b) for a, b in zip(pushed["tool"], pushed["deepest"]))
    check.that(gap < 60, f"the tool is at {pushed['tool']} and the deepest node at {pushed['deepest']}")
    check.that(pushed["tool"][1] > first["tool"][1] + 5, "the tool did not go down")
    return pushed


def touch(check, browser):
    """A finger lifts the tool, two fingers move it in depth; keys bring it home."""
    size(browser, 390, "light")
    first = browser.run(STATE)
    x, y = first["left"] + first["tool"][0], first["top"] + first["tool"][1]
    point = lambda x, y, number=0: {"x": x, "y": y, "id": number}
    send = lambda kind, *points: browser.send("Input.dispatchTouchEvent", type=kind, touchPoints=list(points))
    send("touchStart", point(x, y))
    for step in range(1, 9):
        send("touchMove", point(x, y - 8 * step))
        time.sleep(0.05)
    lifted = wait(browser, lambda state: state["tool"][1] < first["tool"][1] - 40, "lifting by a finger")
    check.that(lifted["deepest_mm"] < first["deepest_mm"], "the body is as deep when the tool has gone")
    before = browser.run(STATE)["distance"]
    send("touchStart", point(x, y - 64), point(x + 40, y - 64, 1))
    for step in range(1, 6):
        send("touchMove", point(x, y - 64), point(x + 40 + 10 * step, y - 64, 1))
        time.sleep(0.05)
    send("touchEnd")
    check.that(wait(browser, lambda state: state["distance"] != before, "a pinch")["distance"] > before, "fingers that part do not push the tool away")
    browser.run("document.getElementById('picture').focus()")
    for name, nearer in (("PageUp", True), ("PageDown", False)):
        before = browser.run(STATE)["distance"]
        key(browser, name)
        after = wait(browser, lambda state: state["distance"] != before, name)["distance"]
        check.that((after < before) == nearer, f"{name} moves the tool from {before} m to {after} m from the viewer")
    key(browser, "h")
    wait(browser, lambda state: state["contact"] == "free" and state["deepest_mm"] < 0.5, "the way home")
    size(browser, 1280, "light")


def commanded(palpate, log):
    """`/force_commanded` of a log by its time in microseconds (N)."""
    table = subprocess.run([palpate, "export", log, "--topic", "/force_commanded", "--format", "csv"], capture_output=True, text=True, check=True).stdout
    rows = csv.DictReader(io.StringIO(table))
    return {round(1e6 * float(row["t_s"])): [float(row[f"f{axis}_n"]) for axis in "xyz"] for row in rows}


def check_forces(check, seen, forces, what):
    for tick, *shown in seen:
        expected = forces.get(round(1e6 * tick))
        # The page has them in single precision.
        same = expected and all(abs(a - b) <= 1e-6 * max(1.0, abs(a)) for a, b in zip(expected, shown))
        check.that(same, f"{what}: the force at {tick} s is {shown} in the page and {expected} in the log")
    check.that(len(seen) > 3 and any(abs(force[2]) > 0.3 for _, *force in seen), f"{what}: too little was compared: {seen}")


def start(browser, view):
    size(browser, 1280, "light")
    browser.open(view.url)


def check_live(check, browser, palpate, log, shots):
    view = View(palpate, "--model", "patch", "--out", str(log))
    try:
        start(browser, view)
        wait(browser, lambda state: state["first"], "the first picture")
        first_s = float(browser.run(STATE)["first"]) / 1000
        print(f"the first picture: {view.ready_s:.2f} s to the address, {first_s:.2f} s from there to the body in the page")
        push(check, browser)
        seen = []
        for _ in range(8):
            seen.append(browser.run(STATE)["tick"])
            time.sleep(0.2)
        key(browser, "0")
        layouts(check, browser, shots, "live")
        browser.run("(() => { const c = document.getElementById('colour'); c.value = 'pressure'; c.dispatchEvent(new Event('change')); })()")
        time.sleep(0.6)
        shoot(browser, shots, "pressure-1280-light")
        touch(check, browser)
        # Another session takes the place of this one.
        browser.run("(() => { const m = document.getElementById('model'); m.value = 'hold'; m.dispatchEvent(new Event('change')); })()")
        wait(browser, lambda state: "model hold" in state["status"], "another model")
        found = complaints(browser, view.url.split("#")[0])
    finally:
        view.stop()
    check_forces(check, seen, commanded(palpate, log), "live")
    # What a closed server costs is no fault of the page.
    check.faults += [f"live: {complaint}" for complaint in found]


def check_log(check, browser, palpate, log, shots):
    forces = commanded(palpate, log)
    view = View(palpate, str(log))
    try:
        start(browser, view)
        wait(browser, lambda state: "a log" in state["status"] and state["frames"] > 3, "the log")
        last = max(forces) / 1e6
        seen = []
        for share in (0.9, 0.5, 0.7, 0.95, 0.8):
            at = round(share * last, 3)
            browser.run(f"(() => {{ const s = document.getElementById('scrub'); s.value = {at}; s.dispatchEvent(new Event('input')); }})()")
            state = wait(browser, lambda state: state["tick"] and abs(state["tick"][0] - at) < 0.0011, f"the time {at}")
            check.that(abs(state["time"] - at) < 0.011, f"at {at} s the page says {state['time']}")
            seen.append(state["tick"])
        check_forces(check, seen, forces, "log")
        before = float(browser.run(STATE)["scrub"])
        browser.run("document.getElementById('back').click()")
        stepped = wait(browser, lambda state: float(state["scrub"]) < before, "a step back")
        check.that(before - float(stepped["scrub"]) < 0.2, "a step back is no step")
        browser.run("document.getElementById('play').click()")
        wait(browser, lambda state: float(state["scrub"]) > before + 0.1, "playing")
        browser.run("document.getElementById('play').click()")
        layouts(check, browser, shots, "log")
        check.faults += [f"log: {complaint}" for complaint in complaints(browser, view.url.split("#")[0])]
    finally:
        view.stop()


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("palpate", help="the program")
    arguments.add_argument("folder", type=Path, help="for logs")
    arguments.add_argument("--shots", type=Path, help="keep screenshots here")
    arguments.add_argument("--chromium", default=shutil.which("chromium") or "chromium")
    args = arguments.parse_args()
    log = args.folder / "view.mcap"
    browser, check = Browser(args.chromium, WEBGL), Check()
    try:
        for domain in ("Page", "Runtime", "Network", "Log"):
            browser.send(f"{domain}.enable")
        check_live(check, browser, args.palpate, log, args.shots)
        check_log(check, browser, args.palpate, log, args.shots)
    finally:
        with contextlib.suppress(RuntimeError):
            browser.close()
    for fault in check.faults:
        print(fault, file=sys.stderr)
    print(f"view: {'FAILED' if check.faults else 'ok'}")
    sys.exit(bool(check.faults))


if __name__ == "__main__":
    main()
