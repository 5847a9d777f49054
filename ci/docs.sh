#!/usr/bin/env bash
# The documentation builds without a warning: every link leads somewhere, every public item is documented. No two public types share
# a name, no item leans on its neighbours, no files import each other in a circle; lines and names are counted.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
command -v python3 >/dev/null || install_packages "Python" python3
RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps
python3 ci/structure.py circles
python3 ci/structure.py names "$CARGO_TARGET_DIR/doc"
python3 ci/structure.py lines
