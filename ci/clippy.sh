#!/usr/bin/env bash
# No warnings of compiler and clippy, with every set of features that an embedding program can choose.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
need_component clippy clippy
cargo clippy --locked --all-targets --all-features -- -D warnings
# Tests bring features of shared dependencies: these two sets need the same ones, so that they are checked once.
for features in "" scene; do
    cargo clippy --locked --all-targets --no-default-features --features "$features" -- -D warnings
done
# Tests and examples have no code of their own for the sets in between; library and program have.
for features in log cli; do
    cargo clippy --locked --lib --bins --no-default-features --features "$features" -- -D warnings
done
