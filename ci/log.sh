#!/usr/bin/env bash
# Logs open with readers that palpate did not write, and their message counts are those that the run reports; what viewers know
# by name is what its publisher says; the ready-made layouts name what is there. Rerun, which is large, has its own job: viewers.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
palpate="$CARGO_TARGET_DIR/debug/palpate"

venv="$CARGO_TARGET_DIR/ci-venv"
if [ ! -x "$venv/bin/python" ] || ! "$venv/bin/python" -c 'import mcap, mcap_protobuf, foxglove_schemas_protobuf' 2>/dev/null; then
    python3 -c 'import venv, ensurepip' 2>/dev/null || install_packages "Python with venv" python3 python3-venv
    python3 -m venv --clear "$venv"
    "$venv/bin/pip" install --quiet mcap mcap-protobuf-support foxglove-schemas-protobuf
fi

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
check real_time scenes/demo.toml --duration 2
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
