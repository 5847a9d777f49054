#!/usr/bin/env bash
# The documentation builds without a warning: every link leads somewhere, every public item is documented.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps --all-features
