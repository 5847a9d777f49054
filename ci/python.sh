#!/usr/bin/env bash
# The Python package: its wheel is built and installed, what it computes is what the command computes, bit for bit, its types are those of its
# stubs, and its notebook finds the tumour.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"

python_venv python "maturin, numpy, pandas, pytest, mypy, matplotlib, nbclient, ipykernel" \
    maturin numpy pandas pandas-stubs pytest mypy matplotlib nbclient nbformat ipykernel
export PATH="$venv/bin:$PATH"

# Together, so that the command and the package are made of the same compiled crates.
cargo build --locked -p palpate-cli -p palpate-python
need_component clippy clippy
cargo clippy --locked --no-deps -p palpate-python --all-targets -- -D warnings
wheels=$(mktemp -d)
trap 'rm -rf "$wheels"' EXIT
maturin build --locked --profile dev --manifest-path python/Cargo.toml --out "$wheels"
pip install --quiet --force-reinstall --no-deps "$wheels"/palpate-*.whl

export PALPATE_COMMAND="$CARGO_TARGET_DIR/debug/palpate"
# From here the package is the one that is installed, and not the folder.
cd python/tests
python -m pytest -q .
python -m mypy --strict typed_use.py
python -m mypy.stubtest --concise --ignore-disjoint-bases palpate
cd ../examples
python -c '
import nbformat
from nbclient import NotebookClient
notebook = nbformat.read("find_the_tumour.ipynb", as_version=4)
NotebookClient(notebook, timeout=900, kernel_name="python3").execute()
print("find_the_tumour.ipynb:", sum(cell.cell_type == "code" for cell in notebook.cells), "cells")
'
