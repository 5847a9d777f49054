//! What cannot be a body of tetrahedra is refused in one line that says where; and the window around a tool.

use crate::tissue_support::*;
use palpate_model::body::{Body, Shape, Tetrahedra, TetrahedraBuilder, Tissue, TissueRegion, Where};
use palpate_model::mesh::Group;

fn builder() -> TetrahedraBuilder {
    let mut mesh = irregular_box([3; 3], [0.03; 3], 0.2);
    mesh.groups.push(Group { name: "sheet".to_owned(), nodes: vec![0, 1], tetrahedra: vec![] });
    mesh.groups.push(Group { name: "nothing".to_owned(), nodes: vec![], tetrahedra: vec![] });
    Tetrahedra::builder(mesh)
}

fn scaled(by: f64) -> TetrahedraBuilder {
    let mut mesh = irregular_box([3; 3], [0.03; 3], 0.2);
    mesh.points.iter_mut().for_each(|x| *x *= by);
    Tetrahedra::builder(mesh).fix(bottom())
}

fn group(name: &str) -> Where {
    Where::Group(name.to_owned())
}

fn region(place: Where) -> TissueRegion {
    TissueRegion::of(place, Tissue::TUMOUR)
}

#[test]
fn what_cannot_be_is_named_in_one_line_with_its_place() {
    let held = || builder().fix(bottom());
    let far = Where::Shape(Shape::Sphere { centre: [1.0; 3], radius: 0.01 });
    let liver = Tissue::LIVER;
    let idle = TissueRegion {
        place: group("sheet"),
        young_modulus: None,
        poisson_ratio: None,
        density: None,
        viscosity: None,
    };
    let mut apart = irregular_box([3; 3], [0.03; 3], 0.2);
    let (nodes, more) = (apart.points.len() as u32, irregular_box([2; 3], [0.01; 3], 0.2));
    apart.points.extend(more.points.iter().map(|x| x.add_scalar(0.05)));
    apart.tetrahedra.extend(more.tetrahedra.iter().map(|corners| corners.map(|node| node + nodes)));
    let mut flat = irregular_box([1, 1, 1], [0.03; 3], 0.0);
    flat.points.iter_mut().for_each(|x| x.z *= 1e-3);
    let cases = [
        (
            held().tissue(Tissue { poisson_ratio: 0.5, ..liver }),
            "tissue: poisson_ratio: 0.5: at least 0 and less than 0.5",
        ),
        (held().tissue(Tissue { poisson_ratio: -0.1, ..liver }), "tissue: poisson_ratio: -0.1"),
        (held().tissue(Tissue { young_modulus: 0.0, ..liver }), "tissue: young_modulus_pa: 0"),
        (held().tissue(Tissue { density: f64::NAN, ..liver }), "tissue: density_kg_m3: NaN"),
        (held().tissue(Tissue { viscosity: -1.0, ..liver }), "tissue: viscosity_pa_s: -1"),
        (held().region(region(far.clone())), "region[0].shape: holds no element's centroid"),
        (
            held().region(region(group("tumour"))),
            "region[0].group: there is no \"tumour\": the mesh has \"sheet\", \"nothing\"",
        ),
        (held().region(region(group("sheet"))), "region[0].group: \"sheet\" has no tetrahedra"),
        (held().region(idle), "region[0]: differs in nothing"),
        (builder(), "fixed: nothing is held"),
        (builder().fix(group("nothing")), "fixed[0]: \"nothing\" has no nodes"),
        (held().fix(far), "fixed[1]: shape: holds no node"),
        (
            Tetrahedra::builder(apart).fix(bottom()),
            "fixed: the mesh has 2 parts, and part 2 of 48 elements around (0.05",
        ),
        (scaled(1e3), "unit_m: the body is 3.000e1"),
        (scaled(1e-2), "unit_m: the body is 3.000e-4"),
        (Tetrahedra::builder(flat).fix(bottom()), "mesh: the longest stable step is"),
    ];
    for (builder, expected) in cases {
        let message = builder.build().map(drop).unwrap_err().to_string();
        assert!(message.starts_with(expected) && !message.contains('\n'), "{message}");
    }
    assert!(held().region(region(Where::Shape(Shape::Layer { axis: 2, from: 0.02, to: 1.0 }))).build().is_ok());
}

/// Check that nodes of a file of single precision lie on the planes that they were drawn on.
#[test]
fn a_shape_holds_what_a_file_of_single_precision_has_on_its_boundary() {
    let mut mesh = irregular_box([3, 3, 4], [0.1; 3], 0.1);
    mesh.points.iter_mut().for_each(|point| *point = point.map(|c| f64::from(c as f32)));
    let top = Where::Shape(Shape::Layer { axis: 2, from: 0.1, to: 0.1 });
    let body = Tetrahedra::builder(mesh).fix(top).build().unwrap();
    let held = body.inverse_masses().iter().filter(|&&inverse_mass| inverse_mass == 0.0).count();
    assert_eq!(held, 16);
}

#[test]
fn a_later_region_wins_and_what_is_left_out_stays() {
    let layer = |from, to| Where::Shape(Shape::Layer { axis: 2, from, to });
    let soft = TissueRegion { young_modulus: Some(1e3), ..region(layer(0.02, 1.0)) };
    let thick = TissueRegion {
        young_modulus: None,
        poisson_ratio: None,
        density: None,
        viscosity: Some(9.0),
        place: layer(0.0, 1.0),
    };
    let body = builder().fix(bottom()).region(soft).region(thick).build().unwrap();
    for element in 0..body.element_count() as u32 {
        let tissue = body.tissue_of(element);
        assert_eq!(tissue.viscosity, 9.0);
        assert!(tissue.young_modulus == 1e3 || tissue.young_modulus == Tissue::LIVER.young_modulus);
    }
    assert!((0..body.element_count() as u32).any(|element| body.tissue_of(element).young_modulus == 1e3));
}

#[test]
fn a_patch_is_the_nearest_movable_nodes_in_increasing_order() {
    let body = body(irregular_box([6; 3], [0.06; 3], 0.2), Tissue::LIVER, true);
    for triangle in [0, 17, 100] {
        let mut nodes = vec![7];
        body.patch(&[triangle], [3, 3, 2], &mut nodes);
        assert_eq!(nodes.len(), 18);
        assert!(nodes.is_sorted_by(|a, b| a < b));
        assert!(nodes.iter().all(|&node| body.inverse_masses()[node as usize] > 0.0));
        let corners = body.surface().triangles[triangle as usize].map(|node| body.rest()[node as usize]);
        let centre = corners.iter().sum::<palpate_model::Vec3>() / 3.0;
        let distance = |node: u32| (body.rest()[node as usize] - centre).norm();
        let farthest = nodes.iter().map(|&node| distance(node)).fold(0.0, f64::max);
        let others = (0..body.rest().len() as u32).filter(|node| nodes.binary_search(node).is_err());
        let mut movable = others.filter(|&node| body.inverse_masses()[node as usize] > 0.0);
        // In a convex body nothing nearer was left out.
        assert!(movable.all(|node| distance(node) >= farthest));
    }
}
