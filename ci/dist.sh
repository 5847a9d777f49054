#!/usr/bin/env bash
# The command as others get it: stripped, optimised across crates, below 10 MB. Prints its path and size.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"

readonly MOST_BYTES=10000000

# Crates are optimised together in this last step: for size, as they are alone, it would slow the innermost loops.
cargo rustc --locked --quiet --profile dist -p palpate-cli --bin palpate -- -C opt-level=3
palpate="$CARGO_TARGET_DIR/dist/palpate"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$palpate" run finger --virtual --duration 0.1 --out "$folder/finger.mcap" >/dev/null
bytes=$(stat -c %s "$palpate")
echo "$palpate: $bytes bytes"
if [ "$bytes" -ge "$MOST_BYTES" ]; then
    echo "the command has more than $MOST_BYTES bytes" >&2
    exit 1
fi
