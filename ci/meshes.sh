#!/usr/bin/env bash
# Meshes as gmsh, meshio and pyvista write them are read, and what palpate writes they open.
source "$(dirname "${BASH_SOURCE[0]}")/prepare.sh"
build_programs
palpate="$CARGO_TARGET_DIR/debug/palpate"

# Gmsh's package needs what a screen would need.
ldconfig -p | grep -q libGLU.so.1 || install_packages "libraries of gmsh" libglu1-mesa libxcursor1 libxft2 libxinerama1 libxrender1
# Their ways of writing are read by name: another version may write otherwise.
python_venv meshes "gmsh, meshio, pyvista" gmsh==4.15.2 meshio==5.3.5 pyvista==0.49.1

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for size in 0.02 0.004; do
    "$venv/bin/python" ci/check_meshes.py write "$folder/$size" "$size" >/dev/null
    "$venv/bin/python" ci/check_meshes.py check "$folder/$size" "$palpate"
done
