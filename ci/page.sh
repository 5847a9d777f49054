#!/usr/bin/env bash
# Pages of `palpate timing --html` work in a browser: wide and narrow, light and dark, in print, without scripts; their numbers
# are those of `--json`. Pages of `palpate reduce --html` and `palpate compare --html` fit the screen, and no words of their drawings lie on each other. In the page
# of `palpate view` the body gives way where it is pushed, and forces are those of the log; a log is scrubbed and played.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
palpate="$CARGO_TARGET_DIR/debug/palpate"
command -v chromium >/dev/null || install_packages "chromium, and a font" chromium fonts-dejavu-core
command -v python3 >/dev/null || install_packages "Python" python3

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
page() {
    "$palpate" timing "$folder/$1.mcap" --json --html "$folder/$1.html" >"$folder/$1.json"
}
"$palpate" run scenes/demo.toml --duration 2 --out "$folder/real_time.mcap" >/dev/null
"$palpate" run scenes/drag_friction.toml --virtual --duration 1 --out "$folder/virtual.mcap" >/dev/null
"$palpate" run scenes/two_hands.toml --virtual --duration 0.5 --out "$folder/two_devices.mcap" >/dev/null
# A process that is stopped skips periods.
"$palpate" run scenes/demo.toml --duration 2 --out "$folder/stopped.mcap" >/dev/null &
run=$!
sleep 1
kill -STOP "$run"
sleep 0.3
kill -CONT "$run"
wait "$run"
# A logger that is killed leaves such a log.
head -c 300000 "$folder/real_time.mcap" >"$folder/cut.mcap"
for log in real_time stopped virtual two_devices cut; do
    page "$log" 2>/dev/null
done
grep -q 'class="skipped' "$folder/stopped.html" || { echo "skipped periods are not drawn" >&2; exit 1; }
python3 ci/check_page.py "$folder"/{real_time,stopped,virtual,two_devices,cut}.html

"$palpate" reduce --paper all --html "$folder/paper.html" >/dev/null
"$palpate" reduce --cells 5,5,5 --html "$folder/mesh.html" >/dev/null
"$palpate" reduce scenes/drag_friction.toml --error-pct 0.5 --html "$folder/scene.html" >/dev/null
"$palpate" compare scenes/drag_friction.toml --models-only --duration 0.4 --html "$folder/compare.html" >/dev/null
python3 ci/check_drawings.py "$folder"/{paper,mesh,scene,compare}.html

python3 ci/check_view.py "$palpate" "$folder"
