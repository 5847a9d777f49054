#!/usr/bin/env bash
# The command and the examples, which most other jobs run.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
