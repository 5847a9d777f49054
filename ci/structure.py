#!/usr/bin/env python3
"""Counts what the workspace consists of, and refuses what no compiler does.

    structure.py lines            lines of Rust per room: without tests, benches and examples
    structure.py names DOC        public names of each crate, from the folder that `cargo doc` writes;
                                  fails on two types of one name and on documentation that leans on its neighbours
    structure.py circles          files that import each other in a circle; fails on any
"""

import html
import re
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Crate: the folder of its sources.
CRATES = {
    "palpate": ROOT / "src",
    "palpate_mesh": ROOT / "src/mesh",
    "palpate_model": ROOT / "src/model",
    "palpate_runtime": ROOT / "src/runtime",
    "palpate_ffi": ROOT / "ffi/src",
    "palpate_haply": ROOT / "haply/src",
    "palpate_link": ROOT / "link/src",
    "palpate_view": ROOT / "view/src",
    "palpate_cli": ROOT / "tools/src",
    "palpate_python": ROOT / "python/src",
}
# Their names are those of C, in one header, and of Python.
FOREIGN = {"palpate_ffi", "palpate_python"}
# Documented by its own job, as what it is built on takes ten minutes.
ALONE = {"palpate_link"}
ENGINE = ["palpate", "palpate_mesh", "palpate_model", "palpate_runtime"]
ASIDE = {"tests", "benches", "examples", "target"}
# Chosen by a cfg, these files are one: a kernel names its instruction sets and they name it.
ONE = [re.compile(r"/kernel/(simd|avx2|avx512|portable)\.rs$")]
LEANING = re.compile(r"^(The same|As|With|Of|And|But|What|Where|Which|Likewise)\b")


def sources(crate):
    """The files of a crate, by their path in its folder."""
    root = CRATES[crate]
    inner = [other for other in CRATES.values() if other != root and root in other.parents]
    for path in sorted(root.rglob("*.rs")):
        if not ASIDE & set(path.relative_to(root).parts) and not any(one in path.parents for one in inner):
            yield path


def lines():
    def count(paths):
        return sum(len(path.read_text().splitlines()) for path in paths)

    total = engine = 0
    for crate, root in CRATES.items():
        rooms = defaultdict(list)
        for path in sources(crate):
            rooms[path.relative_to(root).parts[0] if path.parent != root else "."].append(path)
        whole = count(sources(crate))
        total += whole
        engine += whole if crate in ENGINE else 0
        print(f"{crate:<18}{whole:>7}")
        for room, paths in sorted(rooms.items()):
            print(f"    {room:<18}{count(paths):>7}  in {len(paths)} files")
    print(f"{'engine':<18}{engine:>7}  with model and runtime\n{'all':<18}{total:>7}")


def items(doc, crate):
    """(kind, path) of each public item, and the page that describes it."""
    page = (doc / crate / "all.html").read_text()
    for kind, body in re.findall(r'<h3 id="([a-z-]+)">[^<]*</h3><ul class="all-items">(.*?)</ul>', page, re.S):
        for link, name in re.findall(r'<li><a href="([^"]+)">([^<]+)</a>', body):
            # A prelude names what is counted where it is at home.
            if not name.startswith("prelude::"):
                yield kind, html.unescape(name), doc / crate / link


def names(doc):
    types = {"structs", "enums", "traits", "types", "unions"}
    owners, leaning, total = defaultdict(list), [], 0
    for crate in (crate for crate in CRATES if crate not in FOREIGN | ALONE):
        found = list(items(doc, crate))
        total += len(found)
        print(f"{crate:<18}{len(found):>5}")
        for kind, name, page in found:
            if kind in types:
                owners[name.split("::")[-1]].append(f"{crate}::{name}")
            text = re.search(r'<div class="docblock">(.*?)</div>', page.read_text(), re.S)
            text = re.sub(r"<[^>]+>", "", html.unescape(text.group(1))).strip() if text else ""
            if LEANING.match(text):
                leaning.append(f"{crate}::{name}: {text.splitlines()[0][:80]}")
    print(f"{'all':<18}{total:>5}")
    shared = [" and ".join(paths) for paths in owners.values() if len(paths) > 1]
    for fault in [f"two types of one name: {pair}" for pair in shared] + [f"leans on its neighbours: {one}" for one in leaning]:
        print(fault)
    return not shared and not leaning


def code(path):
    """A file without comments and, as they end it, unit tests."""
    text = re.split(r"^#\[cfg\((?:all\()?test\b.*$\n(?=(?:#.*\n)*mod \w+ \{)", path.read_text(), flags=re.M)[0]
    return re.sub(r"//.*", "", text)


def used(text):
    """The paths after `use`, braces resolved."""
    def split(list_):
        depth, start = 0, 0
        for at, c in enumerate(list_):
            depth += (c == "{") - (c == "}")
            if c == "," and depth == 0:
                yield list_[start:at]
                start = at + 1
        yield list_[start:]

    def resolve(path):
        head, brace, rest = path.strip().partition("{")
        if not brace:
            return [head.split(" as ")[0].strip()]
        return [head + tail for part in split(rest.rsplit("}", 1)[0]) if part.strip() for tail in resolve(part)]

    for use in re.findall(r"^\s*use ([^;]+);", text, flags=re.M):
        yield from resolve(" ".join(use.split()))
    # Paths in full, beside the imports.
    yield from re.findall(r"\b((?:crate|super)(?:::\w+)+)", re.sub(r"^\s*(?:pub(?:\([^)]*\))? )?use [^;]+;", "", text, flags=re.M))


def circles():
    faults = 0
    for crate, root in CRATES.items():
        files = {}
        for path in sources(crate):
            parts = path.relative_to(root).with_suffix("").parts
            files[() if parts in {("lib",), ("main",)} else parts[:-1] if parts[-1] == "mod" else parts] = path
        passed_on = {module: reexports(module, path, files) for module, path in files.items()}
        edges = defaultdict(set)
        for module, path in files.items():
            # A folder's face passes on what its files have: that is no use of its own.
            text = re.sub(r"^\s*pub(?:\([^)]*\))? use [^;]+;", "", code(path), flags=re.M)
            for use in used(text):
                steps = use.split("::")
                if steps[0] == "crate":
                    at, steps = (), steps[1:]
                elif steps[0] in {"super", "self"}:
                    at = module
                    while steps and steps[0] in {"super", "self"}:
                        at, steps = (at[:-1], steps[1:]) if steps[0] == "super" else (at, steps[1:])
                elif module + (steps[0],) in files:
                    at = module
                else:
                    continue
                at = resolved(at, steps, files, passed_on)
                if at != module and at in files:
                    edges[module].add(at)
        for circle in strongly_connected(edges):
            names_ = sorted(str(files[module].relative_to(ROOT)) for module in circle)
            if not any(all(one.search(name) for name in names_) for one in ONE):
                faults += 1
                print("circle: " + ", ".join(names_))
    return faults == 0


def reexports(module, path, files):
    """What the file passes on from the files below it: the module of each name."""
    found = {}
    for use in re.findall(r"^\s*pub(?:\([^)]*\))? use ([^;]+);", code(path), flags=re.M):
        for passed in used(f"use {use};"):
            steps = [step for step in passed.split("::") if step != "self"]
            if steps and module + (steps[0],) in files:
                found[steps[-1]] = module + tuple(steps[:-1])
    return found


def resolved(at, steps, files, passed_on):
    """The file in which the last of `steps`, taken from the module `at`, is at home."""
    while steps:
        if at + (steps[0],) in files:
            at = at + (steps[0],)
        elif steps[0] in passed_on.get(at, {}):
            return resolved(passed_on[at][steps[0]], steps[:1], files, passed_on)
        else:
            break
        steps = steps[1:]
    return at


def strongly_connected(edges):
    """Tarjan's components of more than one member."""
    index, low, stack, out = {}, {}, [], []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        for next_ in edges[node]:
            if next_ not in index:
                visit(next_)
            if next_ in stack:
                low[node] = min(low[node], low[next_])
        if low[node] == index[node]:
            circle = []
            while not circle or circle[-1] != node:
                circle.append(stack.pop())
            if len(circle) > 1:
                out.append(circle)

    sys.setrecursionlimit(10_000)
    for node in list(edges):
        if node not in index:
            visit(node)
    return out


def main():
    match sys.argv[1:]:
        case ["lines"]:
            return lines() is None
        case ["names", doc]:
            return names(Path(doc))
        case ["circles"]:
            return circles()
    sys.exit(__doc__)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
