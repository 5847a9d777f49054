"""Opens the page of `palpate view` in Firefox: it draws the body, a drag pushes it, a change is taken, and nothing is complained about.

Usage: check_firefox.py PALPATE [--shot FILE] [--firefox PROGRAM]

Drives the browser by Marionette, its own protocol: JSON with its length in front, over a socket. Needs nothing but Python's standard
library, Firefox and Xvfb; WebGL is drawn by Mesa's software renderer.
"""

import argparse
import base64
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from check_page import Check
from check_view import PATIENCE_S, STATE, View, wait

PREFERENCES = {
    "webgl.force-enabled": True,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.enabled": False,
    "app.update.enabled": False,
    "network.captive-portal-service.enabled": False,
    "browser.aboutConfig.showWarning": False,
}


class Firefox:
    """Firefox on a display of its own, spoken to by Marionette: without one it has no WebGL."""

    def __init__(self, program):
        self.profile = Path(tempfile.mkdtemp())
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        preferences = {**PREFERENCES, "marionette.port": port}
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in preferences.items()]
        (self.profile / "user.js").write_text("\n".join(lines))
        environment = {**os.environ, "HOME": str(self.profile), "LIBGL_ALWAYS_SOFTWARE": "1"}
        command = ["xvfb-run", "-a", program, "--no-remote", "--marionette", "-remote-allow-system-access", "--profile", str(self.profile)]
        self.process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        self.socket = self.connected(port)
        self.rest, self.number = b"", 0
        self.message()
        self.send("WebDriver:NewSession", capabilities={"alwaysMatch": {"acceptInsecureCerts": True}})

    def connected(self, port):
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port), PATIENCE_S)
            except OSError:
                if time.monotonic() > deadline or self.process.poll() is not None:
                    raise RuntimeError("the browser does not listen") from None
                time.sleep(0.1)

    def message(self):
        while b":" not in self.rest:
            self.rest += self.socket.recv(1 << 16) or self.gone()
        length, self.rest = self.rest.split(b":", 1)
        while len(self.rest) < int(length):
            self.rest += self.socket.recv(1 << 20) or self.gone()
        data, self.rest = self.rest[: int(length)], self.rest[int(length):]
        return json.loads(data)

    def gone(self):
        raise RuntimeError("the browser has gone")

    def send(self, command, **parameters):
        self.number += 1
        data = json.dumps([0, self.number, command, parameters]).encode()
        self.socket.sendall(str(len(data)).encode() + b":" + data)
        _, _, error, result = self.message()
        if error:
            raise RuntimeError(f"{command}: {error['message']}")
        return result

    def run(self, script):
        return self.send("WebDriver:ExecuteScript", script=f"return {script}", args=[])["value"]

    def complaints(self):
        """Errors and warnings of scripts and of the policy for content, from the browser's own console."""
        self.send("Marionette:SetContext", value="chrome")
        said = self.run("""Services.console.getMessageArray().map((message) => String(message)).filter((text) => text.includes("127.0.0.1"))""")
        self.send("Marionette:SetContext", value="content")
        return said

    def close(self):
        # The display too, which xvfb-run has started.
        os.killpg(self.process.pid, signal.SIGTERM)
        self.process.wait(PATIENCE_S)
        shutil.rmtree(self.profile, ignore_errors=True)


def drag(browser, x, y, steps):
    """Presses at a place and moves on through `steps`, pixels each."""
    moves = [{"type": "pointerMove", "x": round(x + dx), "y": round(y + dy), "duration": 50} for dx, dy in steps]
    actions = [{"type": "pointerMove", "x": round(x), "y": round(y), "duration": 0}, {"type": "pointerDown", "button": 0}, *moves, {"type": "pointerUp", "button": 0}]
    pointer = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}
    browser.send("WebDriver:PerformActions", actions=[pointer])


def check_page(check, browser, url, shot):
    browser.send("WebDriver:SetWindowRect", width=1280, height=860)
    browser.send("WebDriver:Navigate", url=url)
    first = wait(browser, lambda state: state["first"] and state["tool"] and state["tick"], "the first picture")
    check.that("you hold the tool" in first["status"], f"the visitor does not hold the tool: {first['status']}")
    browser.run("document.querySelector('[data-view=\"4\"]').click()")
    time.sleep(0.5)
    for _ in range(20):
        state = browser.run(STATE)
        x, y = state["left"] + state["tool"][0], state["top"] + state["tool"][1]
        drag(browser, x, y, [(0, 4 * n) for n in range(1, 5)])
        if browser.run(STATE)["deepest_mm"] > 4:
            break
    pushed = wait(browser, lambda state: state["deepest_mm"] > 3 and state["tick"] and abs(state["tick"][3]) > 0.3, "a force")
    check.that(pushed["contact"] in ("sticks", "slips"), f"there is a force, and the contact is {pushed['contact']}")
    browser.run("(() => { const e = document.getElementById('model'); e.value = 'hold'; e.dispatchEvent(new Event('change')); })()")
    wait(browser, lambda state: "model hold" in state["status"], "another model")
    if shot:
        shot.write_bytes(base64.b64decode(browser.send("WebDriver:TakeScreenshot", full=True)["value"]))
    check.faults += [f"the console says: {text}" for text in browser.complaints()]


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("palpate", help="the program")
    arguments.add_argument("--shot", type=Path, help="keep a screenshot here")
    arguments.add_argument("--firefox", default=shutil.which("firefox-esr") or shutil.which("firefox") or "firefox-esr")
    args = arguments.parse_args()
    check, view = Check(), View(args.palpate, "--model", "patch")
    try:
        browser = Firefox(args.firefox)
        try:
            check_page(check, browser, view.url, args.shot)
        except RuntimeError as fault:
            raise RuntimeError(f"{fault}; {browser.complaints()}") from fault
        finally:
            browser.close()
    finally:
        view.stop()
    for fault in check.faults:
        print(fault, file=sys.stderr)
    print(f"firefox: {'FAILED' if check.faults else 'ok'}")
    sys.exit(bool(check.faults))


if __name__ == "__main__":
    main()
