#!/usr/bin/env bash
# No warnings of compiler and clippy in libraries, programs, tests, benches and examples.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
need_component clippy clippy
# Together the default members have every feature but `link`, which has a job of its own.
cargo clippy --locked --all-targets -- -D warnings
