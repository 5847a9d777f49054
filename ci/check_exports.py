#!/usr/bin/env python3
"""Checks the exports of a log with programs that palpate did not write.

    ci/check_exports.py parquet TABLE.csv TABLE.parquet
    ci/check_exports.py hgrm TIMING.csv FIGURE FILE.hgrm
    ci/check_exports.py trace TRACE.json --timing GROUP=TIMING.csv ... --force FORCE.csv [--overlapping]

parquet: pyarrow reads the file; every value equals the CSV's, doubles bit for bit. hgrm: every line equals what numpy
computes from the CSV of the same releases, on the percentile axis of HdrHistogram. trace: the Trace Event Format's rules
(slices of a track apart or nested, each flow one `s`, `t` and `f` in the order of time and inside a slice), and every
slice and counter equals the CSVs, to the nanosecond and to the last bit.
"""

import argparse
import bisect
import collections
import csv
import json
import math
import struct
import sys
from decimal import Decimal

import numpy


def rows(path):
    """The header and the rows of a CSV as text."""
    with open(path, newline="", encoding="utf-8") as stream:
        table = list(csv.reader(stream))
    return table[0], table[1:]


def check_parquet(arguments):
    import pyarrow
    import pyarrow.parquet

    names, table = rows(arguments.csv)
    read = pyarrow.parquet.read_table(arguments.parquet)
    assert read.column_names == names, f"columns {read.column_names}, not {names}"
    assert read.num_rows == len(table), f"{read.num_rows} rows, not {len(table)}"
    bits = {pyarrow.float64(): "<d", pyarrow.float32(): "<f"}
    for place, name in enumerate(names):
        column, kind = read.column(place), read.schema.field(place).type
        for number, (value, row) in enumerate(zip(column.to_pylist(), table)):
            cell = row[place]
            if kind in bits:
                same = struct.pack(bits[kind], value) == struct.pack(bits[kind], float(cell))
            elif kind in (pyarrow.uint32(), pyarrow.uint64()):
                same = value == (int(cell) if cell else None)
            else:
                assert kind == pyarrow.string(), f"{name}: unexpected type {kind}"
                same = value == cell
            assert same, f"row {number}, {name}: {value!r} in the Parquet file, {cell!r} in the CSV"
    units = [str(read.schema.field(name).type) for name in names]
    return f"{len(table)} rows, {', '.join(f'{n}:{u}' for n, u in zip(names, units))}"


def durations(path, figure):
    """A figure of every release (ns), from the CSV of its group."""
    names, table = rows(path)
    columns = {name: place for place, name in enumerate(names)}
    of = {name: numpy.array([int(row[columns[name]]) for row in table], dtype=numpy.int64)
          for name in ("scheduled_ns", "woke_ns", "start_ns", "end_ns")}
    periods = numpy.diff(of["woke_ns"])
    return {
        "lateness": of["woke_ns"] - of["scheduled_ns"],
        "execution": of["end_ns"] - of["start_ns"],
        "period-error": numpy.abs(periods - numpy.diff(of["scheduled_ns"])),
        "jitter": numpy.abs(numpy.diff(periods - numpy.diff(of["scheduled_ns"]))),
    }[figure]


def levels():
    """The percentile axis of HdrHistogram's PercentileIterator with five ticks per half distance, in percent."""
    level = 0.0
    while True:
        yield level
        level += 100.0 / (5 * 2 ** (int(math.log(100.0 / (100.0 - level)) / math.log(2)) + 1))


def check_hgrm(arguments):
    values = numpy.sort(durations(arguments.csv, arguments.figure))
    total = len(values)
    with open(arguments.hgrm, encoding="utf-8") as stream:
        lines = stream.read().splitlines()
    assert lines[0] == "%12s %14s %10s %14s" % ("Value", "Percentile", "TotalCount", "1/(1-Percentile)")
    assert lines[1] == ""
    expected = []
    for level in levels():
        # The smallest value that reaches the level, and how many do not exceed it.
        value = values[max(1, math.ceil(Decimal(level) * total / 100)) - 1]
        count = int(numpy.searchsorted(values, value, side="right"))
        expected.append("%12.3f %2.12f %10d %14.2f" % (value / 1e3, level / 100, count, 1 / (1 - level / 100)))
        if count == total:
            break
    expected.append("%12.3f %2.12f %10d" % (values[-1] / 1e3, 1.0, total))
    got = [line for line in lines[2:] if not line.startswith("#")]
    assert len(got) == len(expected), f"{len(got)} lines, not {len(expected)}"
    for one, other in zip(got, expected):
        assert one == other, f"{one!r}, not {other!r}"
    trailer = {key.strip(): float(number) for line in lines if line.startswith("#[")
               for key, number in (part.split("=") for part in line[2:-1].split(","))}
    for key, number in [("Mean", values.mean() / 1e3), ("StdDeviation", values.std() / 1e3), ("Max", values[-1] / 1e3)]:
        assert abs(trailer[key] - number) <= 0.00051 + 1e-9 * number, f"{key}: {trailer[key]}, not {number}"
    assert trailer["Total count"] == total
    return f"{arguments.figure}: {total} samples, {len(got)} lines, p50 {values[(total + 1) // 2 - 1] / 1e3} us"


def nanoseconds(microseconds):
    """A time of the trace as whole nanoseconds."""
    exact = microseconds * 1000
    assert exact == exact.to_integral_value() and exact >= 0, f"{microseconds} us is no whole number of ns"
    return int(exact)


def check_nesting(slices):
    """Slices of each track are apart or inside each other."""
    for track, spans in slices.items():
        open_until = []
        for start, end, _ in sorted(spans, key=lambda span: (span[0], -span[1])):
            while open_until and open_until[-1] <= start:
                open_until.pop()
            assert not open_until or end <= open_until[-1], f"track {track}: a slice from {start} to {end} ns overlaps"
            open_until.append(end)


def check_flows(flows, slices):
    """Each flow goes once from sample over model to force, forward in time, from slice to slice."""
    # What lies in any slice of a track: the outermost ones, which are apart.
    covered = {}
    for track, spans in slices.items():
        outermost = []
        for start, end, _ in sorted(spans, key=lambda span: (span[0], -span[1])):
            if not outermost or start >= outermost[-1][1]:
                outermost.append((start, end))
        covered[track] = outermost
    for identity, stations in flows.items():
        assert [phase for phase, _, _ in stations] == ["s", "t", "f"], f"flow {identity}: {stations}"
        times = [time for _, _, time in stations]
        assert times == sorted(times), f"flow {identity} goes back in time: {times}"
        for phase, track, time in stations:
            place = bisect.bisect_right(covered[track], (time, math.inf)) - 1
            inside = place >= 0 and time <= covered[track][place][1]
            assert inside, f"flow {identity}: its {phase} at {time} ns is in no slice of track {track}"
        (_, read, _), (_, built, _), (_, served, _) = stations
        assert read // 1000 == served // 1000 != built // 1000, f"flow {identity}: tracks {read}, {built}, {served}"


def check_trace(arguments):
    with open(arguments.trace, encoding="utf-8") as stream:
        trace = json.load(stream, parse_float=Decimal)
    names, order, slices, counters = {}, {}, collections.defaultdict(list), collections.defaultdict(list)
    flows, instants, served = collections.defaultdict(list), collections.Counter(), []
    for event in trace["traceEvents"]:
        phase, track = event["ph"], event["tid"]
        assert event["pid"] == 1 and isinstance(event["name"], str)
        if phase == "M":
            names.update({track: event["args"]["name"]} if event["name"] == "thread_name" else {})
            order.update({track: event["args"]["sort_index"]} if event["name"] == "thread_sort_index" else {})
            continue
        time = nanoseconds(event["ts"])
        if phase == "X":
            slices[track].append((time, time + nanoseconds(event["dur"]), event["args"]))
        elif phase == "C":
            counters[event["name"]] += [(time, value) for value in event["args"].values()]
        elif phase == "i":
            assert event["s"] in ("t", "p", "g")
            instants[event["cat"]] += int(event["args"].get("slips", 1))
            served += [event["args"]["model_version"]] if event["cat"] == "force" and event["s"] == "t" else []
        else:
            assert phase in ("s", "t", "f"), f"an event of phase {phase}"
            assert event["cat"] == "flow" and event["bp"] == "e"
            flows[event["id"]].append((phase, track, time))
    assert set(slices) == set(names) == set(order), "a track without a name or a place"
    check_nesting(slices)
    check_flows(flows, slices)

    rates, slips, misses = [], 0, 0
    for group, path in (pair.split("=", 1) for pair in arguments.timing):
        header, table = rows(path)
        releases = [dict(zip(header, row)) for row in table]
        mine = [track for track, name in names.items() if name.split(" (")[0] == group]
        assert mine and (len(mine) == 1 or arguments.overlapping), f"{group}: tracks {mine}"
        drawn = sorted((s for track in mine for s in slices.pop(track) if "scheduled_us" in s[2]), key=lambda s: s[2]["tick"])
        assert len(drawn) == len(releases), f"{group}: {len(drawn)} slices, {len(releases)} releases"
        for (start, end, args), release in zip(drawn, releases):
            expected = {key: int(release[f"{key}_ns"]) for key in ("start", "end", "scheduled", "woke", "deadline")}
            missed = expected["end"] > expected["deadline"]
            assert (start, end) == (expected["start"], expected["end"]), f"{group}: {start}..{end}, not {release}"
            assert args["tick"] == int(release["tick"]) and args["slips"] == int(release["slips"])
            assert args["cause"] == release["cause"] and args["missed"] == missed and args["mode"] == release["mode"]
            assert nanoseconds(args["scheduled_us"]) == expected["scheduled"]
            assert nanoseconds(args["lateness_us"]) == max(0, expected["woke"] - expected["scheduled"])
            slips, misses = slips + int(release["slips"]), misses + missed
        # Of these logs the deadline of a release is the period after it; of a group that skips most, no two releases need be a period apart.
        period = min(int(release["deadline_ns"]) - int(release["scheduled_ns"]) for release in releases)
        rates.append((min(order[track] for track in mine), period))
    assert not slices, f"tracks of no group: {[names[track] for track in slices]}"
    assert [period for _, period in sorted(rates)] == sorted(period for _, period in rates), "not sorted by rate"
    assert (instants["slip"], instants["miss"]) == (slips, misses), f"{instants}, not {slips} slips, {misses} misses"

    _, forces = rows(arguments.force)
    drawn = counters["|force| (N)"]
    assert len(drawn) == len(forces) == len(counters["model age (s)"])
    for (time, value), row in zip(drawn, forces):
        t_s, x, y, z = map(float, row[:4])
        assert time / 1e9 == t_s and float(value) == math.sqrt(x * x + y * y + z * z), f"{time}: {value}, not {row}"
    # The model of the last resync may have given no force any more; the blend into another may not have ended.
    header, table = rows(arguments.resync)
    resyncs = [int(row[header.index("version")]) for row in table]
    assert resyncs and set(resyncs[:-1]) <= set(served) and len(served) == len(flows), f"{served}, not {resyncs}"
    return f"{len(trace['traceEvents'])} events, {len(names)} tracks, {len(flows)} flows, {slips} slips, {misses} misses"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    formats = parser.add_subparsers(required=True)
    parquet = formats.add_parser("parquet")
    parquet.add_argument("csv")
    parquet.add_argument("parquet")
    parquet.set_defaults(check=check_parquet)
    hgrm = formats.add_parser("hgrm")
    hgrm.add_argument("csv")
    hgrm.add_argument("figure")
    hgrm.add_argument("hgrm")
    hgrm.set_defaults(check=check_hgrm)
    trace = formats.add_parser("trace")
    trace.add_argument("trace")
    trace.add_argument("--timing", action="append", default=[], metavar="GROUP=CSV")
    trace.add_argument("--force", required=True)
    trace.add_argument("--resync", required=True)
    trace.add_argument("--overlapping", action="store_true")
    trace.set_defaults(check=check_trace)
    arguments = parser.parse_args()
    try:
        print(arguments.check(arguments))
    except AssertionError as problem:
        print(f"{sys.argv[1]}: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
