#!/usr/bin/env bash
# Everything compiles with the oldest compiler that the manifest names (rust-version). Not among all jobs: it may bring a toolchain.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
oldest=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml)
case "$(rustc --version)" in
"rustc $oldest."*) toolchain=() ;;
*)
    rustup toolchain install --profile minimal "$oldest"
    toolchain=("+$oldest")
    ;;
esac
cargo "${toolchain[@]}" check --locked --all-features --all-targets
echo "everything compiles with Rust $oldest"
