//! Files as gmsh, meshio and pyvista write them, made by `ci/check_meshes.py write FOLDER 0.02`: two blocks at a common face; the
//! STL of gmsh has the surfaces in groups alone.

use std::path::Path;

use palpate_mesh::{VolumeFile, read_surface_file, read_volume, read_volume_file, write_msh};
use palpate_model::mesh::TetrahedralMesh;

/// Name, numbers of nodes and elements of a group.
type Count = (&'static str, usize, usize);
/// Kinds of other elements, and how many.
type Others = &'static [(&'static str, usize)];

const PHYSICAL: &[Count] =
    &[("held", 13, 0), ("organ", 36, 82), ("surface 77", 8, 0), ("tip", 1, 0), ("tumour", 22, 41)];
const REGIONS: &[Count] = &[("region=1", 22, 41), ("region=2", 22, 41), ("region=7", 13, 0)];

/// Volume files, their groups, and what is left out of them. In MSH 2.2 an element is there once for each of its groups.
const VOLUMES: [(&str, &[Count], Others); 10] = [
    ("gmsh_22_ascii.msh", PHYSICAL, &[("points", 1), ("triangles", 24)]),
    ("gmsh_22_binary.msh", PHYSICAL, &[("points", 1), ("triangles", 24)]),
    ("gmsh_41_ascii.msh", PHYSICAL, &[("points", 1), ("triangles", 16)]),
    ("gmsh_41_binary.msh", PHYSICAL, &[("points", 1), ("triangles", 16)]),
    ("meshio_42_binary.vtk", REGIONS, &[("triangles", 16)]),
    ("meshio_zlib.vtu", REGIONS, &[("triangles", 16)]),
    ("pyvista_appended.vtu", REGIONS, &[("triangles", 16)]),
    ("pyvista_ascii.vtk", REGIONS, &[("triangles", 16)]),
    ("pyvista_ascii.vtu", REGIONS, &[("triangles", 16)]),
    ("pyvista_binary.vtk", REGIONS, &[("triangles", 16)]),
];

fn path(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(name)
}

fn check(name: &str, file: VolumeFile, groups: &[Count], left_out: &[(&str, usize)]) -> TetrahedralMesh {
    let found: Vec<(&str, usize)> = file.left_out_elements.iter().map(|(kind, n)| (kind.as_str(), *n)).collect();
    assert_eq!(found, left_out, "{name}");
    let (mesh, left_out) = file.mesh.cleaned().unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!((left_out.nodes, left_out.turned), (0, false), "{name}");
    let quality = mesh.quality();
    assert_eq!((quality.nodes, quality.elements), (36, 82), "{name}");
    assert!((quality.volume - 0.04 * 0.03 * 0.02).abs() < 1e-12, "{name}: {quality:?}");
    assert!((quality.extent() - palpate_model::Vec3::new(0.04, 0.03, 0.02)).norm() < 1e-9, "{name}: {quality:?}");
    let mut found: Vec<(&str, usize, usize)> =
        mesh.groups.iter().map(|group| (group.name.as_str(), group.nodes.len(), group.tetrahedra.len())).collect();
    found.sort_unstable();
    assert_eq!(found, groups, "{name}");
    for group in mesh.groups.iter().filter(|group| ["tumour", "region=2"].contains(&group.name.as_str())) {
        assert!(group.tetrahedra.iter().all(|&element| mesh.centroid(element).x > 0.02), "{name}");
    }
    mesh
}

#[test]
fn what_programs_write_is_read_with_its_groups() {
    for (name, groups, left_out) in VOLUMES {
        let file = read_volume_file(&path(name)).unwrap_or_else(|error| panic!("{error}"));
        check(name, file, groups, left_out);
    }
    // Appended as raw bytes.
    let raw = read_volume_file(&path("pyvista_raw_zlib.vtu")).unwrap();
    let encoded = read_volume_file(&path("pyvista_appended.vtu")).unwrap();
    assert_eq!(raw, encoded);
}

/// A piece of one tetrahedron, and of others that another piece has.
fn piece(points: &str, connectivity: &str, ghosts: &str) -> String {
    let cells = ghosts.split(' ').count();
    let array = |kind: &str, name: &str, values: &str| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>")
    };
    let ends = (1..=cells).map(|cell| (4 * cell).to_string()).collect::<Vec<_>>().join(" ");
    let (points, types) = (array("Float64", "Points", points), vec!["10"; cells].join(" "));
    let lists = array("Int64", "connectivity", connectivity)
        + &array("Int64", "offsets", &ends)
        + &array("UInt8", "types", &types);
    let data = array("UInt8", "vtkGhostType", ghosts) + &array("Int32", "region", ghosts);
    format!("<Piece><Points>{points}</Points><Cells>{lists}</Cells><CellData>{data}</CellData></Piece>")
}

#[test]
fn pieces_of_one_mesh_meet_at_nodes_and_cells_that_two_have_count_once() {
    let one = piece("0 0 0 1 0 0 0 1 0 0 0 1", "0 1 2 3", "0");
    let other = piece("0 0 1 -0 -1 0 1 0 0 0 0 0 0 1 0", "3 1 2 0 0 2 4 3", "0 1");
    let text =
        format!("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{one}{other}</UnstructuredGrid></VTKFile>");
    let file = read_volume("a.vtu", text.as_bytes()).unwrap();
    assert_eq!(file.left_out_elements, [("cells of other pieces".to_owned(), 1)]);
    let groups: Vec<_> = file.mesh.groups.iter().map(|group| (group.name.as_str(), group.nodes.len())).collect();
    assert_eq!(groups, [("region=0", 5)]);
    let (mesh, left_out) = file.mesh.cleaned().unwrap();
    assert_eq!((mesh.points.len(), mesh.tetrahedra.len(), left_out.nodes), (5, 2, 0));
}

/// A kilobyte of zeros packed, as many times as it takes.
#[test]
fn a_small_file_does_not_unpack_to_any_size() {
    let block = 1_u32 << 20;
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; block as usize], 6);
    let blocks = (1 << 27) / block + 1;
    let head = [blocks, block, 0].into_iter().chain((0..blocks).map(|_| packed.len() as u32));
    let array = "<DataArray type=\"UInt8\" Name=\"many\" format=\"appended\" offset=\"0\"/>";
    let text = format!(
        "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid><Piece><Points>{array}\
         </Points><Cells/></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_"
    );
    let mut bytes = text.into_bytes();
    head.for_each(|count| bytes.extend(count.to_le_bytes()));
    (0..blocks).for_each(|_| bytes.extend(&packed));
    bytes.extend(b"</AppendedData></VTKFile>");
    assert!(bytes.len() < 200_000);
    let error = read_volume("a.vtu", &bytes).unwrap_err().to_string();
    assert_eq!(error, "a.vtu: array \"many\": the arrays have more than 134217728 numbers in all");
}

#[test]
fn other_cells_are_left_out_by_name_and_their_nodes_with_them() {
    let file = read_volume_file(&path("gmsh_mixed.msh")).unwrap();
    assert_eq!(file.left_out_elements, [("hexahedra".to_owned(), 1), ("prisms".to_owned(), 2)]);
    let (mesh, left_out) = file.mesh.cleaned().unwrap();
    assert_eq!((mesh.points.len(), mesh.tetrahedra.len(), left_out.nodes), (5, 2, 8));
}

#[test]
fn surfaces_are_welded() {
    for (name, nodes, triangles) in [("gmsh_ascii.stl", 13, 16), ("gmsh_binary.stl", 13, 16), ("meshio.obj", 34, 64)] {
        let surface = read_surface_file(&path(name)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((surface.points.len(), surface.triangles.len()), (nodes, triangles), "{name}");
        let largest = surface.points.iter().fold(palpate_model::Vec3::zeros(), |largest, point| largest.sup(point));
        assert!((largest.x - 0.04).abs() < 1e-6, "{name}: {largest}");
    }
}

#[test]
fn what_is_written_is_read_again() {
    let file = read_volume_file(&path("gmsh_41_binary.msh")).unwrap();
    let mut bytes = Vec::new();
    write_msh(&file.mesh, &mut bytes).unwrap();
    let again = read_volume("again.msh", &bytes).unwrap();
    assert_eq!(again.mesh.points, file.mesh.points);
    // Triangles that are in no group are not written; `held` and `surface 77` have 16 between them.
    check("again.msh", again, PHYSICAL, &[("points", 1), ("triangles", 16)]);
}

/// Numbers for what is damaged and how.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

#[test]
fn damaged_files_are_refused_or_read_and_never_panic() {
    let mut random = Random(17);
    let (mut read, mut refused) = (0, 0);
    for entry in std::fs::read_dir(path("")).unwrap() {
        let file = entry.unwrap().path();
        let name = file.file_name().unwrap().to_str().unwrap();
        let whole = std::fs::read(&file).unwrap();
        let mut try_reading = |bytes: &[u8]| {
            let is_surface = name.ends_with("stl") || name.ends_with("obj");
            let error = match is_surface {
                true => palpate_mesh::read_surface(name, bytes).err(),
                false => match read_volume(name, bytes) {
                    Ok(file) => file.mesh.cleaned().err().map(Into::into),
                    Err(error) => Some(error),
                },
            };
            let Some(error) = error else { return read += 1 };
            let line = error.to_string();
            assert!(line.len() < 600 && !line.contains(char::is_control), "{line:?}");
            refused += 1;
        };
        for length in (0..whole.len()).step_by(whole.len().div_ceil(200)) {
            try_reading(&whole[..length]);
        }
        for _ in 0..1000 {
            let mut bytes = whole.clone();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                match random.below(4) {
                    // Counts grow, numbers become none.
                    0 => bytes[at] = b'9',
                    1 => bytes[at] = 0xff,
                    2 => bytes[at] ^= 1 << random.below(8),
                    _ => bytes[at] = random.below(256) as u8,
                }
            }
            try_reading(&bytes);
        }
    }
    assert!(read > 1000 && refused > 1000, "{read} read, {refused} refused");
}

#[test]
fn refusals_name_the_file_and_the_place() {
    let of = |name: &str, text: &str| read_volume(name, text.as_bytes()).unwrap_err().to_string();
    let surface = |name: &str, text: &str| palpate_mesh::read_surface(name, text.as_bytes()).unwrap_err().to_string();
    let head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    let nodes = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n";
    let msh = |rest: &str| of("a.msh", &format!("{head}{nodes}{rest}"));
    let cases = [
        (of("a.txt", "hello"), "a.txt: is no volume mesh that can be read"),
        (of("a.stl", "solid"), "a.stl: is a surface, a volume mesh is needed"),
        (of("a.msh", "$MeshFormat\n4 0 8\n$EndMeshFormat\n"), "a.msh: line 2: version \"4\" of MSH is not read"),
        (of("a.msh", head), "a.msh: line 4: $Elements is missing"),
        (of("a.msh", &format!("{head}$Nodes\n9999999999999\n1 0 0 0\n")), "a.msh: line 7: the file ends where the tag"),
        (
            of("a.msh", &format!("{head}$Nodes\n1\n1 0 zero 0\n")),
            "a.msh: line 6: \"zero\" is not a coordinate of a node",
        ),
        (msh("$Elements\n1\n1 4 0 1 2 3 5\n$EndElements\n"), "a.msh: line 13: an element has node 5"),
        (msh("$Elements\n1\n1 99 0 1 2 3 5\n$EndElements\n"), "a.msh: line 13: elements of Gmsh's type 99"),
        (
            msh("$Elements\n2\n1 2 0 1 2 3\n2 15 0 1\n$EndElements\n"),
            "a.msh: there are no linear tetrahedra, but 1 points, 1 triangles: save a volume mesh of order 1",
        ),
        (msh("$Elements\n1\n1 4 0 1 2 3 4\n"), "a.msh: line 13: \"$EndElements\" is missing"),
        (
            of("a.msh", &format!("{head}$Nodes\n1\n1 0 nan 0\n$EndNodes\n$Elements\n1\n1 4 0 1 1 1 1\n$EndElements\n")),
            "a.msh: node 0, counted from 0, is at (0, NaN, 0): no place",
        ),
        (of("a.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\n"), "a.vtk: line 4: \"POLYDATA\" is no"),
        (of("a.vtu", "<VTKFile type=\"PolyData\"/>"), "a.vtu: \"PolyData\" is no unstructured grid"),
        (of("a.vtu", "<VTKFile type=\"Un"), "a.vtu: is no XML: "),
        (
            of("a.vtu", "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkLZ4DataCompressor\"/>"),
            "a.vtu: is compressed by \"vtkLZ4DataCompressor\": save it with zlib or uncompressed",
        ),
        (surface("a.stl", "solid x\nfacet\nvertex 0 0 inf\n"), "a.stl: line 3: a coordinate is not finite"),
        (surface("a.stl", "solid x\nendsolid x\n"), "a.stl: has no triangles"),
        (surface("a.stl", "solid x\nouter loop\nvertex 0 0 0\nendloop\n"), "a.stl: line 4: a facet has 1 corners"),
        (surface("a.stl", "short"), "a.stl: is neither ASCII STL nor as long"),
        (surface("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n"), "a.obj: line 3: \"3\" is no vertex"),
        (surface("a.obj", "v 0 0\n"), "a.obj: line 1: a vertex has three finite coordinates"),
    ];
    for (message, start) in cases {
        assert!(message.starts_with(start), "{message}");
    }
}
