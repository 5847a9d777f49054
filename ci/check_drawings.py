"""Opens pages in chromium and checks that they fit the screen and that no words of a drawing lie on each other or outside it.

Usage: check_drawings.py PAGE.html... [--shots FOLDER] [--chromium PROGRAM]

For pages without scripts, such as those of `palpate reduce --html`: wide and narrow, light and dark.
"""

import argparse
import base64
import sys
from pathlib import Path

from check_page import SLICE, Browser

WIDTHS = (1280, 360)
SCHEMES = ("light", "dark")
# What leaves the screen, but for tables, which scroll by themselves; and words of a drawing that leave it or meet. The box of a
# word is higher than its letters.
FAULTS = """(() => {
    const faults = [];
    for (const element of document.querySelectorAll('body *'))
        if (!element.closest('.wide') && !element.closest('svg') && element.getBoundingClientRect().right > innerWidth + 1)
            faults.push(`wider than the screen: ${element.tagName}.${element.className}`);
    for (const svg of document.querySelectorAll('svg')) {
        const name = svg.getAttribute('aria-label'), frame = svg.getBoundingClientRect();
        const texts = [...svg.querySelectorAll('text')].filter(text => text.textContent.trim());
        const boxes = texts.map(text => [text.textContent, text.getBoundingClientRect()]);
        boxes.forEach(([words, box], at) => {
            if (box.width === 0) return;
            if (box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1 || box.bottom > frame.bottom + 1)
                faults.push(`${name}: "${words}" leaves the drawing`);
            for (const [others, other] of boxes.slice(at + 1))
                if (box.left < other.right - 1 && other.left < box.right - 1 && box.top < other.bottom - 4 && other.top < box.bottom - 4)
                    faults.push(`${name}: "${words}" lies on "${others}"`);
        });
    }
    return { faults, drawings: document.querySelectorAll('svg').length, height: document.documentElement.scrollHeight };
})()"""


def check(browser, page, shots):
    faults = []
    for width in WIDTHS:
        for scheme in SCHEMES:
            browser.send("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 500)
            browser.send("Emulation.setEmulatedMedia", media="", features=[{"name": "prefers-color-scheme", "value": scheme}])
            browser.open(page.resolve().as_uri())
            found = browser.run(FAULTS)
            faults += [f"{page.name}, {width} {scheme}: {fault}" for fault in found["faults"]]
            if not found["drawings"]:
                faults.append(f"{page.name}: has no drawing")
            for number, top in enumerate(range(0, found["height"], SLICE) if shots else ()):
                clip = {"x": 0, "y": top, "width": width, "height": min(SLICE, found["height"] - top), "scale": 1}
                picture = browser.send("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
                name = f"{page.stem}-{width}-{scheme}-{number}.png"
                (shots / name).write_bytes(base64.b64decode(picture["data"]))
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--shots", type=Path, help="save screenshots there")
    parser.add_argument("--chromium", default="chromium")
    arguments = parser.parse_args()
    browser = Browser(arguments.chromium)
    try:
        browser.send("Page.enable")
        faults = [fault for page in arguments.pages for fault in check(browser, page, arguments.shots)]
    finally:
        browser.close()
    print("\n".join(faults) or f"{len(arguments.pages)} pages: everything fits")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
