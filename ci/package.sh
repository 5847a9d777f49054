#!/usr/bin/env bash
# The crates as a registry would have them: each is packaged, and the packages compile against each other with the tests, benches and
# examples that are in them, whose scenes, series and pictures are there. Not among all jobs: it compiles everything once more.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
crates=(palpate-runtime palpate-model palpate-mesh palpate palpate-haply palpate-view palpate-link palpate-cli)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# None of them is published, so that no package can be verified alone.
cargo package --quiet --no-verify --allow-dirty "${crates[@]/#/--package=}" 2> >(grep -v "is not included in the published package" >&2)
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
{
    printf '[workspace]\nresolver = "3"\nmembers = ["*-%s"]\n\n[patch.crates-io]\n' "$version"
    printf '%s = { path = "%s-'"$version"'" }\n' $(for crate in "${crates[@]}"; do echo "$crate" "$crate"; done)
    # The optimisation that the numerics need.
    sed -n '/^\[profile.dev\]/,/^\[\[/p' Cargo.toml | grep -v '^\[\['
} >"$folder/Cargo.toml"
for crate in "${crates[@]}"; do
    tar -xzf "$CARGO_TARGET_DIR/package/$crate-$version.crate" -C "$folder"
    printf '%-16s %s, %s files\n' "$crate" "$(du -h "$CARGO_TARGET_DIR/package/$crate-$version.crate" | cut -f1)" \
        "$(tar -tzf "$CARGO_TARGET_DIR/package/$crate-$version.crate" | wc -l)"
    # A picture that a page shows is there.
    (cd "$folder/$crate-$version" && { grep -rhoE '\]\((img|docs/img)/[a-z_0-9]+\.[a-z]+\)' --include=*.md . || true; } | sort -u | while read -r link; do
        link=${link#](}
        [ -e "${link%)}" ] || [ -e "docs/${link%)}" ] || [ "$crate" = palpate-cli ] || { echo "$crate: ${link%)} is missing" >&2; exit 1; }
    done)
done
cp Cargo.lock "$folder"
export CARGO_TARGET_DIR="$CARGO_TARGET_DIR/packaged"
cargo check --quiet --manifest-path "$folder/Cargo.toml" --workspace --all-targets --exclude palpate-cli --exclude palpate-link
cargo check --quiet --manifest-path "$folder/Cargo.toml" --package palpate-cli
cargo test --quiet --manifest-path "$folder/Cargo.toml" --package palpate --test scenes --test devices
echo "the packages are whole"
