#!/usr/bin/env python3
"""Runs test programs while they are stopped again and again, as a host stops its guests: what runs in real time has to bear that.

    stalls.py TIMES NAME...    the test programs with these names, so many times each (`cargo test --no-run` makes them)

Fails if a test does. Another thing that is not served for a while than a process whose threads all stand still, as a machine on which many
work, is what benches/stress.sh is for.
"""

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STOPPED_S = (0.004, 0.025)
RUNNING_S = (0.02, 0.2)


def programs(names):
    """Name, executable and folder of each."""
    made = subprocess.run(
        ["cargo", "test", "--locked", "--no-run", "--message-format", "json"], check=True, stdout=subprocess.PIPE, text=True
    )
    for line in made.stdout.splitlines():
        of = json.loads(line)
        if of.get("executable") and of["profile"]["test"] and of["target"]["name"] in names and "test" in of["target"]["kind"]:
            yield of["target"]["name"], of["executable"], Path(of["manifest_path"]).parent


def run(executable, folder, chance):
    """The exit code, and what it printed."""
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen([executable], cwd=folder, stdout=out, stderr=subprocess.STDOUT)
        while process.poll() is None:
            time.sleep(chance.uniform(*RUNNING_S))
            os.kill(process.pid, signal.SIGSTOP)
            time.sleep(chance.uniform(*STOPPED_S))
            os.kill(process.pid, signal.SIGCONT)
        out.seek(0)
        return process.returncode, out.read().decode(errors="replace")


def main():
    times, names = int(sys.argv[1]), sys.argv[2:]
    chance, failed, met = random.Random(1), 0, set()
    for name, executable, folder in programs(names):
        met.add(name)
        codes = [run(executable, folder, chance) for _ in range(times)]
        for said in (said for code, said in codes if code != 0):
            print(said[said.find("\nfailures:") :])
        fell = sum(code != 0 for code, _ in codes)
        print(f"{name}: fell {fell} of {times} times", flush=True)
        failed += fell
    if missing := set(names) - met:
        sys.exit(f"no such test program: {', '.join(sorted(missing))}")
    sys.exit(failed > 0)


main()
