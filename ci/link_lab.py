#!/usr/bin/env python3
"""Runs both sides of the link in two network namespaces, with delay and loss between them, and compares the force.

    link_lab.py PALPATE OUT [--protocol tcp|tls] [--scenes NAME...] [--models NAME...] [--delays MS...] [--losses PCT...] [--seconds S] [--seed N]

PALPATE is the command with the feature `link`. Needs root, iproute2 and /dev/net/tun. What is between the namespaces is a relay of IP
packets in this program: netem is not in every kernel, and here chance has a seed. For each condition it prints the error of the force (rms,
% of the peak of `full` in virtual time) and the largest change of the force in one tick beyond that of `full`, over the real link and over
the virtual one, as a row of a table in Markdown. Over the virtual link the global model takes so long that its models are as old as they come
as over the real one without loss. OUT is a folder for logs.
"""

import argparse
import csv
import fcntl
import heapq
import json
import math
import os
import random
import select
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NAMES = {"haptic": "10.77.0.1", "global": "10.77.0.2"}
PORT = 7447
PROTOCOLS = ("tcp", "tls")


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def open_tun(name):
    """A TUN device of this name, without a header before its packets."""
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    iff_tun, iff_no_pi, tunsetiff = 0x1, 0x1000, 0x400454CA
    fcntl.ioctl(device, tunsetiff, struct.pack("16sH22x", name.encode(), iff_tun | iff_no_pi))
    return device


class Lab:
    """Two namespaces, and the packets between them."""

    def __init__(self, palpate, out, protocol):
        self.palpate, self.address = palpate, f"{protocol}/{NAMES['global']}:{PORT}"
        self.access = {side: ["--insecure"] for side in NAMES}
        if protocol != "tcp":
            keys = out / "keys"
            shutil.rmtree(keys, ignore_errors=True)
            run(palpate, "link", "keys", keys, "--host", NAMES["global"])
            self.access = {side: ["--config", keys / side / "link.toml"] for side in NAMES}
        self.delay_s, self.loss, self.is_over = 0.0, 0.0, False
        self.seed, self.chance = 1, random.Random(1)
        self.counts = [0, 0]
        self.bytes = [0, 0]
        self.devices = []
        for side, address in NAMES.items():
            name = f"lab-{side}"
            subprocess.run(["ip", "netns", "del", name], capture_output=True)
            run("ip", "netns", "add", name)
            self.devices.append(open_tun(name))
            run("ip", "link", "set", name, "netns", name)
            run("ip", "-n", name, "addr", "add", f"{address}/24", "dev", name)
            run("ip", "-n", name, "link", "set", name, "up")
            run("ip", "-n", name, "link", "set", "lo", "up")
        self.thread = threading.Thread(target=self.relay)
        self.thread.start()

    def relay(self):
        # Late for nobody: below the haptic thread and above everything else.
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
        waiting, number = [], 0
        while not self.is_over:
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                _, _, to, packet = heapq.heappop(waiting)
                try:
                    os.write(self.devices[to], packet)
                except OSError:
                    pass
            timeout = max(0.0, waiting[0][0] - time.monotonic()) if waiting else 0.1
            for device in select.select(self.devices, [], [], timeout)[0]:
                side = self.devices.index(device)
                for _ in range(64):
                    try:
                        packet = os.read(device, 65536)
                    except BlockingIOError:
                        break
                    self.counts[side] += 1
                    self.bytes[side] += len(packet)
                    if self.chance.random() >= self.loss:
                        number += 1
                        heapq.heappush(waiting, (time.monotonic() + self.delay_s, number, 1 - side, packet))

    def inside(self, side, *command):
        command = ["ip", "netns", "exec", f"lab-{side}", *map(str, command)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def serve(self, scene, model):
        """The global side of a scene, once it listens."""
        process = self.inside("global", self.palpate, "serve", scene, "--listen", self.address, "--model", model, *self.access["global"])
        while "listens" not in (line := process.stdout.readline()):
            if not line:
                sys.exit(process.stderr.read())
        return process

    def haptic(self, *command):
        """The haptic side: `palpate run` with these arguments, over the link."""
        return self.inside("haptic", self.palpate, *command, "--global", self.address, *self.access["haptic"])

    def record(self, path, model, link, seconds, out):
        """The log of a run of a scene over a link of this delay (ms) and loss (%); None where it failed."""
        self.delay_s, self.loss = 0.0, 0.0
        serve = self.serve(path, model)
        self.delay_s, self.loss, self.chance = link[0] / 1e3, link[1] / 100, random.Random(self.seed)
        log = out / f"{path.stem}-{model}-{link[0]:g}-{link[1]:g}.mcap"
        haptic = self.haptic("run", path, "--model", model, "--duration", seconds, "--out", log)
        _, said = haptic.communicate(timeout=120)
        serve.send_signal(signal.SIGINT)
        serve.communicate(timeout=60)
        if haptic.returncode != 0:
            print(said.strip(), file=sys.stderr)
            return None
        return log

    def plug(self, side, is_in):
        """Puts the cable of a side in, or pulls it."""
        run("ip", "-n", f"lab-{side}", "link", "set", f"lab-{side}", "up" if is_in else "down")

    def passed(self):
        """Packets to the global and to the haptic side since the beginning, then bytes."""
        return [*self.counts, *self.bytes]

    def close(self):
        self.is_over = True
        self.thread.join()
        for side in NAMES:
            subprocess.run(["ip", "netns", "del", f"lab-{side}"], capture_output=True)


def forces(palpate, log):
    """Tick -> computed force (N)."""
    table = log.with_suffix(".csv")
    run(palpate, "export", log, "--topic", "/force", "--out", table)
    found = {}
    with table.open() as lines:
        for row in csv.DictReader(lines):
            found[round(1e3 * float(row["t_s"]))] = tuple(float(row[f"f{axis}_n"]) for axis in "xyz")
    return found


def age_ms(palpate, log):
    """How old a local model is as it comes, as a rule (ms)."""
    return 1e-6 * json.loads(run(palpate, "timing", log, "--json"))["figures"]["resync.age.p50"]


def commanded(palpate, log):
    """Time (s) and size of each command (N)."""
    table = log.with_suffix(".csv")
    run(palpate, "export", log, "--topic", "/force_commanded", "--out", table)
    with table.open() as lines:
        rows = [[float(row[key]) for key in ("t_s", "fx_n", "fy_n", "fz_n")] for row in csv.DictReader(lines)]
    return [(t_s, math.hypot(*force)) for t_s, *force in rows]


def error(found, truth):
    """(rms, jump) in % of the peak of `truth`."""
    norm = lambda force: math.sqrt(sum(part * part for part in force))
    minus = lambda a, b: tuple(x - y for x, y in zip(a, b))
    peak = max(map(norm, truth.values()))
    both = [tick for tick in truth if tick in found]
    squares = sum(norm(minus(found[tick], truth[tick])) ** 2 for tick in both) / len(both)
    steps = lambda of: max(norm(minus(of[tick], of[tick - 1])) for tick in both if tick - 1 in of)
    return 100 * math.sqrt(squares) / peak, max(0.0, 100 * (steps(found) - steps(truth)) / peak)


def scene_of(name, out, link=None, latency_ms=0, seed=1):
    """The scene with paths that hold elsewhere, and with a simulated link and results that are so late without one."""
    text = (ROOT / "scenes" / f"{name}.toml").read_text()
    text = text.replace('"paths/', f'"{ROOT}/scenes/paths/').replace('"meshes/', f'"{ROOT}/scenes/meshes/')
    own = ("feedback", "compute_latency_ms") if link else ("feedback",)
    lines = [line for line in text.splitlines() if not line.startswith(own)]
    if link:
        place = next(place for place, line in enumerate(lines) if line.startswith("[global]"))
        lines.insert(place + 1, f"compute_latency_ms = {latency_ms}")
        lines += ["[link]", f"delay_ms = {link[0]}", f"loss = {link[1] / 100}", "tcp = true", f"seed = {seed}"]
    path = out / f"{name}{'-link' if link else ''}.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def simulate(palpate, out, scene, model, link, latency_ms, seed, seconds):
    """The log of a run over a virtual link."""
    log = out / f"{scene}-{model}-{link[0]:g}-{link[1]:g}-virtual.mcap"
    path = scene_of(scene, out, link, latency_ms, seed)
    run(palpate, "run", path, "--virtual", "--model", model, "--duration", seconds, "--out", log)
    return log


def global_takes_ms(palpate, out, scene, model, delay, log, seconds):
    """How long the global model takes over the virtual link, for models as old as those of `log`, which came over the real one."""
    real_ms = age_ms(palpate, log)
    takes_ms = max(0.0, real_ms - 2 * delay)
    # A model also has to catch up before it serves, and a bridge passes on at its next tick what comes between two.
    virtual_ms = age_ms(palpate, simulate(palpate, out, scene, model, (delay, 0), takes_ms, 1, seconds))
    return max(0.0, takes_ms + real_ms - virtual_ms)


def figure(value):
    return "0" if value == 0 else f"{value:.2g}" if value < 1 else f"{value:.3g}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("palpate", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--protocol", choices=PROTOCOLS, default="tcp")
    parser.add_argument("--scenes", nargs="*", default=["drag_friction", "hand", "demo", "liver"])
    parser.add_argument("--models", nargs="*", default=["predictive", "patch", "hold"])
    parser.add_argument("--delays", nargs="*", type=float, default=[0, 1, 5, 14, 33, 100])
    parser.add_argument("--losses", nargs="*", type=float, default=[0, 1, 5])
    parser.add_argument("--seconds", type=float, default=1.5)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    palpate, out, seconds = args.palpate.resolve(), args.out.resolve(), str(args.seconds)
    lab = Lab(palpate, out, args.protocol)
    lab.seed = args.seed
    try:
        for scene in args.scenes:
            path = scene_of(scene, out)
            full = out / f"{scene}-full.mcap"
            run(palpate, "run", path, "--virtual", "--model", "full", "--duration", seconds, "--out", full)
            truth = forces(palpate, full)
            print(f"\n### `{scene}`\n")
            heads = [f"`{model}` {what}" for model in args.models for what in ("rms %", "virtual", "jump %", "virtual")]
            print("| delay ms | loss % | " + " | ".join(heads) + " |")
            print("| ---: " * (len(heads) + 2) + "|")
            for delay in args.delays:
                takes_ms = {}
                for model in args.models:
                    log = lab.record(path, model, (delay, 0), seconds, out)
                    takes_ms[model] = global_takes_ms(palpate, out, scene, model, delay, log, seconds) if log else 0.0
                for loss in args.losses:
                    cells = [f"{delay:g}", f"{loss:g}"]
                    for model in args.models:
                        log = lab.record(path, model, (delay, loss), seconds, out)
                        simulated = simulate(palpate, out, scene, model, (delay, loss), takes_ms[model], args.seed, seconds)
                        there = error(forces(palpate, simulated), truth)
                        here = error(forces(palpate, log), truth) if log else None
                        for place in (0, 1):
                            cells += [figure(here[place]) if here else "-", figure(there[place])]
                    print("| " + " | ".join(cells) + " |", flush=True)
    finally:
        lab.close()


if __name__ == "__main__":
    main()
