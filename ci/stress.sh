#!/usr/bin/env bash
# A short form of the ten minutes under load: no record is lost, and every period and missed deadline has its cause.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
command -v stress-ng >/dev/null || install_packages "stress-ng" stress-ng
command -v python3 >/dev/null || install_packages "Python" python3
build_programs
PALPATE="$CARGO_TARGET_DIR/debug/palpate" benches/stress.sh 10
