#!/usr/bin/env bash
# The vendor's public client against the mock of its service.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
need_component rustfmt fmt
cd interop/haply
cargo fmt -- --check
cargo run --locked --quiet
