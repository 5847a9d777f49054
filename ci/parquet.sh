#!/usr/bin/env bash
# Parquet files hold what the CSVs of the same topics hold, as pyarrow reads them.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
# With the Parquet writer, which is not among the default members of the workspace: its crate takes a minute to build. All
# together, so that no shared dependency is compiled with a second set of features.
cargo build --locked --profile test --workspace --bins --examples
need_component clippy clippy
cargo clippy --locked -p palpate-parquet --all-targets -- -D warnings
palpate="$CARGO_TARGET_DIR/debug/palpate"

python_venv parquet "numpy, pyarrow" numpy pyarrow

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
check() {
    local name=$1 topic
    shift
    "$palpate" run "$@" --out "$folder/$name.mcap" >/dev/null
    for topic in force contact resync global ports tool timing/local timing/global timing/logger; do
        mkdir -p "$folder/$name/timing"
        "$palpate" export "$folder/$name.mcap" --topic "/$topic" --out "$folder/$name/$topic.csv"
        "$palpate-parquet" "$folder/$name.mcap" --topic "/$topic" --out "$folder/$name/$topic.parquet"
        echo -n "$name /$topic: "
        "$venv/bin/python" ci/check_exports.py parquet "$folder/$name/$topic.csv" "$folder/$name/$topic.parquet"
    done
}
check virtual scenes/drag_friction.toml --virtual --duration 1
check real_time scenes/demo.toml --duration 2
