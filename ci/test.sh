#!/usr/bin/env bash
# Every test: units, properties, documentation, the command, threads in real time.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
cargo test --locked
