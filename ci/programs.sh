#!/usr/bin/env bash
# The command and the examples are built, as the other jobs need them.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
