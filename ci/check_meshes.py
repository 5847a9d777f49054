#!/usr/bin/env python3
"""Meshes as gmsh, meshio and pyvista write them, and what they make of ours.

    check_meshes.py write FOLDER SIZE     files of a small body, elements of SIZE metres, and `expected.json`
    check_meshes.py check FOLDER PALPATE  `palpate mesh --check` says of each file what those programs know of it; they open what
                                          it writes
"""

import json
import subprocess
import sys
from pathlib import Path

import gmsh
import meshio
import numpy
import pyvista
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

BOX = [0.04, 0.03, 0.02]


def body(size):
    """Two blocks at a common face: `organ` is both, `tumour` the second; `held` is a face, `tip` a corner."""
    gmsh.clear()
    first = gmsh.model.occ.addBox(0, 0, 0, BOX[0] / 2, BOX[1], BOX[2])
    second = gmsh.model.occ.addBox(BOX[0] / 2, 0, 0, BOX[0] / 2, BOX[1], BOX[2])
    gmsh.model.occ.fragment([(3, first)], [(3, second)])
    gmsh.model.occ.synchronize()
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    right = [tag for tag in volumes if gmsh.model.occ.getCenterOfMass(3, tag)[0] > BOX[0] / 2]
    floor = [tag for _, tag in gmsh.model.getEntities(2) if gmsh.model.occ.getCenterOfMass(2, tag)[2] < 1e-9]
    corner = [tag for _, tag in gmsh.model.getEntities(0) if max(gmsh.model.getValue(0, tag, [])) < 1e-9]
    for dimension, tags, name in [(3, volumes, "organ"), (3, right, "tumour"), (2, floor, "held"), (0, corner, "tip")]:
        gmsh.model.setPhysicalName(dimension, gmsh.model.addPhysicalGroup(dimension, tags), name)
    # Without a name.
    gmsh.model.addPhysicalGroup(2, floor[:1], 77)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)


def mixed():
    """A block of hexahedra on one of prisms, and a tetrahedron for itself."""
    gmsh.clear()
    gmsh.model.add("mixed")
    gmsh.model.addDiscreteEntity(3, 1)
    corners = [[x, y, z] for z in (0, 0.01, 0.02) for x, y in ((0, 0), (0.01, 0), (0.01, 0.01), (0, 0.01))]
    corners.append([0.004, 0.004, 0.03])
    gmsh.model.mesh.addNodes(3, 1, list(range(1, 14)), numpy.ravel(corners))
    gmsh.model.mesh.addElementsByType(1, 5, [], [1, 2, 3, 4, 5, 6, 7, 8])
    gmsh.model.mesh.addElementsByType(1, 6, [], [5, 6, 7, 9, 10, 11, 5, 7, 8, 9, 11, 12])
    gmsh.model.mesh.addElementsByType(1, 4, [], [9, 10, 11, 13, 9, 11, 12, 13])


def volume(points, tetrahedra):
    a, b, c, d = (points[tetrahedra[:, corner]] for corner in range(4))
    return abs(numpy.einsum("ij,ij->i", numpy.cross(b - a, c - a), d - a).sum()) / 6


def known():
    """What gmsh knows of its mesh: of linear tetrahedra and their nodes."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    index = {int(tag): row for row, tag in enumerate(tags)}
    points = places.reshape(-1, 3)
    _, nodes = gmsh.model.mesh.getElementsByType(4)
    tetrahedra = numpy.array([index[int(tag)] for tag in nodes]).reshape(-1, 4)
    groups = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag) or f"{['point', 'curve', 'surface', 'volume'][dimension]} {tag}"
        members = gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)[0]
        elements = sum(
            len(gmsh.model.mesh.getElementsByType(4, entity)[0])
            for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
            if dimension == 3
        )
        groups[name] = [len(set(members)), elements]
    return {
        "nodes": len(set(tetrahedra.ravel())),
        "elements": len(tetrahedra),
        "volume": volume(points, tetrahedra),
        "groups": groups,
    }


def write(folder, size):
    folder.mkdir(parents=True, exist_ok=True)
    expected = {}
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    body(size)
    truth = known()
    for version in ("4.1", "2.2"):
        for binary in (0, 1):
            name = f"gmsh_{version.replace('.', '')}_{'binary' if binary else 'ascii'}.msh"
            gmsh.option.setNumber("Mesh.MshFileVersion", float(version))
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(str(folder / name))
            expected[name] = truth
    gmsh.option.setNumber("Mesh.Binary", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.write(str(folder / "gmsh.vtk"))
    expected["gmsh.vtk"] = truth | {"groups": None}
    gmsh.model.mesh.setOrder(2)
    gmsh.write(str(folder / "gmsh_second_order.msh"))
    expected["gmsh_second_order.msh"] = {"error": "second-order tetrahedra"}
    mixed()
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    gmsh.write(str(folder / "gmsh_mixed.msh"))
    expected["gmsh_mixed.msh"] = known() | {"left_out": {"hexahedra": 1, "prisms": 2}}
    # Of a body with groups it would write the surfaces in them.
    gmsh.clear()
    gmsh.model.occ.addBox(0, 0, 0, *BOX)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(2)
    for name, binary in [("gmsh_ascii.stl", 0), ("gmsh_binary.stl", 1)]:
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(folder / name))
        expected[name] = {"surface": True}
    gmsh.finalize()

    # The same tetrahedra and a few surface triangles, an array of whole numbers at both.
    read = meshio.read(folder / "gmsh_41_ascii.msh")
    blocks = {"tetra": [], "triangle": []}
    for block in read.cells:
        if block.type in blocks:
            blocks[block.type].append(block.data)
    tetrahedra, triangles = (numpy.vstack(blocks[kind]) for kind in ("tetra", "triangle"))
    region = [1 + (read.points[tetrahedra].mean(axis=1)[:, 0] > BOX[0] / 2).astype(int), numpy.full(len(triangles), 7)]
    groups = {
        f"region={value}": [len(set(numpy.ravel(cells[mask]))), int(mask.sum()) if cells is tetrahedra else 0]
        for cells, values in [(tetrahedra, region[0]), (triangles, region[1])]
        for value in sorted(set(values.tolist()))
        for mask in [values == value]
    }
    truth = {"nodes": truth["nodes"], "elements": len(tetrahedra), "volume": truth["volume"], "groups": groups}
    truth["left_out"] = {"triangles": len(triangles)}
    mesh = meshio.Mesh(read.points, [("tetra", tetrahedra), ("triangle", triangles)], cell_data={"region": region})
    for name, form, options in [
        ("meshio_51_ascii.vtk", "vtk", {"binary": False}),
        ("meshio_51_binary.vtk", "vtk", {"binary": True}),
        ("meshio_42_ascii.vtk", "vtk42", {"binary": False}),
        ("meshio_42_binary.vtk", "vtk42", {"binary": True}),
        ("meshio_ascii.vtu", "vtu", {"binary": False}),
        ("meshio_binary.vtu", "vtu", {"binary": True, "compression": None}),
        ("meshio_zlib.vtu", "vtu", {"binary": True, "compression": "zlib"}),
    ]:
        meshio.write(folder / name, mesh, file_format=form, **options)
        expected[name] = truth
    # Its MSH 4.1 takes one kind of cells, its 2.2 numbers of groups.
    alone = meshio.Mesh(read.points, [("tetra", tetrahedra)])
    numbered = meshio.Mesh(mesh.points, mesh.cells, cell_data={"gmsh:physical": region, "gmsh:geometrical": region})
    called = {"region=1": "volume 1", "region=2": "volume 2", "region=7": "surface 7"}
    of_numbered = truth | {"groups": {called[name]: counts for name, counts in groups.items()}}
    for binary in (False, True):
        ending = "_binary.msh" if binary else ".msh"
        meshio.write(folder / f"meshio_41{ending}", alone, file_format="gmsh", binary=binary)
        expected[f"meshio_41{ending}"] = truth | {"groups": {}, "left_out": {}}
        meshio.write(folder / f"meshio_22{ending}", numbered, file_format="gmsh22", binary=binary)
        expected[f"meshio_22{ending}"] = of_numbered
    grid = pyvista.from_meshio(mesh)
    grid.points = grid.points.astype(float)
    grid.field_data["made by"] = ["a test"]
    grid.point_data["height"] = grid.points[:, 2]
    for name, binary in [("pyvista_ascii.vtk", False), ("pyvista_binary.vtk", True)]:
        grid.save(folder / name, binary=binary)
        expected[name] = truth
    modes = {"ascii": ("Ascii", None), "binary": ("Binary", None), "binary_zlib": ("Binary", "ZLib")}
    modes |= {"raw": ("Appended", None), "raw_zlib": ("Appended", "ZLib"), "appended": ("Appended", "ZLib")}
    for mode, (data_mode, compressor) in modes.items():
        name = f"pyvista_{mode}.vtu"
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetInputData(grid)
        writer.SetFileName(str(folder / name))
        getattr(writer, f"SetDataModeTo{data_mode}")()
        writer.SetEncodeAppendedData(mode == "appended")
        getattr(writer, f"SetCompressorTypeTo{compressor}")()
        if mode == "raw":
            writer.SetHeaderTypeToUInt32()
            writer.SetByteOrderToBigEndian()
        writer.Write()
        expected[name] = truth
    grid.save(folder / "pyvista.vtu")
    expected["pyvista.vtu"] = truth
    surface = grid.extract_cells(range(len(tetrahedra))).extract_surface(algorithm="dataset_surface").triangulate()
    surface.save(folder / "pyvista_ascii.stl", binary=False)
    surface.save(folder / "pyvista_binary.stl", binary=True)
    pyvista.save_meshio(folder / "meshio.obj", surface)
    surface.save(folder / "pyvista.obj")
    for name in ("pyvista_ascii.stl", "pyvista_binary.stl", "meshio.obj", "pyvista.obj"):
        expected[name] = {"surface": True, "nodes": surface.n_points, "elements": surface.n_cells, "volume": truth["volume"]}
    (folder / "expected.json").write_text(json.dumps(expected, indent=1, default=float) + "\n")


def report(palpate, *arguments):
    """The report of `palpate mesh`, or its complaint."""
    run = subprocess.run([palpate, "mesh", *map(str, arguments), "--json"], capture_output=True, text=True)
    return json.loads(run.stdout) if run.returncode == 0 else {"error": run.stderr}


def near(value, truth, tolerance):
    return abs(value - truth) <= tolerance * abs(truth)


def compare(name, found, truth):
    assert "error" not in found, f"{name}: {found}"
    for key in ("nodes", "elements"):
        assert found[key] == truth[key], f"{name}: {found[key]} {key}, not {truth[key]}"
    assert near(found["volume_m3"], truth["volume"], 1e-6), f"{name}: {found['volume_m3']}, not {truth['volume']}"
    groups = {group["name"]: [group["nodes"], group["elements"]] for group in found["groups"]}
    if truth["groups"] is not None:
        assert groups == truth["groups"], f"{name}: {groups}, not {truth['groups']}"
    if "left_out" in truth:
        assert found["left_out_elements"] == truth["left_out"], f"{name}: {found['left_out_elements']}"


def check(folder, palpate):
    expected = json.loads((folder / "expected.json").read_text())
    ours = folder / "ours.msh"
    for name, truth in expected.items():
        if "error" in truth:
            found = report(palpate, folder / name, "--check")
            assert truth["error"] in found.get("error", ""), f"{name}: {found}"
        elif "surface" in truth:
            found = report(palpate, folder / name, "--size-mm", 4, "--out", ours)
            assert "error" not in found, f"{name}: {found}"
            surface = found["surface"]
            assert near(surface["volume_m3"], BOX[0] * BOX[1] * BOX[2], 1e-6), f"{name}: {surface}"
            if "elements" in truth:
                assert surface["triangles"] == truth["elements"], f"{name}: {surface}"
            open_ours(ours, found)
        else:
            found = report(palpate, folder / name, "--check")
            compare(name, found, truth)
    print(f"{len(expected)} files: as gmsh {gmsh.__version__}, meshio {meshio.__version__} and pyvista {pyvista.__version__} know them")


def open_ours(path, found):
    """Gmsh and meshio find in the file what the report says."""
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(path))
    read = known()
    gmsh.finalize()
    compare(path.name, found, read)
    mesh = meshio.read(path)
    tetrahedra = mesh.get_cells_type("tetra")
    assert (len(mesh.points), len(tetrahedra)) == (found["nodes"], found["elements"]), path.name
    assert near(volume(mesh.points, tetrahedra), found["volume_m3"], 1e-9), path.name


def main():
    match sys.argv[1:]:
        case ["write", folder, size]:
            return write(Path(folder), float(size))
        case ["check", folder, palpate]:
            return check(Path(folder), palpate)
    sys.exit(__doc__)


if __name__ == "__main__":
    main()
