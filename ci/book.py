#!/usr/bin/env python3
"""The site of the documentation: what mdBook is given, and whether every link of what it makes leads somewhere.

    book.py stage FOLDER    copies the pages of docs/SUMMARY.md, with the pictures and files that they link to, as they lie in the
                            repository; writes the list of chapters and a page that leads to the API documentation
    book.py check FOLDER    fails on a link or a picture of a built page that is not there, and on a page that no chapter is
"""

import json
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parent.parent
SUMMARY = ROOT / "docs/SUMMARY.md"
LINK = re.compile(r"\]\(([^)\s]+)\)")


def linked(page):
    """The files of the repository that a page links to."""
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(), flags=re.S)
    for link in LINK.findall(text):
        parts = urlsplit(link)
        if not parts.scheme and parts.path:
            yield (page.parent / unquote(parts.path)).resolve()


def crates():
    """(name, description) of each library that `cargo doc` documents: of the workspace's default members."""
    text = subprocess.run(
        ["cargo", "metadata", "--format-version", "1", "--no-deps", "--locked"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    workspace = json.loads(text)
    for package in workspace["packages"]:
        if package["id"] not in workspace["workspace_default_members"]:
            continue
        for target in package["targets"]:
            if "lib" in target["kind"]:
                yield target["name"], package["description"] or ""


def stage(folder):
    source = folder / "src"
    pages = [page for page in linked(SUMMARY)]
    faults = [f"docs/{page.name} is no chapter of docs/SUMMARY.md" for page in (ROOT / "docs").glob("*.md") if page not in [*pages, SUMMARY]]
    for page in pages:
        for path in [page, *linked(page)]:
            if not path.is_file():
                faults.append(f"{page.relative_to(ROOT)} links to {path}, which is no file")
            elif path.suffix == ".md" and path not in pages:
                faults.append(f"{page.relative_to(ROOT)} links to {path.relative_to(ROOT)}, which is no chapter")
            else:
                copy = source / path.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, copy)
    chapters = LINK.sub(lambda link: f"]({(SUMMARY.parent / link[1]).resolve().relative_to(ROOT)})", SUMMARY.read_text())
    (source / "SUMMARY.md").write_text(f"{chapters}- [API documentation](api.md)\n")
    rows = "".join(f"| [`{name}`](api/{name}/index.html) | {about} |\n" for name, about in sorted(crates()))
    (source / "api.md").write_text(f"# API documentation\n\n| crate | what |\n| --- | --- |\n{rows}")
    for name in ["book.toml", "book.css"]:
        shutil.copyfile(SUMMARY.parent / name, folder / name)
    return faults


class Page(HTMLParser):
    """Links and anchors of a built page."""

    def __init__(self, path):
        super().__init__()
        self.base, self.links, self.anchors = path.parent, [], set()
        self.feed(path.read_text(errors="replace"))

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.anchors.update(attrs[name] for name in ("id", "name") if attrs.get(name))
        self.links += [attrs[name] for name in ("href", "src") if attrs.get(name) and tag != "base"]


def check(folder):
    folder = folder.resolve()
    # The API documentation checks its own links when it is made; of it only what the pages link to is read.
    pages, links, faults = {}, 0, []
    for path in sorted(folder.rglob("*.html")):
        if path.relative_to(folder).parts[0] == "api" or path.name == "404.html":
            continue
        page = pages.setdefault(path, Page(path))
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            links += 1
            target = (page.base / unquote(parts.path)).resolve() if parts.path else path
            name = f"{path.relative_to(folder)}: {link}"
            if not target.is_relative_to(folder) or not target.is_file():
                faults.append(f"{name} leads nowhere")
            elif parts.fragment and target.suffix == ".html":
                if unquote(parts.fragment) not in pages.setdefault(target, Page(target)).anchors:
                    faults.append(f"{name}: the page has no such place")
    print(f"{len(pages)} pages, {links} links")
    return faults if links else ["there are no links"]


def main():
    match sys.argv[1:]:
        case ["stage", folder]:
            return stage(Path(folder))
        case ["check", folder]:
            return check(Path(folder))
    sys.exit(__doc__)


if __name__ == "__main__":
    found = main()
    print("\n".join(found), file=sys.stderr, end="\n" if found else "")
    sys.exit(1 if found else 0)
