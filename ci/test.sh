#!/usr/bin/env bash
# Every test: units, properties, documentation, the command, threads in real time.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
# The proof of the hot path must run here, not say why it could not.
PALPATE_REQUIRE_SECCOMP=1 cargo test --locked
