#!/usr/bin/env bash
# Every test: units, properties, documentation, the command, threads in real time.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
# The proof of the hot path must run here, not say why it could not.
# With the Haply client and its mock, as build_programs builds them: no second set of features is compiled.
PALPATE_REQUIRE_SECCOMP=1 cargo test --locked --features haply
