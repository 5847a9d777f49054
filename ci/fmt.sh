#!/usr/bin/env bash
# The code is formatted as rustfmt.toml says.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
need_component rustfmt fmt
cargo fmt --all -- --check
