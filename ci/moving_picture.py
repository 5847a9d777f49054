"""Makes the moving picture of the README: a run of the demo in virtual time, as the page of `palpate view` plays its log.

Usage: moving_picture.py PALPATE OUT.webp [--from S] [--seconds S] [--chromium PROGRAM]

Its pictures are taken one by one, so that a slow machine draws the same as a quick one. Needs Pillow (`pip install pillow`).
"""

import argparse
import base64
import io
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from PIL import Image

from check_page import Browser
from check_view import WEBGL, View, choose, key, wait

WIDTH, HEIGHT, FRAMES_PER_S, MOST_BYTES = 960, 600, 10, 1_000_000
SEEK = "(() => {{ const s = document.getElementById('scrub'); s.value = {}; s.dispatchEvent(new Event('input')); }})()"


def frames_of(browser, url, begin, seconds):
    """Pictures of the log from `begin` on (s)."""
    browser.send("Emulation.setDeviceMetricsOverride", width=WIDTH, height=HEIGHT, deviceScaleFactor=1, mobile=False)
    browser.open(url)
    browser.run("document.getElementById('picture').focus()")
    wait(browser, lambda state: "a log" in state["status"] and state["frames"] > 3, "the log")
    choose(browser, "colour", "depth")
    key(browser, "0")
    for number in range(round(seconds * FRAMES_PER_S)):
        at = round(begin + number / FRAMES_PER_S, 3)
        browser.run(SEEK.format(at))
        shown = wait(browser, lambda state: state["tick"] and abs(state["tick"][0] - at) < 0.0025, f"the time {at}")["frames"]
        # What was asked for is drawn, strips as well.
        wait(browser, lambda state: state["frames"] > shown + 3, "drawing")
        shot = browser.send("Page.captureScreenshot", format="png", captureBeyondViewport=False)["data"]
        yield Image.open(io.BytesIO(base64.b64decode(shot))).convert("RGB")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("palpate", help="the program")
    arguments.add_argument("out", type=Path)
    arguments.add_argument("--from", type=float, default=0.2, dest="begin")
    arguments.add_argument("--seconds", type=float, default=4.6)
    arguments.add_argument("--chromium", default=shutil.which("chromium") or "chromium")
    args = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        # Named without a folder, as the page says the name.
        program, out = str(Path(args.palpate).resolve()), args.out.resolve()
        os.chdir(folder)
        log = "demo.mcap"
        subprocess.run([program, "run", "demo", "--virtual", "--log-scene", "--out", log], check=True, stdout=subprocess.DEVNULL)
        view, browser = View(program, log), Browser(args.chromium, WEBGL)
        try:
            for domain in ("Page", "Runtime"):
                browser.send(f"{domain}.enable")
            first, *others = frames_of(browser, view.url, args.begin, args.seconds)
        finally:
            browser.close()
            view.stop()
    for quality in (70, 55, 40, 30, 20):
        first.save(out, save_all=True, append_images=others, duration=round(1000 / FRAMES_PER_S), loop=0, quality=quality, method=6)
        if out.stat().st_size <= MOST_BYTES:
            break
    print(f"{args.out}: {1 + len(others)} frames, {out.stat().st_size} bytes, quality {quality}")


if __name__ == "__main__":
    main()
