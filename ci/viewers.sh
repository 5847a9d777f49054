#!/usr/bin/env bash
# Rerun's loader takes a log without a warning, row for row. Its package has 800 MB, installed in some twenty seconds.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
palpate="$CARGO_TARGET_DIR/debug/palpate"

# Its commands and their output are read by name: another version may say it otherwise.
python_venv viewers "mcap, rerun" mcap rerun-sdk==0.41.0

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
check() {
    local name=$1 expected=$2
    shift 2
    "$palpate" run "$@" --out "$folder/$name.mcap" >/dev/null
    echo -n "rerun, $name: "
    # shellcheck disable=SC2086  # A list of topics
    "$venv/bin/python" ci/check_rerun.py "$folder/$name.mcap" --expect $expected
}
check virtual "/tool /force" scenes/drag_friction.toml --virtual --duration 1
check scene "/tool /force /log /scene" scenes/device_faults.toml --virtual --log-scene --duration 1.5
check real_time "/tool /force /scene" scenes/demo.toml --log-scene --duration 2
check two_devices "/left/tool /right/force /scene" scenes/two_hands.toml --virtual --model patch --log-scene --duration 0.5
