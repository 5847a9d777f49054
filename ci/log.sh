#!/usr/bin/env bash
# Logs open with readers that palpate did not write, and their message counts are those that the run reports.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
palpate="$CARGO_TARGET_DIR/debug/palpate"

venv="$CARGO_TARGET_DIR/ci-venv"
if [ ! -x "$venv/bin/python" ] || ! "$venv/bin/python" -c 'import mcap, mcap_protobuf' 2>/dev/null; then
    python3 -c 'import venv, ensurepip' 2>/dev/null || install_packages "Python with venv" python3 python3-venv
    python3 -m venv --clear "$venv"
    "$venv/bin/pip" install --quiet mcap mcap-protobuf-support
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
