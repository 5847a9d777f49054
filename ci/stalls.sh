#!/usr/bin/env bash
# Tests in real time pass while their process is stopped for up to 25 ms, again and again, as a host does to its guests.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
command -v python3 >/dev/null || install_packages "Python" python3
python3 ci/stalls.py 3 conformance faults supervision threaded device_paced hosted live retaken_ports scheduling tracing \
    session_machines session_real_time session_hosted session_overload session_sides session_faults two_devices sessions coming_again view
