#!/usr/bin/env bash
# The page of `palpate view` in Firefox: it draws, a drag pushes the body, nothing is complained about. Not among all jobs: Firefox and
# Mesa's software renderer have some 500 MB.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
command -v firefox-esr >/dev/null && command -v xvfb-run >/dev/null || install_packages "Firefox, a display and a font" firefox-esr xvfb xauth libgl1-mesa-dri libgl1 libegl1 fonts-dejavu-core
command -v python3 >/dev/null || install_packages "Python" python3

python3 ci/check_firefox.py "$CARGO_TARGET_DIR/debug/palpate"
