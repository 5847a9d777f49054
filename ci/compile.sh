#!/usr/bin/env bash
# The tests compile.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
cargo test --locked --no-run
