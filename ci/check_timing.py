#!/usr/bin/env python3
"""Computes the figures of a log anew and compares them with those of `palpate timing LOG --json`; all must be equal.

    ci/check_timing.py exact LOG.mcap REPORT.json     lateness, execution, period error and jitter of every group, exactly
    ci/check_timing.py write LOG.mcap                 writes the log of another program: one group in JSON, one in protobuf
    ci/check_timing.py foreign LOG.mcap REPORT.json   the same comparison for such a log

Percentiles are nearest-rank, computed by sorting all samples. The log is read with the Python packages mcap and
mcap-protobuf-support, not with palpate.
"""

import collections
import json
import math
import random
import sys

from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

RANKS = {"p50": 0.5, "p90": 0.9, "p99": 0.99, "p999": 0.999, "max": 1.0}


def nearest_rank(values, permille):
    return sorted(values)[max(1, -(-len(values) * permille // 1000)) - 1]


def figures(ticks):
    """The figures of a group from its ticks: dictionaries of integers in nanoseconds."""
    errors = [
        (b["woke_ns"] - a["woke_ns"]) - (b["scheduled_ns"] - a["scheduled_ns"]) for a, b in zip(ticks, ticks[1:])
    ]
    return {
        "lateness": [t["woke_ns"] - t["scheduled_ns"] for t in ticks],
        "execution": [t["end_ns"] - t["start_ns"] for t in ticks],
        "period_error": [abs(e) for e in errors],
        "jitter": [abs(b - a) for a, b in zip(errors, errors[1:])],
    }


def read_groups(path):
    groups = collections.defaultdict(list)
    fields = ["scheduled_ns", "woke_ns", "start_ns", "end_ns", "slips"]
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if not channel.topic.startswith("/timing/"):
                continue
            if channel.message_encoding == "json":
                tick = json.loads(message.data)
            else:
                decoded = DecoderFactory().decoder_for("protobuf", schema)(message.data)
                tick = {field: getattr(decoded, field) for field in fields}
            groups[channel.topic.removeprefix("/timing/")].append(tick)
    return groups


def exact(log, report):
    with open(report, encoding="utf-8") as stream:
        document = json.load(stream)
    compared = 0
    groups = read_groups(log)
    assert groups, "no group in the log"
    for name, ticks in groups.items():
        reported = document["figures"]
        assert reported[f"{name}.released"] == len(ticks), name
        assert reported[f"{name}.skipped"] == sum(t["slips"] for t in ticks), name
        for figure, values in figures(ticks).items():
            assert reported[f"{name}.{figure}.count"] == len(values), (name, figure)
            for which, rank in RANKS.items():
                expected = nearest_rank(values, math.floor(rank * 1000 + 0.5))
                got = reported[f"{name}.{figure}.{which}"]
                assert got == expected, f"{name}.{figure}.{which} is {got}, computed anew it is {expected}"
                compared += 1
    print(json.dumps({"groups": len(groups), "percentiles equal": compared}))


def write(path):
    """Two servo loops of a robot: one logs JSON, the other protobuf with its descriptor."""
    from google.protobuf import descriptor_pb2

    file = descriptor_pb2.FileDescriptorProto(name="robot.proto", package="robot", syntax="proto3")
    message = file.message_type.add(name="LoopTickTiming")
    names = ["scheduled_ns", "woke_ns", "start_ns", "end_ns", "deadline_ns", "slips"]
    for number, name in enumerate(names, 1):
        message.field.add(name=name, number=number, type=4, label=1)
    descriptors = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()

    def varint(value):
        out = bytearray()
        while value > 127:
            out.append(value & 127 | 128)
            value >>= 7
        return bytes(out + bytes([value]))

    def encode(tick):
        return b"".join(varint(n << 3) + varint(tick[name]) for n, name in enumerate(names, 1) if tick[name])

    numbers = random.Random(1)
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("robot.LoopTickTiming", "protobuf", descriptors)
        fast = writer.register_channel("/timing/servo", "json", 0, {"rate_hz": "1000"})
        slow = writer.register_channel("/timing/planner", "protobuf", schema)
        start = 1_790_000_000_000_000_000
        skipped = 0
        for n in range(5000):
            if n in (700, 701, 702):
                skipped += 1
                continue
            tick = make_tick(numbers, start + n * 1_000_000, 1_000_000, skipped)
            skipped = 0
            writer.add_message(fast, tick["woke_ns"], json.dumps(tick).encode(), tick["woke_ns"])
            if n % 20 == 0:
                tick = make_tick(numbers, start + n * 1_000_000, 20_000_000, 0)
                writer.add_message(slow, tick["woke_ns"], encode(tick), tick["woke_ns"])
        writer.finish()


def make_tick(numbers, scheduled, period, slips):
    woke = scheduled + int(numbers.expovariate(1 / 50_000))
    end = woke + 1000 + int(numbers.expovariate(1 / 100_000))
    return {
        "scheduled_ns": scheduled,
        "woke_ns": woke,
        "start_ns": woke + 500,
        "end_ns": end,
        "deadline_ns": scheduled + period,
        "slips": slips,
    }


if __name__ == "__main__":
    {"exact": exact, "foreign": exact, "write": write}[sys.argv[1]](*sys.argv[2:])
