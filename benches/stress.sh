#!/usr/bin/env bash
# The demo's scene in real time beside a load that fills every core: is every record there, every period accounted for, and
# is there a cause for every slip and every missed deadline?
#
#     benches/stress.sh [SECONDS]     600 if left out; needs stress-ng and python3; PALPATE=PROGRAM runs that one
#
# Lateness under such a load is the machine's; what is checked here is that the books tell it exactly.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=${1:-600}
target=${CARGO_TARGET_DIR:-$PWD/target}
if [ -z "${PALPATE:-}" ]; then
    cargo build --locked --release -p palpate-cli
    PALPATE=$target/release/palpate
fi
folder=$(mktemp -d)
stress=
cleanup() {
    [ -z "$stress" ] || kill "$stress" 2>/dev/null || true
    rm -rf "$folder"
}
trap cleanup EXIT

# The demo's tool path, over and over: it ends above the body where it began.
python3 - "$seconds" "$folder" <<'PYTHON'
import csv, pathlib, sys

seconds, folder = float(sys.argv[1]), pathlib.Path(sys.argv[2])
rows = list(csv.reader(open("scenes/paths/demo.csv")))
header, samples = rows[0], [[float(x) for x in row] for row in rows[1:]]
length = samples[-1][0] + 0.2
with open(folder / "path.csv", "w", newline="") as file:
    writer = csv.writer(file)
    writer.writerow(header)
    for turn in range(int(seconds / length) + 1):
        writer.writerows([turn * length + sample[0], *sample[1:]] for sample in samples)
scene = pathlib.Path("scenes/demo.toml").read_text().replace("paths/demo.csv", "path.csv")
(folder / "scene.toml").write_text(scene)
PYTHON

cores=$(nproc)
stress-ng --cpu "$cores" --vm "$cores" --vm-bytes 128M --hdd 1 --hdd-bytes 64M --temp-path "$folder" \
    --timeout "$((seconds + 30))s" --quiet &
stress=$!
"$PALPATE" run "$folder/scene.toml" --duration "$seconds" --out "$folder/run.mcap" | tee "$folder/report.txt"
kill "$stress" 2>/dev/null || true
wait "$stress" 2>/dev/null || true
stress=
"$PALPATE" timing "$folder/run.mcap" --json >"$folder/timing.json"

python3 - "$folder/timing.json" <<'PYTHON'
import json, sys

report = json.load(open(sys.argv[1]))
wrong = []
print()
print("| group | released | skipped | elapsed periods | skipped by cause | missed | missed by cause |")
print("| --- | ---: | ---: | ---: | --- | ---: | --- |")
for group in report["groups"]:
    causes = {
        kind: {name: count for name, count in group[f"{kind}_by_cause"].items() if count}
        for kind in ("skipped", "missed")
    }
    text = {kind: ", ".join(f"{n} {name}" for name, n in found.items()) or "-" for kind, found in causes.items()}
    print(f"| {group['name']} | {group['released']} | {group['skipped']} | {group['elapsed_periods']} "
          f"| {text['skipped']} | {group['missed']} | {text['missed']} |")
    if group["released"] + group["skipped"] != group["elapsed_periods"]:
        wrong.append(f"{group['name']}: released + skipped is not the elapsed periods")
    for kind, found in causes.items():
        if sum(found.values()) != group[kind] or found.get("none"):
            wrong.append(f"{group['name']}: {kind} without a cause: {found} of {group[kind]}")
lost = report["lost_records"]
print(f"\nlost records: {lost}")
if lost:
    wrong.append(f"{lost} records were lost")
print("\n".join(wrong) if wrong else "every period and every missed deadline is accounted for")
sys.exit(bool(wrong))
PYTHON
