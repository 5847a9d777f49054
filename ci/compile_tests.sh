#!/usr/bin/env bash
# The tests, compiled and not run.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
exec cargo test --locked --no-run
