#!/usr/bin/env bash
# The link over zenoh: two processes over loopback, who may not come in, and the command's own options. Zenoh takes ten minutes to build.
#
#     bash ci/link.sh
#     bash ci/link.sh lab   also two network namespaces with delay and loss between them, against the virtual link, with cables that are
#                           pulled, and with two haptic machines (root, iproute2)
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
need_component clippy clippy
# One selection of packages for all: another one would build zenoh again.
link=(--locked -p palpate-link -p palpate-cli --features palpate-cli/link)
cargo clippy "${link[@]}" --all-targets -- -D warnings
# One at a time: each has two processes that want their time.
tests=(--lib --bins --test two_processes --test strangers --test hot_path --test link)
PALPATE_REQUIRE_SECCOMP=1 cargo test "${link[@]}" "${tests[@]}" -- --test-threads 1
command -v chromium >/dev/null || install_packages "chromium, and a font" chromium fonts-dejavu-core
command -v python3 >/dev/null || install_packages "Python" python3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 ci/check_view.py "$CARGO_TARGET_DIR/debug/palpate" "$folder" --linked
if [ "${1:-}" = lab ]; then
    command -v ip >/dev/null || install_packages "network namespaces" iproute2
    python3 ci/link_lab.py "$CARGO_TARGET_DIR/debug/palpate" "$CARGO_TARGET_DIR/tmp/lab" --scenes drag_friction --delays 0 14 --losses 0 1
    python3 ci/link_trials.py "$CARGO_TARGET_DIR/debug/palpate" "$CARGO_TARGET_DIR/tmp/lab" cable
    python3 ci/link_trials.py "$CARGO_TARGET_DIR/debug/palpate" "$CARGO_TARGET_DIR/tmp/lab" machines --delays 0
fi
