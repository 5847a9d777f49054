"""Makes the moving picture of the README: frames of the page of `palpate view` while the body is pressed, dragged and let go.

Usage: moving_picture.py PALPATE OUT.webp [--seconds S] [--chromium PROGRAM]

Frames are what Chromium draws, with the times at which it drew them. Needs Pillow (`pip install pillow`).
"""

import argparse
import base64
import io
import math
import shutil
import time
from pathlib import Path

from PIL import Image

from check_page import Browser
from check_view import STATE, WEBGL, View, choose, key, mouse, size, wait

WIDTH, HEIGHT, FRAMES_PER_S, MOST_BYTES = 960, 600, 12, 1_500_000


def frames_of(browser, url, seconds):
    """Pairs of a time (s) and a picture, while the mouse goes down into the body, round, and up again."""
    browser.send("Emulation.setDeviceMetricsOverride", width=WIDTH, height=HEIGHT, deviceScaleFactor=1, mobile=False)
    browser.open(url)
    browser.run("document.getElementById('picture').focus()")
    wait(browser, lambda state: state["tool"] and state["frames"] > 5 and state["tick"], "the first picture")
    choose(browser, "colour", "stress")
    key(browser, "0")
    time.sleep(3)
    state = browser.run(STATE)
    x, y = state["left"] + state["tool"][0], state["top"] + state["tool"][1]
    mouse(browser, "mousePressed", x, y)
    begin, found = time.monotonic(), []
    while (passed := time.monotonic() - begin) < seconds:
        share = passed / seconds
        down = min(1.0, share / 0.25, (1.0 - share) / 0.2)
        angle = 2 * math.pi * max(0.0, min(1.0, (share - 0.3) / 0.45))
        mouse(browser, "mouseMoved", x + 55 * math.sin(angle), y + 78 * max(0.0, down) + 18 * (1 - math.cos(angle)))
        if not found or passed - found[-1][0] >= 1 / FRAMES_PER_S:
            shot = browser.send("Page.captureScreenshot", format="png", captureBeyondViewport=False)["data"]
            found.append((passed, Image.open(io.BytesIO(base64.b64decode(shot))).convert("RGB")))
    mouse(browser, "mouseReleased", x, y)
    return found


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("palpate", help="the program")
    arguments.add_argument("out", type=Path)
    arguments.add_argument("--seconds", type=float, default=6)
    arguments.add_argument("--chromium", default=shutil.which("chromium") or "chromium")
    args = arguments.parse_args()
    view, browser = View(args.palpate), Browser(args.chromium, WEBGL)
    try:
        for domain in ("Page", "Runtime"):
            browser.send(f"{domain}.enable")
        found = frames_of(browser, view.url, args.seconds)
    finally:
        browser.close()
        view.stop()
    times = [moment for moment, _ in found]
    spans = [round(1000 * (b - a)) for a, b in zip(times, times[1:])] + [600]
    first, *others = [picture for _, picture in found]
    for quality in (70, 55, 40, 30, 20):
        first.save(args.out, save_all=True, append_images=others, duration=spans, loop=0, quality=quality, method=6)
        if args.out.stat().st_size <= MOST_BYTES:
            break
    print(f"{args.out}: {len(found)} frames, {args.out.stat().st_size} bytes, quality {quality}")


if __name__ == "__main__":
    main()
