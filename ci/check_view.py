"""Opens the page of `palpate view` in chromium, pushes the body, and compares what is shown with the log of that run.

Usage: check_view.py PALPATE FOLDER [--linked] [--shots FOLDER] [--chromium PROGRAM]; writes logs to FOLDER

Drives the browser as check_page.py does. The picture is drawn by Chromium's own software renderer.
"""

import argparse
import base64
import contextlib
import csv
import io
import os
import pty
import shutil
import signal
import socket
import subprocess
import sys
import threading
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
  // Text is read against what is behind it: 4.5 to 1 (WCAG 2.2, AA).
  const numbers = (text) => text.match(/[\d.]+/g).map(Number);
  const light = (colour) => numbers(colour).slice(0, 3).map((c) => c / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)).reduce((sum, c, n) => sum + c * [0.2126, 0.7152, 0.0722][n], 0);
  const ground = (element) => { const own = getComputedStyle(element).backgroundColor; return own.startsWith("rgb(") ? own : element.parentElement ? ground(element.parentElement) : "rgb(255, 255, 255)"; };
  for (const element of document.querySelectorAll("h1, p, span, b, dt, dd, label, output, button:enabled, select:enabled, summary, li, kbd"))
    if (shown(element) && element.textContent.trim()) {
      const [a, b] = [light(getComputedStyle(element).color), light(ground(element))];
      const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      if (ratio < 4.5) faults.push(`contrast of ${ratio.toFixed(1)}: ${element.tagName} ${element.id} ${element.textContent.trim().slice(0, 20)}`);
    }
  // Everything that can be done is reached by the Tab key.
  for (const element of document.querySelectorAll("button:enabled, select:enabled, input:enabled, summary, #picture"))
    if (shown(element) && element.tabIndex < 0) faults.push(`not reached by Tab: ${element.tagName} ${element.id}`);
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
  const { tool, deepest, deepestMm, frames, surfaces, firstMs, distance } = document.getElementById("picture").dataset;
  const place = (text) => (text ? text.split(",").map(Number) : null);
  const box = document.getElementById("picture").getBoundingClientRect();
  const away = document.getElementById("away");
  return { away: away.hidden ? null : text("away-text"), status: text("status"), note: text("note"), time: parseFloat(text("n-time")), contact: text("n-contact"), commanded: text("n-commanded"), computed: text("n-computed"),
    tick: tick === undefined ? null : [tick, x, y, z].map(Number), tool: place(tool), deepest: place(deepest), deepest_mm: +deepestMm, frames: +frames, surfaces: +surfaces, stress: parseFloat(text("n-stress")), legend: text("legend-ticks"), first: firstMs ?? null, distance: +distance, left: box.left, top: box.top,
    scrub: document.getElementById("scrub").value, model: document.getElementById("model").value, friction: text("friction-value") };
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


class Relay:
    """Stands between browser and server at another of this machine's own addresses; what goes through it can be cut off or lost."""

    def __init__(self, port):
        self.port, self.pairs, self.lost, self.lets_in, self.mutes = port, [], set(), True, False
        self.listener = socket.create_server(("127.0.0.2", port))
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                near = self.listener.accept()[0]
                if not self.lets_in:
                    near.close()
                    continue
                pair = (near, socket.create_connection(("127.0.0.1", self.port)))
                self.pairs.append(pair)
                threading.Thread(target=self.pump, args=(pair, *pair, self.mutes), daemon=True).start()
                threading.Thread(target=self.pump, args=(pair, *reversed(pair), False), daemon=True).start()

    def pump(self, pair, source, sink, mutes):
        count = 0
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                # What is muted says what it asks for and no more.
                if pair not in self.lost and not (mutes and count > 0):
                    sink.sendall(data)
                count += 1
        self.end(pair)

    def end(self, pair):
        for side in pair:
            with contextlib.suppress(OSError):
                side.shutdown(socket.SHUT_RDWR)

    def cut(self):
        for pair in self.pairs:
            self.end(pair)

    def lose(self):
        """Nothing comes through any more, and nobody is told."""
        self.lost |= set(self.pairs)

    def close(self):
        self.listener.close()
        self.cut()


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


def soon(browser):
    """The state two pictures later: all that was done before is in it."""
    frames = browser.run(STATE)["frames"]
    return wait(browser, lambda state: state["frames"] > frames + 1, "two pictures")


def mouse(browser, kind, x, y, **more):
    pressed = kind != "mouseReleased"
    browser.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(pressed), clickCount=1, **more)


def choose(browser, name, value):
    """Does what a visitor does with a slider or a list."""
    browser.run(f"(() => {{ const e = document.getElementById('{name}'); e.value = '{value}'; for (const what of ['input', 'change']) e.dispatchEvent(new Event(what, {{ bubbles: true }})); }})()")


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


def newtons(text):
    """What a number with its unit is (N)."""
    value, unit = (text if " " in text else "0 N").split()
    return float(value) * {"N": 1, "mN": 1e-3, "µN": 1e-6, "nN": 1e-9, "kN": 1e3}[unit]


PIXELS = """(() => {
  const [width, height] = [300, 200];
  const flat = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d");
  flat.drawImage(document.getElementById("picture"), 0, 0, width, height);
  const { data } = flat.getImageData(0, 0, width, height);
  return Array.from({ length: width * height }, (_, n) => 4 * n).filter((at) => [0, 1, 2].some((n) => data[at + n] !== data[n])).length;
})()"""


def lost_picture(check, browser):
    """What the graphics card loses is drawn again."""
    before = browser.run(PIXELS)
    check.that(before > 500, f"{before} pixels of the picture are not the stage's")
    browser.run("(window.card = document.getElementById('picture').getContext('webgl2').getExtension('WEBGL_lose_context')).loseContext()")
    wait(browser, lambda state: "lost the picture" in state["note"], "words about the picture")
    browser.run("window.card.restoreContext()")
    wait(browser, lambda state: state["note"] == "" and browser.run(PIXELS) > 0.8 * before, "the picture again")


def changes(check, browser, shots):
    """Stiffness, friction and model change under the tool, and the body goes on."""
    before = wait(browser, lambda state: newtons(state["computed"]) > 0.3, "a force")
    most = browser.run("document.getElementById('stiffness').max")
    choose(browser, "stiffness", most)
    # The pointer's spring gives way: the force grows by less than the stiffness.
    stiffer = wait(browser, lambda state: newtons(state["computed"]) > 1.08 * newtons(before["computed"]), "a stiffer body")
    check.that(stiffer["time"] > before["time"], "the body started anew")
    wait(browser, lambda _: "the most" in browser.run("document.getElementById('stiffness-value').textContent"), "the most that its steps bear")
    choose(browser, "stiffness", 0)
    wait(browser, lambda state: newtons(state["computed"]) < 1.05 * newtons(before["computed"]), "the body as it was")
    for model in ("full", "hold", "predictive", "patch"):
        last = browser.run(STATE)
        choose(browser, "model", model)
        now = wait(browser, lambda state: f"model {model}" in state["status"] and state["time"] > last["time"] + 0.2, f"the model {model}")
        check.that(now["contact"] != "free" and now["deepest_mm"] > 2, f"{model} began anew: {now}")
    choose(browser, "friction", 0.1)
    wait(browser, lambda state: state["friction"] == "0.10", "another friction")
    shoot(browser, shots, "changes-1280-light")
    # What is set may lie between two steps of its slider.
    browser.run("(() => { const e = document.getElementById('friction'); e.step = 'any'; e.value = 0.33; e.dispatchEvent(new Event('change')); e.step = 0.05; })()")
    wait(browser, lambda state: state["friction"] == "0.33", "a friction between two steps")
    choose(browser, "friction", 0.5)
    choose(browser, "colour", "stress")
    shown = wait(browser, lambda state: (state["stress"] or 0) > 0, "the stress")
    check.that("Pa" in shown["legend"], f"the stress has no unit: {shown['legend']}")
    time.sleep(0.4)
    shoot(browser, shots, "stress-1280-light")
    choose(browser, "colour", "pressure")
    time.sleep(0.4)
    shoot(browser, shots, "pressure-1280-light")
    choose(browser, "colour", "depth")


def smooth(check, browser):
    """While the body moves, every frame shows another surface, although the global model makes some thirty a second."""
    state = browser.run(STATE)
    x, y = state["left"] + state["tool"][0], state["top"] + state["tool"][1]
    mouse(browser, "mousePressed", x, y)
    first = browser.run(STATE)
    for step in range(40):
        mouse(browser, "mouseMoved", x + step, y)
        time.sleep(0.02)
    last = browser.run(STATE)
    mouse(browser, "mouseReleased", x + 39, y)
    frames, surfaces = last["frames"] - first["frames"], last["surfaces"] - first["surfaces"]
    check.that(surfaces > 0.75 * frames, f"{surfaces} surfaces in {frames} frames: the body does not move as the tool does")


def pen(check, browser):
    """A pen pushes as a mouse does."""
    state = browser.run(STATE)
    x, y = state["left"] + state["tool"][0], state["top"] + state["tool"][1]
    mouse(browser, "mousePressed", x, y, pointerType="pen", force=0.5)
    for step in range(1, 9):
        mouse(browser, "mouseMoved", x - 3 * step, y, pointerType="pen", force=0.5)
        time.sleep(0.03)
    mouse(browser, "mouseReleased", x - 24, y, pointerType="pen")
    wait(browser, lambda now: now["tool"][0] < state["tool"][0] - 12, "the way of a pen")


GAMEPAD = """(() => {
  window.rumbles = [];
  const actuator = { playEffect: (kind, how) => { window.rumbles.push({ kind, ...how }); return Promise.resolve("complete"); } };
  window.pad = { connected: true, axes: [0, 0, 0, 0], buttons: [], vibrationActuator: actuator };
  Object.defineProperty(navigator, "getGamepads", { value: () => [null, window.pad], configurable: true });
})()"""


def gamepad(check, browser):
    """The left stick moves the tool, the right one pushes it away, and it rumbles with the force."""
    browser.run(GAMEPAD)
    for axis, sign, what in ((0, 1, "right"), (0, -1, "left"), (3, 1, "nearer"), (3, -1, "farther")):
        before = browser.run(STATE)
        browser.run(f"window.pad.axes[{axis}] = {sign}")
        moved = (lambda now: sign * (now["tool"][0] - before["tool"][0]) > 2) if axis == 0 else (lambda now: now["distance"] != before["distance"])
        after = wait(browser, moved, f"a stick to the {what}")
        browser.run(f"window.pad.axes[{axis}] = 0")
        check.that(axis == 0 or (after["distance"] < before["distance"]) == (sign > 0), f"the right stick goes the wrong way: {what}")
    rumbles = browser.run("window.rumbles")
    check.that(any(rumble["kind"] == "dual-rumble" and 0 < rumble["strongMagnitude"] <= 1 for rumble in rumbles), f"no rumble under a force: {rumbles[:3]}")
    browser.run("window.pad.connected = false")


def check_opening(check, palpate, folder):
    """On a terminal with a display the command opens a browser, with the whole address."""
    told, program = folder / "opened", folder / "xdg-open"
    program.write_text(f'#!/bin/sh\nprintf %s "$1" > "{told}.part" && mv "{told}.part" "{told}"\n')
    program.chmod(0o755)
    outer, inner = pty.openpty()
    environment = {**os.environ, "DISPLAY": ":0", "PATH": f"{folder}:{os.environ['PATH']}"}
    process = subprocess.Popen([palpate, "view"], stdout=inner, stderr=inner, stdin=inner, env=environment)
    os.close(inner)
    deadline = time.monotonic() + PATIENCE_S
    while not told.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    while process.poll() is None and time.monotonic() < deadline:
        with contextlib.suppress(OSError):
            os.read(outer, 4096)
    address = told.read_text() if told.exists() else ""
    check.that(address.startswith("http://127.0.0.1:") and len(address.partition("#")[2]) >= 16, f"the browser was opened with {address!r}")


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
    pinched = soon(browser)["distance"]
    check.that(pinched > before, "fingers that part do not push the tool away")
    # What two fingers do while there is a third is nothing, then and when it has gone.
    browser.run("document.getElementById('picture').addEventListener('pointerdown', (event) => { window.third = event.pointerId; }, { once: true })")
    three = lambda way: (point(x, y - 64), point(x + 90 + way, y - 64, 1), point(x + 45, y - 20, 2))
    send("touchStart", *three(0))
    send("touchMove", *three(60))
    soon(browser)
    browser.run("document.getElementById('picture').dispatchEvent(new PointerEvent('pointerup', { pointerId: window.third }))")
    send("touchMove", *three(61))
    after = soon(browser)["distance"]
    check.that(0 < after - pinched < 3e-3, f"a third finger moves the tool from {pinched} m to {after} m from the viewer")
    send("touchEnd")
    browser.run("document.getElementById('picture').focus()")
    for name, nearer in (("PageUp", True), ("PageDown", False)):
        before = browser.run(STATE)["distance"]
        key(browser, name)
        after = wait(browser, lambda state: state["distance"] != before, name)["distance"]
        check.that((after < before) == nearer, f"{name} moves the tool from {before} m to {after} m from the viewer")
    # At the end of its room the pointer does not go on where the tool does not follow.
    ways = []
    for _ in range(3):
        ways.append(soon(browser)["distance"])
        browser.run("for (let n = 0; n < 100; n += 1) document.getElementById('picture').dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight', shiftKey: true }))")
    check.that(ways[0] != ways[1] == ways[2], f"half a metre after the other to the right the pointer is {ways} m away")
    key(browser, "h")
    wait(browser, lambda state: state["contact"] == "free" and state["deepest_mm"] < 0.5, "the way home")
    size(browser, 1280, "light")


def calm(check, browser):
    """Strips do not run for who asked for less motion; the body still follows the hand."""
    drawn = "(({ strips, frames }) => [+strips, +frames])(document.getElementById('picture').dataset)"
    for wish in ("no-preference", "reduce"):
        browser.send("Emulation.setEmulatedMedia", media="", features=[{"name": "prefers-reduced-motion", "value": wish}])
        time.sleep(0.2)
        before, begin = browser.run(drawn), time.monotonic()
        time.sleep(3)
        strips, frames = (after - first for after, first in zip(browser.run(drawn), before))
        passed = time.monotonic() - begin
        # A slow machine draws few pictures: strips go with them, unless less motion was asked for.
        holds = strips <= 2 * passed + 1 if wish == "reduce" else strips >= 0.5 * min(frames, 30 * passed)
        check.that(holds, f"strips were drawn {strips} times in {passed:.1f} s and {frames} pictures, reduced motion: {wish}")
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


def leave(browser):
    """Leaves the page while its server is there: one that still tries to come back would complain in the check after this."""
    browser.open("about:blank")


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
        changes(check, browser, shots)
        smooth(check, browser)
        calm(check, browser)
        pen(check, browser)
        gamepad(check, browser)
        layouts(check, browser, shots, "live")
        touch(check, browser)
        # Another session takes the place of this one.
        before = browser.run(STATE)["time"]
        browser.run("document.getElementById('reset').click()")
        wait(browser, lambda state: state["time"] < before, "a reset")
        found = complaints(browser, view.url.split("#")[0])
        lost_picture(check, browser)
        leave(browser)
    finally:
        view.stop()
    check_forces(check, seen, commanded(palpate, log), "live")
    check.faults += [f"live: {complaint}" for complaint in found]


def check_return(check, browser, palpate, shots):
    """A page whose connection ends, by whatever, comes back to the body that it pushed, and pushes on."""
    view = View(palpate, "--model", "patch")
    relay = Relay(int(view.url.split("#")[0].rsplit(":", 1)[1].strip("/")))
    try:
        size(browser, 1280, "light")
        browser.open(view.url.replace("127.0.0.1", "127.0.0.2"))
        wait(browser, lambda state: state["first"], "the first picture")
        push(check, browser)
        time.sleep(2)
        before = browser.run(STATE)
        gone = lambda: wait(browser, lambda state: state["away"] and state["status"] == "not connected", "words about the connection")

        def back(what, since):
            now = wait(browser, lambda state: not state["away"] and "you hold the tool" in state["status"] and state["time"] > since["time"] + 0.3, what)
            # Where it was is the pointer: a limit that acts on the force lets the tool come nearer to it.
            check.that(abs(now["distance"] - before["distance"]) < 1e-5, f"{what}: the pointer moved: {before} {now}")
            check.that(now["contact"] != "free" and newtons(now["computed"]) > 0.3, f"{what}: the tool did not stay: {before} {now}")
            return now

        # The network goes, and the server cannot be reached for a while.
        relay.lets_in = False
        relay.cut()
        lost = gone()
        check.that("Trying again" in lost["away"] and "stays where it is" in lost["away"], f"it does not say what happens: {lost['away']}")
        for width, scheme in ((1280, "light"), (390, "dark")):
            size(browser, width, scheme)
            shoot(browser, shots, f"away-{width}-{scheme}")
            for fault in browser.run(LAYOUT):
                check.that(False, f"away, {width} px, {scheme}: {fault}")
        size(browser, 1280, "light")
        relay.lets_in = True
        now = back("coming back by itself", lost)
        # A page that waits long comes at once when somebody looks at it.
        relay.lets_in = False
        relay.cut()
        lost = wait(browser, lambda state: state["away"] and "8\u00a0s" in state["away"], "backing off")
        relay.lets_in = True
        begin = time.monotonic()
        browser.run("document.dispatchEvent(new Event('visibilitychange'))")
        now = back("coming back to be looked at", lost)
        check.that(time.monotonic() - begin < 4, f"it took {time.monotonic() - begin:.1f} s to come back to be looked at")
        # Nothing comes through any more, and neither side is told: the server believes the old connection to be there.
        relay.lose()
        lost = gone()
        now = back("coming back from a dead connection", lost)
        # A phone sleeps, and when it wakes up its connection has gone.
        for cuts in (False, True):
            browser.send("Emulation.setFocusEmulationEnabled", enabled=False)
            browser.send("Page.setWebLifecycleState", state="frozen")
            time.sleep(5)
            if cuts:
                relay.cut()
            browser.send("Page.setWebLifecycleState", state="active")
            # Awake, and still hidden until somebody looks at it.
            browser.send("Emulation.setFocusEmulationEnabled", enabled=True)
            now = back(f"waking up, {'cut off' if cuts else 'connected'}", now)
        # It does not come to say its token, as if it slept then.
        relay.mutes = True
        relay.cut()
        lost = wait(browser, lambda state: state["away"] and "token in time" in state["away"], "words about its silence")
        relay.mutes = False
        now = back("coming back after a silence", lost)
        browser.run("document.getElementById('picture').focus()")
        for _ in range(6):
            key(browser, "ArrowUp")
        wait(browser, lambda state: state["tool"][1] < now["tool"][1] - 4, "a push after coming back")
        # A server that was started anew has another token, and says so.
        browser.run("location.hash = 'f00'")
        refused = wait(browser, lambda state: state["away"] and "does not know the token" in state["away"], "words about a wrong token")
        time.sleep(1.5)
        check.that(browser.run(STATE)["away"] == refused["away"], "it tries a token again that was refused")
        browser.run(f"location.hash = '{view.url.partition('#')[2]}'")
        wait(browser, lambda state: not state["away"] and "you hold the tool" in state["status"], "another address in the same tab")
        leave(browser)
    finally:
        relay.close()
        view.stop()


def check_two_tools(check, browser, palpate, shots):
    """Of two devices both are seen; numbers, strips and pushes are those of the one that is chosen."""
    view = View(palpate, "scenes/two_hands.toml")
    try:
        start(browser, view)
        wait(browser, lambda state: state["tool"] and state["frames"] > 5 and state["tick"], "the first picture of two tools")
        names = browser.run("[...document.getElementById('device').options].map((option) => option.textContent)")
        check.that(names == ["left", "right"], f"the tools are named {names}")
        # The first is the visitor's and stays where it is; the second is the scene's, and presses within its two seconds.
        still = [tuple(round(c) for c in browser.run(STATE)["tool"]) for _ in range(5)]
        choose(browser, "device", "1")
        before = browser.run(STATE)["time"]
        browser.run("document.getElementById('reset').click()")
        wait(browser, lambda state: state["time"] < before, "a reset")
        pressed = wait(browser, lambda state: newtons(state["computed"]) > 0.05, "a force on the second tool")
        check.that(pressed["contact"] in ("sticks", "slips"), f"there is a force, and the contact is {pressed['contact']}")
        check.that(len(set(still)) == 1 and still[0] != tuple(round(c) for c in pressed["tool"]), f"the tools are at {still} and {pressed['tool']}")
        layouts(check, browser, shots, "two")
        check.faults += [f"two tools: {complaint}" for complaint in complaints(browser, view.url.split("#")[0])]
        leave(browser)
    finally:
        view.stop()


def check_linked(check, browser, palpate, log, shots):
    """The body is in another process: the surface that is shown is that one's, and what a visitor changes reaches it."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
    serving = subprocess.Popen([palpate, "serve", "demo", "--model", "patch", "--listen", address], stdout=subprocess.DEVNULL)
    view = None
    try:
        view = View(palpate, "demo", "--model", "patch", "--global", address, "--out", str(log))
        start(browser, view)
        push(check, browser)
        offered = browser.run("[...document.getElementById('model').options].map((option) => option.value)")
        check.that(offered == ["patch"], f"over a link the page offers {offered}")
        seen = []
        for _ in range(8):
            seen.append(browser.run(STATE)["tick"])
            time.sleep(0.2)
        shoot(browser, shots, "linked-1280-light")
        before = browser.run(STATE)
        choose(browser, "stiffness", browser.run("document.getElementById('stiffness').max"))
        wait(browser, lambda state: newtons(state["computed"]) > 1.08 * newtons(before["computed"]), "a stiffer body over there")
        smooth(check, browser)
        # What is put in the place of this session begins with the body at rest, there too.
        browser.run("document.getElementById('reset').click()")
        wait(browser, lambda state: state["time"] < before["time"] and state["frames"] > 5, "a reset")
        # One that stands still is no body that may be felt, and the page is the same when it goes on.
        serving.send_signal(signal.SIGSTOP)
        time.sleep(1.5)
        serving.send_signal(signal.SIGCONT)
        last = browser.run(STATE)
        wait(browser, lambda state: state["surfaces"] > last["surfaces"] + 5, "a surface again")
        found = complaints(browser, view.url.split("#")[0])
    finally:
        if view:
            view.stop()
        serving.kill()
    check_forces(check, seen, commanded(palpate, log), "linked")
    check.faults += [f"linked: {complaint}" for complaint in found]


TIMING = "['n-lateness', 'n-execution'].map((id) => document.getElementById(id).textContent)"


def copy(name, folder, instead):
    """A scene of this repository with some words in place of others, elsewhere."""
    text = Path("scenes", name).read_text()
    for old, new in instead.items():
        text = text.replace(old, new)
    text = text.replace('path_csv = "', f'path_csv = "{Path("scenes").resolve()}/')
    (folder / name).write_text(text)
    return str(folder / name)


def check_second_tool(check, browser, palpate, folder, port):
    """The tool that is shown first is the one that can be pushed; gives what is said of the session's timing in the end."""
    scene = copy("two_hands.toml", folder, {'kind = "hand"\npath_csv = "paths/hold_right.csv"': 'kind = "pointer"'})
    view = View(palpate, scene, "--watch", "--port", port)
    try:
        start(browser, view)
        first = wait(browser, lambda state: state["tool"] and state["frames"] > 5, "the first picture of a second tool")
        check.that("you hold the tool" in first["status"], f"nobody holds the second tool: {first['status']}")
        browser.run("document.getElementById('picture').focus()")
        for _ in range(6):
            key(browser, "ArrowUp")
        wait(browser, lambda state: state["tool"][1] < first["tool"][1] - 4, "a push of the second tool")
        wait(browser, lambda _: "–" not in browser.run(TIMING), "the timing of a session")
    finally:
        view.stop()
    return browser.run(TIMING)


def check_fast_log(check, browser, palpate, folder):
    """Strips show all of their seconds, however many ticks a second has."""
    scene, log = copy("drag_friction.toml", folder, {"rate_hz = 1000": "rate_hz = 4000"}), str(folder / "fast.mcap")
    subprocess.run([palpate, "run", scene, "--virtual", "--model", "hold", "--log-scene", "--out", log], stdout=subprocess.DEVNULL, check=True)
    view = View(palpate, log)
    try:
        start(browser, view)
        wait(browser, lambda state: "4000 Hz" in state["status"], "the fast log")
        browser.run("(() => { const s = document.getElementById('scrub'); s.value = 2.4; s.dispatchEvent(new Event('input')); })()")
        ticks = "JSON.parse(document.getElementById('strip-force').dataset.shown ?? '{}').ticks"
        wait(browser, lambda _: (browser.run(ticks) or 0) > 9500, "a strip of all ticks")
        leave(browser)
    finally:
        view.stop()


def check_log(check, browser, palpate, folder, log, shots):
    forces = commanded(palpate, log)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
    # A session before it in the same tab leaves nothing behind.
    before = check_second_tool(check, browser, palpate, folder, port)
    view = View(palpate, str(log), "--port", port)
    try:
        browser.run(f"location.hash = '{view.url.partition('#')[2]}'")
        wait(browser, lambda state: "a log" in state["status"] and state["frames"] > 3, "the log")
        browser.events.clear()
        last = max(forces) / 1e6
        seen = []
        for share in (0.9, 0.5, 0.7, 0.95, 0.8):
            at = round(share * last, 3)
            browser.run(f"(() => {{ const s = document.getElementById('scrub'); s.value = {at}; s.dispatchEvent(new Event('input')); }})()")
            state = wait(browser, lambda state: state["tick"] and abs(state["tick"][0] - at) < 0.0011, f"the time {at}")
            check.that(abs(state["time"] - at) < 0.011, f"at {at} s the page says {state['time']}")
            seen.append(state["tick"])
        check_forces(check, seen, forces, "log")
        check.that(browser.run(TIMING) != before, f"the timing of the session before is that of the log: {before}")
        before = float(browser.run(STATE)["scrub"])
        browser.run("document.getElementById('back').click()")
        stepped = wait(browser, lambda state: float(state["scrub"]) < before, "a step back")
        check.that(before - float(stepped["scrub"]) < 0.2, "a step back is no step")
        browser.run("document.getElementById('play').click()")
        wait(browser, lambda state: float(state["scrub"]) > before + 0.1, "playing")
        browser.run("document.getElementById('play').click()")
        layouts(check, browser, shots, "log")
        check.faults += [f"log: {complaint}" for complaint in complaints(browser, view.url.split("#")[0])]
        leave(browser)
    finally:
        view.stop()


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("palpate", help="the program")
    arguments.add_argument("folder", type=Path, help="for logs")
    arguments.add_argument("--linked", action="store_true", help="only with the body in another process; for a program with the feature `link`")
    arguments.add_argument("--shots", type=Path, help="keep screenshots here")
    arguments.add_argument("--chromium", default=shutil.which("chromium") or "chromium")
    args = arguments.parse_args()
    log = args.folder / "view.mcap"
    browser, check = Browser(args.chromium, WEBGL), Check()
    try:
        for domain in ("Page", "Runtime", "Network", "Log"):
            browser.send(f"{domain}.enable")
        if args.linked:
            check_linked(check, browser, args.palpate, log, args.shots)
        else:
            check_live(check, browser, args.palpate, log, args.shots)
            check_two_tools(check, browser, args.palpate, args.shots)
            check_return(check, browser, args.palpate, args.shots)
            check_log(check, browser, args.palpate, args.folder, log, args.shots)
            check_fast_log(check, browser, args.palpate, args.folder)
            check_opening(check, args.palpate, args.folder)
    finally:
        with contextlib.suppress(RuntimeError):
            browser.close()
    for fault in check.faults:
        print(fault, file=sys.stderr)
    print(f"view: {'FAILED' if check.faults else 'ok'}")
    sys.exit(bool(check.faults))


if __name__ == "__main__":
    main()
