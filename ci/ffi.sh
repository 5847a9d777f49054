#!/usr/bin/env bash
# palpate for C and C++: the header is the one that cbindgen writes, a tick allocates nothing and makes no system call, and examples and
# tests build with gcc and clang without a warning and run, with the address and undefined-behaviour sanitizers too.
#
#     bash ci/ffi.sh           all of it
#     bash ci/ffi.sh header    writes the header anew
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"

tools="$CARGO_TARGET_DIR/cbindgen"
cbindgen="$(command -v cbindgen || echo "$tools/bin/cbindgen")"
if [ ! -x "$cbindgen" ]; then
    # Not made for speed: it runs once.
    CARGO_PROFILE_RELEASE_OPT_LEVEL=1 cargo install --quiet --locked --root "$tools" cbindgen@^0.29
fi
write_header() {
    "$cbindgen" --quiet --config ffi/cbindgen.toml --crate palpate-ffi --lockfile Cargo.lock --output "$1" ffi
}
if [ "${1:-}" = header ]; then
    write_header ffi/include/palpate.h
    exit
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
write_header "$folder/palpate.h"
diff -u ffi/include/palpate.h "$folder/palpate.h" || { echo "the header is out of date: bash ci/ffi.sh header" >&2; exit 1; }
echo "ffi/include/palpate.h is what cbindgen writes"

command -v g++ >/dev/null || install_packages "a C++ compiler" g++ libc6-dev
command -v clang++ >/dev/null || install_packages "clang" clang
echo 'int main(void) { return 0; }' >"$folder/probe.c"
clang -fsanitize=address,undefined "$folder/probe.c" -o "$folder/probe" 2>/dev/null || install_packages "clang's sanitizers" libclang-rt-dev

cargo build --locked -p palpate-ffi
need_component clippy clippy
cargo clippy --locked -p palpate-ffi --no-deps --all-targets -- -D warnings
PALPATE_REQUIRE_SECCOMP=1 cargo test --locked -p palpate-ffi
libraries="$CARGO_TARGET_DIR/debug"
warnings=(-Wall -Wextra -Wpedantic -Werror)
sanitize=(-g -fsanitize=address,undefined -fno-sanitize-recover=all)

# Builds a source and runs it in a folder of its own: run_with NAME SOURCE LINK FLAG...
run_with() {
    local name=$1 source=$2 link=$3 compiler
    shift 3
    case $source in
        *.c) compiler="${name%%-*} -std=c11" ;;
        *) compiler="${name%%-*} -std=c++17" compiler=${compiler/gcc/g++} compiler=${compiler/clang/clang++} ;;
    esac
    local program="$folder/$name-$(basename "${source%.*}")"
    # shellcheck disable=SC2086
    $compiler -O1 "${warnings[@]}" "$@" -I ffi/include "$source" -o "$program" $link
    mkdir -p "$program.d"
    if ! (cd "$program.d" && timeout 120 "$program" >out.txt 2>&1 </dev/null); then
        tail -n 40 "$program.d/out.txt" >&2
        echo "$name $source: FAILED" >&2
        exit 1
    fi
    echo "$name $source: passed: $(tail -n 1 "$program.d/out.txt")"
}
shared="-L $libraries -lpalpate_ffi -Wl,-rpath,$libraries -lpthread -lm"
static="$libraries/libpalpate_ffi.a -lpthread -lm -ldl"
for source in ffi/examples/*.c ffi/examples/*.cpp ffi/tests/*.c ffi/tests/*.cpp; do
    run_with gcc "$source" "$shared"
    run_with clang-static "$source" "$static"
    run_with gcc-sanitized "$source" "$shared" "${sanitize[@]}"
    run_with clang-sanitized "$source" "$shared" "${sanitize[@]}"
done
# The pictures of the renderer, by another compiler and with sanitizers too.
for picture in press-0.ppm press-2.ppm press.obj; do
    cmp "$folder/gcc-render.d/$picture" "$folder/clang-static-render.d/$picture"
done
