#!/usr/bin/env bash
# The Python package: its wheel is built and installed, what it computes is what the command computes, bit for bit, and its types are those of
# its stubs.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"

python_venv python "maturin, numpy, pandas, pytest, mypy, matplotlib, nbclient, ipykernel" \
    maturin numpy pandas pandas-stubs pytest mypy matplotlib nbclient nbformat ipykernel
# pytest runs the package that is installed, not the folder.
export PATH="$venv/bin:$PATH"

# Together, so that the command and the package are made of the same compiled crates.
cargo build --locked -p palpate-cli -p palpate-python
need_component clippy clippy
cargo clippy --locked -p palpate-python --all-targets -- -D warnings
wheels=$(mktemp -d)
trap 'rm -rf "$wheels"' EXIT
maturin build --locked --profile dev --manifest-path python/Cargo.toml --out "$wheels"
pip install --quiet --force-reinstall --no-deps "$wheels"/palpate-*.whl

export PALPATE_COMMAND="$CARGO_TARGET_DIR/debug/palpate"
cd python
python -m pytest -q tests
cd tests
python -m mypy --strict typed_use.py
python -m mypy.stubtest --concise --ignore-disjoint-bases palpate
