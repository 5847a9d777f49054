# Sourced by every job: the root of the repository as the current folder, and the tools that a bare machine lacks.
# shellcheck shell=bash
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
# Everything is compiled once: what would make a second time quicker only costs.
export CARGO_INCREMENTAL=0
# Lines for a debugger in sixty programs would be written and linked for nobody; a panic says its own.
export CARGO_PROFILE_DEV_DEBUG=0
# Bases that runs keep are no later run's.
export XDG_CACHE_HOME="$CARGO_TARGET_DIR/cache"
# The checks import each other: nothing is left behind in ci/.
export PYTHONDONTWRITEBYTECODE=1

# Installs Debian packages if that is possible here: install_packages REASON PACKAGE...
install_packages() {
    local reason=$1
    shift
    if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
        echo "missing: $reason; install it ($*) and run again" >&2
        return 1
    fi
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# Adds a component of the toolchain: need_component COMPONENT COMMAND
need_component() {
    cargo "$2" --version >/dev/null 2>&1 || rustup component add "$1"
}

command -v cargo >/dev/null || { echo "missing: cargo; install the Rust toolchain" >&2; exit 1; }
# lz4 is compiled from C.
command -v cc >/dev/null || install_packages "a C compiler" gcc libc6-dev

# Builds the command and the examples as the tests need them: so all jobs compile them once, in the folder `debug`. Nothing to do
# where the job `build` was before.
build_programs() {
    [ -n "${PALPATE_BUILT:-}" ] || cargo build --locked --profile test --bins --examples
}

# A folder of Python packages: python_venv NAME MODULES PACKAGE... sets `venv` to its path. It is made again if MODULES, a list with
# commas, cannot be imported.
python_venv() {
    local name=$1 modules=$2
    shift 2
    venv="$CARGO_TARGET_DIR/$name-venv"
    if [ ! -x "$venv/bin/python" ] || ! "$venv/bin/python" -c "import $modules" 2>/dev/null; then
        python3 -c 'import venv, ensurepip' 2>/dev/null || install_packages "Python with venv" python3 python3-venv
        python3 -m venv --clear "$venv"
        "$venv/bin/pip" install --quiet "$@"
    fi
}
