#!/usr/bin/env python3
"""Checks a log with readers that palpate did not write: the Python packages mcap and mcap-protobuf-support.

    ci/check_log.py LOG.mcap [--counts REPORT.json]

Prints the number of messages of each topic as one JSON object. Fails if a message does not decode, if log times within
the file go backwards, if the index counts other messages than the file holds, or if the counts differ from those in
REPORT.json, which is what `palpate timing LOG.mcap --json` prints.
"""

import argparse
import collections
import json
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from verdict import verdict


def read(path):
    """Decodes every message in file order; gives counts by topic and the problems found."""
    counts = collections.Counter()
    problems = []
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        summary = reader.get_summary()
        environments = [m.metadata for m in reader.iter_metadata() if m.name == "environment"]
        if not environments:
            problems.append("no metadata record 'environment'")
        last_time = 0
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            counts[channel.topic] += 1
            if message.log_time < last_time:
                problems.append(f"{channel.topic}: log time {message.log_time} after {last_time}")
            before, last_time = last_time, message.log_time
            time_ns = getattr(decoded, "time_ns", None)
            time_ns = decoded.scheduled_ns if time_ns is None else time_ns
            epoch_ns = int(environments[-1]["start_unix_ns"]) if environments else 0
            if epoch_ns + time_ns != message.publish_time:
                problems.append(f"{channel.topic}: publish time {message.publish_time} but its message says {time_ns}")
            # A release that took more than a second is logged when it is over.
            if message.log_time != message.publish_time and message.log_time != before:
                problems.append(f"{channel.topic}: log time {message.log_time}, published at {message.publish_time}")
        indexed = {
            summary.channels[channel].topic: count
            for channel, count in summary.statistics.channel_message_counts.items()
        }
        if indexed != dict(counts):
            problems.append(f"the index counts {indexed}, the file holds {dict(counts)}")
    return counts, problems


def compare(counts, report):
    """Gives what differs between the counts and a report of `palpate timing --json`."""
    figures = {"/log": report["events"]["count"]}
    # The one device of most logs is not listed by name.
    for device in report.get("devices") or [report | {"name": ""}]:
        prefix = f"/{device['name']}" if device["name"] else ""
        figures[f"{prefix}/force"] = device["force"]["ticks"]
        figures[f"{prefix}/force_commanded"] = device["limits"]["ticks"]
        figures[f"{prefix}/contact"] = sum(device["contact"].values())
        figures[f"{prefix}/resync"] = device["resyncs"]["count"]
    figures.update({f"/timing/{group['name']}": group["released"] for group in report["groups"]})
    # What the analysis counted and what the reader counted are two figures; both must equal the file's.
    expected = list(figures.items()) + list(report["messages"].items())
    known = {topic for topic, _ in expected}
    return [
        f"{topic}: {counts[topic]} messages, the report says {count}"
        for topic, count in expected
        if counts[topic] != count
    ] + [f"{topic}: not in the report" for topic in counts if topic not in known]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log")
    parser.add_argument("--counts", metavar="REPORT.json")
    arguments = parser.parse_args()
    counts, problems = read(arguments.log)
    if arguments.counts:
        with open(arguments.counts, encoding="utf-8") as stream:
            problems += compare(counts, json.load(stream))
    return verdict(dict(sorted(counts.items())), problems)


if __name__ == "__main__":
    sys.exit(main())
