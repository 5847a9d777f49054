#!/usr/bin/env python3
"""What a real line does to both sides of the link: a cable that is pulled, minutes of loss, and what the link costs.

    link_trials.py PALPATE OUT [--protocol tcp|tls] cable [--turns N] [--least S] [--most S] [--sides haptic global]   the cable of a side is out, for as long
                                                                         as chance will
    link_trials.py PALPATE OUT soak [--seconds S] [--delay MS] [--loss PCT]   memory of both sides, minute by minute
    link_trials.py PALPATE OUT cost [--rounds N] [--seconds S]           runs with and without the link in turn
    link_trials.py PALPATE OUT machines [--delays MS...] [--seeds N...] [--nodes N]   two haptic machines, against `full` along the ways that
                                                                         their tools went, which a seed makes

PALPATE is the command with the feature `link`. The two sides are in two network namespaces with a relay between them, as in link_lab.py,
on a scene that presses and strokes a block of 12^3 nodes all the time. Each prints a table in Markdown; all but `cost` fail where the
force or a record is not what it has to be. OUT is a folder for logs.
"""

import argparse
import csv
import itertools
import json
import math
import os
import random
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path

from link_lab import PROTOCOLS, ROOT, Lab, commanded, error, run

MODEL = "predictive"
# The force has come in after the start-up ramp, and the first bases are there.
SETTLED_S = 5.0
# A force of a model older than this is none (`safety.max_age_ms` and `age_fade_ms`).
AGE_LIMIT_S = 0.3
BACK_WITHIN_S = 1.0
# The clock of this program and that of a log are so far apart at most.
CLOCKS_APART_S = 0.05


def scene(out, seconds):
    """Presses within half a second, then strokes until the end."""
    rows = ["t_s,x_m,y_m,z_m"]
    for n in range(int(200 * seconds) + 400):
        t = n / 200
        depth = 0.008 * min(max((t - 0.2) / 0.5, 0.0), 1.0) + 0.001 * math.sin(7 * t)
        rows.append(f"{t:g},{0.047 + 0.008 * math.sin(3 * t):.7f},0.0512,{0.101 - depth:.7f}")
    (out / "strokes.csv").write_text("\n".join(rows) + "\n")
    text = (ROOT / "scenes" / "drag_friction.toml").read_text().replace("paths/drag.csv", "strokes.csv")
    path = out / "strokes.toml"
    path.write_text(text)
    return path


class Sides:
    """Both sides at work over the relay of a lab."""

    def __init__(self, lab, palpate, path, log, seconds):
        run_it = ["run", path, "--model", MODEL, "--duration", seconds, "--out", log]
        self.serve, self.log, self.palpate, self.seconds = lab.serve(path, MODEL), log, palpate, seconds
        self.haptic = lab.haptic(*run_it)
        self.began = time.monotonic()

    def wait_until(self, seconds):
        time.sleep(max(0.0, self.began + seconds - time.monotonic()))
        for side, process in (("haptic", self.haptic), ("global", self.serve)):
            if time.monotonic() < self.began + self.seconds and process.poll() is not None:
                sys.exit(f"the {side} side ended with {process.returncode}: {''.join(process.communicate())}")

    def end(self):
        """What `palpate timing` says of the log."""
        _, said = self.haptic.communicate(timeout=60)
        self.serve.send_signal(signal.SIGINT)
        self.serve.communicate(timeout=60)
        if self.haptic.returncode != 0:
            sys.exit(said)
        return timing(self.palpate, self.log)


def timing(palpate, log):
    return json.loads(run(palpate, "timing", log, "--json"))


def lost_records(report):
    return sum(value for name, value in report["figures"].items() if name.endswith(".lost_records"))


def cable(lab, palpate, out, args):
    path = scene(out, 60)
    print("| cable of | out at (s) | for (s) | last force after (ms) | force back after (ms) | lost records |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    is_good, chance = True, random.Random(1)
    for turn in range(args.turns):
        for side in args.sides:
            out_at = SETTLED_S + chance.random()
            back_at = out_at + chance.uniform(args.least, args.most)
            log = out / f"cable-{side}-{turn}.mcap"
            sides = Sides(lab, palpate, path, log, back_at + 3)
            sides.wait_until(out_at)
            pulled = time.time_ns()
            lab.plug(side, False)
            sides.wait_until(back_at)
            plugged = time.time_ns()
            lab.plug(side, True)
            report = sides.end()
            start = report["environment"]["start_unix_ns"]
            pulled, plugged = 1e-9 * (pulled - start), 1e-9 * (plugged - start)
            felt = commanded(palpate, log)
            before = max(force for t, force in felt if pulled - 1 < t < pulled)
            last = max(t for t, force in felt if t < plugged - CLOCKS_APART_S and force > 0)
            first = min((t for t, force in felt if t > plugged and force > 0), default=math.inf)
            lost = lost_records(report)
            # A model that came at the last moment is as old as its way was long.
            is_good &= before > 0.1 and last <= pulled + AGE_LIMIT_S + 0.001 and first <= plugged + BACK_WITHIN_S and lost == 0
            print(f"| {side} | {pulled:.2f} | {plugged - pulled:.2f} | {1e3 * (last - pulled):.0f} | {1e3 * (first - plugged):.0f} | {lost} |", flush=True)
    return is_good


def resident_mb(process):
    fields = Path(f"/proc/{process.pid}/status").read_text()
    return next(int(line.split()[1]) for line in fields.splitlines() if line.startswith("VmRSS")) / 1024


def soak(lab, palpate, out, args):
    lab.delay_s, lab.loss = args.delay / 1e3, args.loss / 100
    log = out / "soak.mcap"
    sides = Sides(lab, palpate, scene(out, args.seconds), log, args.seconds)
    print("| after (s) | haptic side (MB) | global side (MB) |")
    print("| ---: | ---: | ---: |")
    memory, step = [], max(1, min(60, int(args.seconds / 10)))
    for second in range(step, int(args.seconds), step):
        sides.wait_until(second)
        memory.append((resident_mb(sides.haptic), resident_mb(sides.serve)))
        print(f"| {second} | {memory[-1][0]:.1f} | {memory[-1][1]:.1f} |", flush=True)
    sides.wait_until(args.seconds)
    report = sides.end()
    silent = longest_gap(commanded(palpate, log))
    print(f"\nlongest time without force after the first {SETTLED_S:g} s: {1e3 * silent:.0f} ms; lost records: {lost_records(report)}")
    # By half of the time both have all that they ever have.
    growth = [max(later) - max(earlier) for earlier, later in zip(*halves(memory))]
    print(f"the second half has {growth[0]:+.1f} and {growth[1]:+.1f} MB over the first")
    return lost_records(report) == 0 and max(growth) < 5


def halves(memory):
    middle = len(memory) // 2
    return [list(zip(*part)) for part in (memory[:middle], memory[middle:])]


def longest_gap(felt):
    gap = since = 0.0
    for t, force in felt:
        if force > 0 or t < SETTLED_S:
            since = t
        gap = max(gap, t - since)
    return gap


def cpu_s(process):
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def cost(lab, palpate, out, args):
    path = scene(out, args.seconds)
    found = {}
    for turn in range(args.rounds):
        for name in ("alone", "linked") if turn % 2 else ("linked", "alone"):
            log = out / f"cost-{name}.mcap"
            if name == "linked":
                sides = Sides(lab, palpate, path, log, args.seconds)
                processes = [sides.haptic, sides.serve]
            else:
                processes = [lab.inside("haptic", palpate, "run", path, "--model", MODEL, "--duration", args.seconds, "--out", log)]
            time.sleep(SETTLED_S)
            before, sent, began = [cpu_s(process) for process in processes], lab.passed(), time.monotonic()
            time.sleep(args.seconds - SETTLED_S - 1)
            took = time.monotonic() - began
            used = [100 * (cpu_s(process) - at) / took for process, at in zip(processes, before)]
            rates = [(now - then) / took for now, then in zip(lab.passed(), sent)]
            report = sides.end() if name == "linked" else (processes[0].communicate(), timing(palpate, log))[1]
            figures = report["figures"]
            row = {
                "CPU of the haptic side (% of a core)": used[0],
                "lateness of the haptic tick, p50 (us)": figures["local.lateness.p50"] / 1e3,
                "lateness of the haptic tick, p99 (us)": figures["local.lateness.p99"] / 1e3,
                "haptic tick, p50 (us)": figures["local.execution.p50"] / 1e3,
                "age of the model as it comes, p50 (ms)": figures["resync.age.p50"] / 1e6,
                "age of the model as it comes, p99 (ms)": figures["resync.age.p99"] / 1e6,
            }
            if name == "linked":
                row |= {
                    "CPU of the global side (% of a core)": used[1],
                    "to the global side (packets/s)": rates[0],
                    "to the global side (kB/s)": rates[2] / 1e3,
                    "to the haptic side (packets/s)": rates[1],
                    "to the haptic side (kB/s)": rates[3] / 1e3,
                }
            for figure, value in row.items():
                found.setdefault(figure, {}).setdefault(name, []).append(value)
            print(f"{turn + 1} of {args.rounds}: {name}", file=sys.stderr)
    print(f"| median of {args.rounds} runs of {args.seconds:g} s | without link | over the link |")
    print("| --- | ---: | ---: |")
    for figure, of in found.items():
        cells = [f"{statistics.median(of[name]):.3g}" if name in of else "" for name in ("alone", "linked")]
        print(f"| {figure} | {cells[0]} | {cells[1]} |")
    return True


HANDS = ("left", "right")


def strokes(out, name, rows):
    """A path of rows of (t, x, y, z), in s and m."""
    text = "\n".join(["t_s,x_m,y_m,z_m", *(",".join(f"{number:.7f}" for number in row) for row in rows)])
    (out / f"{name}.csv").write_text(text + "\n")


def two_hands(out, name, nodes):
    """A scene of two tools that follow the paths of that name, on so many nodes per axis."""
    text = (ROOT / "scenes" / "drag_friction.toml").read_text().replace("[12, 12, 12]", str([nodes] * 3))
    device = '[device]\nkind = "scripted"\npath_csv = "paths/drag.csv"\n'
    devices = (f'[[device]]\nname = "{hand}"\nkind = "scripted"\npath_csv = "{name}-{hand}.csv"\n' for hand in HANDS)
    path = out / f"{name}.toml"
    path.write_text(text.replace(device, "\n".join(devices)))
    return path


def table(palpate, log, topic, columns):
    """Tick -> the values of these columns."""
    csv_file = log.with_suffix(".csv")
    run(palpate, "export", log, "--topic", topic, "--out", csv_file)
    with csv_file.open() as lines:
        return {round(1e3 * float(row["t_s"])): tuple(float(row[column]) for column in columns) for row in csv.DictReader(lines)}


def random_ways(out, seed, seconds):
    """Paths of two tools that press into the top and stroke it, each at its own pace."""
    chance = random.Random(seed)
    for hand, middles in zip(HANDS, ((0.03, 0.045), (0.06, 0.075))):
        middle, reach, pace = chance.uniform(*middles), chance.uniform(0.003, 0.009), chance.uniform(1, 6)
        deep, bounce, beat = chance.uniform(0.004, 0.009), chance.uniform(0, 0.002), chance.uniform(3, 12)
        depth = lambda t: deep * min(max((t - 0.5) / 0.5, 0.0), 1.0) + bounce * math.sin(beat * t)
        times = (n / 200 for n in range(int(200 * seconds) + 200))
        strokes(out, f"ways-{hand}", ((t, middle + reach * math.sin(pace * t), 0.0512, 0.102 - depth(t)) for t in times))


def machines(lab, palpate, out, args):
    path = two_hands(out, "ways", args.nodes)
    place, force = [f"{axis}_m" for axis in "xyz"], [f"f{axis}_n" for axis in "xyz"]
    is_good = True
    print("| seed | one way (ms) | tool | force off (rms, %) | largest jump (%) | the other tool off (rms, mm) | model as it comes, p50 (ms) |")
    print("| ---: | ---: | --- | ---: | ---: | ---: | ---: |")
    for seed, delay in itertools.product(args.seeds, args.delays):
        random_ways(out, seed, args.seconds)
        lab.delay_s = 0.0
        serve = lab.serve(path, MODEL)
        lab.delay_s = delay / 1e3
        logs = {hand: out / f"machines-{hand}-{delay:g}.mcap" for hand in HANDS}
        run_it = ["run", path, "--model", MODEL, "--duration", args.seconds]
        sides = [lab.haptic(*run_it, "--device", hand, "--out", log) for hand, log in logs.items()]
        for side in sides:
            _, said = side.communicate(timeout=120)
            if side.returncode != 0:
                sys.exit(said)
        serve.send_signal(signal.SIGINT)
        serve.communicate(timeout=60)
        reports = {hand: timing(palpate, log) for hand, log in logs.items()}
        # Both know how far the clock of the global side is ahead of theirs.
        ahead = {hand: statistics.median(row[0] for row in table(palpate, log, "/link", ["clock_ahead_s"]).values()) for hand, log in logs.items()}
        later = {hand: round(1e3 * (at - min(ahead.values()))) for hand, at in ahead.items()}
        went = {hand: table(palpate, log, f"/{hand}/tool", place) for hand, log in logs.items()}
        for hand, way in went.items():
            first = way[min(way)]
            strokes(out, f"went-{hand}", [(0.0, *first), *((1e-3 * (tick + later[hand]), *at) for tick, at in way.items() if tick + later[hand] > 0)])
        truth = out / "went.mcap"
        run(palpate, "run", two_hands(out, "went", args.nodes), "--virtual", "--model", "full", "--duration", str(args.seconds), "--out", truth)
        for hand, other in zip(HANDS, reversed(HANDS)):
            felt = table(palpate, logs[hand], f"/{hand}/force", force)
            is_full = table(palpate, truth, f"/{hand}/force", force)
            rms, jump = error({tick + later[hand]: value for tick, value in felt.items()}, is_full)
            seen = {tick + later[hand] - later[other]: at for tick, at in table(palpate, logs[hand], f"/{other}/tool", place).items()}
            off = [math.dist(at, went[other][tick]) for tick, at in seen.items() if tick > 500 and tick in went[other]]
            off_mm = 1e3 * math.sqrt(sum(away * away for away in off) / len(off))
            age = reports[hand]["figures"][f"{hand}.resync.age.p50"] / 1e6
            is_good &= delay > 0 or (rms < 3 and off_mm < 0.3)
            print(f"| {seed} | {delay:g} | {hand} | {rms:.2f} | {jump:.2f} | {off_mm:.3f} | {age:.0f} |", flush=True)
    return is_good


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("palpate", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--protocol", choices=PROTOCOLS, default="tcp")
    trials = parser.add_subparsers(dest="trial", required=True)
    of = trials.add_parser("cable")
    of.add_argument("--turns", type=int, default=3)
    # Longer than the force lasts.
    of.add_argument("--least", type=float, default=0.4)
    of.add_argument("--most", type=float, default=10)
    of.add_argument("--sides", nargs="+", choices=("haptic", "global"), default=("haptic", "global"))
    of.set_defaults(run=cable)
    of = trials.add_parser("soak")
    of.add_argument("--seconds", type=float, default=600)
    of.add_argument("--delay", type=float, default=14)
    of.add_argument("--loss", type=float, default=5)
    of.set_defaults(run=soak)
    of = trials.add_parser("cost")
    of.add_argument("--rounds", type=int, default=5)
    of.add_argument("--seconds", type=float, default=15)
    of.set_defaults(run=cost)
    of = trials.add_parser("machines")
    of.add_argument("--delays", type=float, nargs="+", default=[0, 5, 14])
    of.add_argument("--seeds", type=int, nargs="+", default=[1])
    of.add_argument("--nodes", type=int, default=8)
    of.add_argument("--seconds", type=float, default=8)
    of.set_defaults(run=machines)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    palpate, out = args.palpate.resolve(), args.out.resolve()
    lab = Lab(palpate, out, args.protocol)
    try:
        return 0 if args.run(lab, palpate, out, args) else 1
    finally:
        lab.close()


if __name__ == "__main__":
    sys.exit(main())
