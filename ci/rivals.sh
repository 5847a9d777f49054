#!/usr/bin/env bash
# The benches against other crates and cyclictest build and run; the figures of this short run say nothing.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
need_component rustfmt fmt
command -v cyclictest >/dev/null || install_packages "cyclictest" rt-tests
cd benches/rivals
cargo fmt -- --check
cargo build --locked
for program in exchange ring; do
    cargo run --locked --quiet --bin "$program" -- --smoke
done
# Without the right to real-time priorities cyclictest refuses to run.
if chrt -f 80 true 2>/dev/null; then
    cargo run --locked --quiet --bin wakeup -- --smoke
else
    echo "wakeup: left out, no right to priority 80 here"
fi
cd ../..
python_venv balance numpy,slycot numpy slycot
"$venv/bin/python" benches/rivals/balance.py 8 1
