#!/usr/bin/env bash
# Logs open with readers that palpate did not write, and their message counts are those that the run reports; what viewers know
# by name is what its publisher says; the ready-made layouts name what is there. Rerun, which is large, has its own job: viewers.
# What is exported from them is checked by such readers too; Parquet, which takes a minute to build, has its own job.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
palpate="$CARGO_TARGET_DIR/debug/palpate"

python_venv ci "mcap, mcap_protobuf, foxglove_schemas_protobuf, numpy" mcap mcap-protobuf-support foxglove-schemas-protobuf numpy

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
check() {
    local name=$1
    shift
    "$palpate" run "$@" --out "$folder/$name.mcap" >/dev/null
    "$palpate" timing "$folder/$name.mcap" --json >"$folder/$name.json"
    echo -n "$name: "
    "$venv/bin/python" ci/check_log.py "$folder/$name.mcap" --counts "$folder/$name.json"
}
check virtual scenes/drag_friction.toml --virtual --duration 1
check probe scenes/wave_probe.toml --virtual --duration 0.5
check full scenes/hand.toml --virtual --model full --duration 0.3
check real_time scenes/demo.toml --duration 3
check scene scenes/device_faults.toml --virtual --log-scene --duration 1.5
check real_time_scene scenes/demo.toml --log-scene --duration 2
check full_scene scenes/hand.toml --virtual --model full --log-scene --duration 0.3
check two_devices scenes/two_hands.toml --virtual --model patch --log-scene --duration 0.5

foxglove() {
    local name=$1
    shift
    echo -n "foxglove, $name: "
    "$venv/bin/python" ci/check_foxglove.py "$folder/$name.mcap" --expect "$@"
}
foxglove real_time /tool
foxglove scene /tool /log /scene
foxglove real_time_scene /tool /scene
foxglove full_scene /tool /scene
foxglove two_devices /left/tool /right/tool /scene

echo -n "layouts: "
"$venv/bin/python" ci/check_layouts.py "$folder/real_time_scene.mcap" examples/layouts/*

# Percentiles equal those that are computed from all samples anew; another program's timing is read as well.
for name in virtual real_time; do
    echo -n "percentiles, $name: "
    "$venv/bin/python" ci/check_timing.py exact "$folder/$name.mcap" "$folder/$name.json"
done
"$venv/bin/python" ci/check_timing.py write "$folder/robot.mcap"
"$palpate" timing "$folder/robot.mcap" --json >"$folder/robot.json"
echo -n "percentiles, another program's log: "
"$venv/bin/python" ci/check_timing.py foreign "$folder/robot.mcap" "$folder/robot.json"

export_of() {
    local name=$1
    shift
    "$palpate" export "$folder/$name.mcap" "$@"
}
check_export() { "$venv/bin/python" ci/check_exports.py "$@"; }
# The log, and its rate groups besides those that every session has.
check_exports() {
    local name=$1 topic group figure groups timings=()
    groups=(local global logger "${@:2}")
    for group in "${groups[@]}"; do
        timings+=(--timing "$group=$folder/$name/timing/$group.csv")
    done
    for topic in force contact resync global ports tool "${groups[@]/#/timing/}"; do
        mkdir -p "$folder/$name/timing"
        export_of "$name" --topic "/$topic" --out "$folder/$name/$topic.csv"
    done
    for group in local global; do
        for figure in lateness execution period-error jitter; do
            export_of "$name" --format hgrm --group $group --figure $figure --out "$folder/$name/$figure.hgrm"
            echo -n "$name $group "
            check_export hgrm "$folder/$name/timing/$group.csv" $figure "$folder/$name/$figure.hgrm"
        done
    done
    export_of "$name" --format chrome-trace --out "$folder/$name/trace.json"
    echo -n "$name trace: "
    check_export trace "$folder/$name/trace.json" --force "$folder/$name/force.csv" --resync "$folder/$name/resync.csv" \
        "${timings[@]}"
}
check_exports virtual
check_exports real_time basis
