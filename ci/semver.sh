#!/usr/bin/env bash
# What changed in public interfaces since another state of the repository asks for no other version than the manifest has.
#
#     bash ci/semver.sh [REVISION]        without one the last tag; before there is a tag there is nothing to compare with
#
# Not among all jobs: it brings a tool that takes minutes to build, and documents every crate twice.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
tools="$CARGO_TARGET_DIR/semver"
export PATH="$tools/bin:$PATH"
if ! command -v cargo-semver-checks >/dev/null; then
    # Not made for speed: it runs once.
    CARGO_PROFILE_RELEASE_OPT_LEVEL=1 CARGO_PROFILE_RELEASE_LTO=off cargo install --quiet --locked --root "$tools" cargo-semver-checks
fi
since=${1:-$(git describe --tags --abbrev=0 2>/dev/null || true)}
if [ -z "$since" ]; then
    echo "there is no release to compare with: name a revision, bash ci/semver.sh REVISION"
    exit 0
fi
for crate in palpate-runtime palpate-model palpate-mesh palpate palpate-haply palpate-view; do
    cargo semver-checks --package "$crate" --baseline-rev "$since" --all-features
done
