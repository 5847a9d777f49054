#!/usr/bin/env bash
# No warnings of compiler and clippy in libraries, programs, tests, benches and examples.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
need_component clippy clippy
# What a feature adds is compiled with it; none takes anything away.
cargo clippy --locked --all-targets --all-features -- -D warnings
