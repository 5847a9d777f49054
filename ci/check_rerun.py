#!/usr/bin/env python3
"""Checks that Rerun's loader (PyPI: rerun-sdk) takes a log without a warning and row for row.

    ci/check_rerun.py LOG.mcap [--expect /tool /force /log /scene]

Converts the log with `rerun mcap convert`, lets `rerun mcap check` and `rerun rrd verify` look at it, and compares the rows of
every entity with the messages of its topic. Prints rows and the components that Rerun made of each topic as one JSON object.
"""

import argparse
import collections
import os
import re
import subprocess
import sys
import tempfile

from mcap.reader import make_reader

from verdict import verdict

ANSI = re.compile(r"\x1b\[[0-9;]*m")
COMPLAINT = re.compile(r"\b(WARN|ERROR)\b|^\s*(error|warning)\b")
CHUNK = re.compile(r"with ([0-9 \u2009\u202f,]+) rows .* - (/\S*) - data columns: \[(.*)\]")


def run(*arguments):
    """The output of a rerun command, and its complaints."""
    command = [os.path.join(os.path.dirname(sys.executable), "rerun"), *arguments]
    environment = dict(os.environ, RUST_LOG="warn", NO_COLOR="1")
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    errors = ANSI.sub("", done.stderr)
    complaints = [line for line in errors.splitlines() if COMPLAINT.search(line)]
    if done.returncode:
        complaints.append(f"rerun {' '.join(arguments[:2])} ended with {done.returncode}")
    return ANSI.sub("", done.stdout), complaints


def convert(log):
    """Gives rows by entity, components by entity, and complaints."""
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "log.rrd")
        # The name: rerun would make one of the path, and warn that it did.
        _, complaints = run("mcap", "convert", "--application-id", "palpate", log, "-o", target)
        checked, more = run("mcap", "check", log)
        complaints += more + [line for line in checked.splitlines() if re.match(r"(warn|error|fail)", line)]
        complaints += run("rrd", "verify", target)[1]
        printed, more = run("rrd", "print", target)
        complaints += more
    rows = collections.Counter()
    components = collections.defaultdict(set)
    for line in printed.splitlines():
        if found := CHUNK.search(line):
            columns = found[3].split()
            # How the topic was declared: once, beside the messages.
            if not all(column.startswith("Mcap") for column in columns):
                rows[found[2]] += int(re.sub(r"\D", "", found[1]))
                components[found[2]].update(columns)
    return rows, components, complaints


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log")
    parser.add_argument("--expect", nargs="*", default=[], metavar="TOPIC")
    arguments = parser.parse_args()
    with open(arguments.log, "rb") as stream:
        summary = make_reader(stream).get_summary()
        counts = summary.statistics.channel_message_counts
        messages = {channel.topic: counts.get(id, 0) for id, channel in summary.channels.items()}
    rows, components, problems = convert(arguments.log)
    problems += [
        f"{topic}: {count} messages, {rows[topic]} rows" for topic, count in messages.items() if rows[topic] != count
    ]
    problems += [f"{topic}: no rows" for topic in arguments.expect if not rows[topic]]
    shown = {topic: [rows[topic], *sorted(components[topic])] for topic in sorted(messages) if rows[topic]}
    return verdict(shown, problems)


if __name__ == "__main__":
    sys.exit(main())
