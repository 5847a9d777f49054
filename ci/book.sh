#!/usr/bin/env bash
# The documentation as a site, in the folder `book` of the target folder: the pages of docs/SUMMARY.md by mdBook, and the API documentation
# beside them. Every link between them leads somewhere.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
command -v python3 >/dev/null || install_packages "Python" python3

tools="$CARGO_TARGET_DIR/mdbook"
mdbook="$(command -v mdbook || echo "$tools/bin/mdbook")"
if [ ! -x "$mdbook" ]; then
    # Without the server that watches files, and not made for speed: it runs once.
    CARGO_PROFILE_RELEASE_OPT_LEVEL=1 cargo install --quiet --locked --no-default-features --features search --root "$tools" mdbook@^0.5
fi

staged="$CARGO_TARGET_DIR/book-source"
book="$CARGO_TARGET_DIR/book"
rm -rf "$staged" "$book"
mkdir -p "$staged"
python3 ci/book.py stage "$staged"
"$mdbook" build --dest-dir "$book" "$staged"
RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps
cp -r "$CARGO_TARGET_DIR/doc" "$book/api"
python3 ci/book.py check "$book"
echo "the site: $book/index.html"
