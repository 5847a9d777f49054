#!/usr/bin/env bash
# Every example runs to its end within a minute, in an empty folder, without a terminal, a display or hardware.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs

shopt -s nullglob
names=()
for folder in examples src/mesh/examples src/runtime/examples tools/examples haply/examples; do
    for path in "$folder"/*.rs "$folder"/*/main.rs; do
        name=${path#"$folder"/}
        name=${name%/main.rs}
        names+=("${name%.rs}")
    done
done
[ ${#names[@]} -gt 0 ] || { echo "no example found" >&2; exit 1; }

# What differs from the commit; nothing where there is no repository.
changes() {
    git diff 2>/dev/null | cksum
}
before=$(changes)

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for name in "${names[@]}"; do
    mkdir -p "$folder/$name"
    started=$SECONDS
    if (cd "$folder/$name" && timeout 60 "$CARGO_TARGET_DIR/debug/examples/$name" >out.txt 2>&1 </dev/null); then
        echo "example $name: passed in $((SECONDS - started)) s"
    else
        status=$?
        tail -n 40 "$folder/$name/out.txt" >&2
        echo "example $name: FAILED with status $status after $((SECONDS - started)) s (124: did not end)" >&2
        exit 1
    fi
done
# An example that makes committed files must make the same ones again.
if [ "$(changes)" != "$before" ]; then
    echo "an example changed committed files" >&2
    git diff --stat >&2
    exit 1
fi
