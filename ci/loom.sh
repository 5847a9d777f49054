#!/usr/bin/env bash
# The lock-free exchange and ring, and the flags that stop a run, under every interleaving that loom finds.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
# A folder of its own: the flag changes every dependency. What runs here takes a second: nothing is optimised.
CARGO_TARGET_DIR="$CARGO_TARGET_DIR/loom" RUSTFLAGS="--cfg loom" \
    cargo test --locked -p palpate-runtime --lib --config 'profile.dev.opt-level=0' --config 'profile.dev.debug=false' loom
