//! When a local model may be trusted: the check of whole scenes against the non-linear simulation.

use palpate::ErrorKind;
use palpate::model::body::Shape;
use palpate::scene::Scene;

use super::findings::Locality;
use super::*;
use crate::tests::repository::in_repository;

fn study(name: &str, options: &ReduceOptions) -> ReductionStudy {
    let path = in_repository(&format!("scenes/{name}.toml"));
    reduce_scene(&Scene::load(path.as_ref()).unwrap(), options, |_| {}).unwrap()
}

fn checked(name: &str) -> Locality {
    let options = ReduceOptions { every: Some(6), measure: true, ..ReduceOptions::default() };
    let locality = study(name, &options).locality.unwrap();
    let measured = locality.measured.unwrap();
    println!("{name}: local {}, {measured:?}", locality.is_local);
    for (predicted, measured) in [
        (measured.predicted_pct, measured.measured_pct),
        (measured.predicted_at_rest_pct, measured.measured_at_rest_pct),
    ] {
        // The project's limit is a factor of three.
        assert!(predicted / measured < 1.5 && measured / predicted < 1.5, "{name}: {predicted} {measured}");
    }
    locality
}

#[test]
fn a_uniform_body_and_one_with_a_nodule_pass_as_predicted_and_measured() {
    for name in ["drag_friction", "nodule"] {
        let locality = checked(name);
        assert!(locality.is_local, "{name}: {:?}", locality.warnings);
    }
}

#[test]
fn soft_tissue_under_a_stiff_skin_is_flagged_as_predicted_and_measured() {
    let locality = checked("soft_deep");
    assert!(!locality.is_local);
    assert!(locality.warnings[0].contains("soft deep tissue"), "{:?}", locality.warnings);
    assert!(locality.contact.at_rest_pct > 500.0, "{:?}", locality.contact);
}

// Check a nodule that the patch cuts through: its other half, held, holds the half in the patch.
#[test]
fn a_stiff_nodule_that_reaches_out_of_the_patch_is_flagged() {
    let path = in_repository("scenes/nodule.toml");
    let mut scene = Scene::load(path.as_ref()).unwrap();
    let nodule = &mut scene.body.as_mut().unwrap().mass_spring_mut().unwrap().regions[0];
    nodule.shape = Shape::Sphere { centre: [0.06, 0.05, 0.085], radius: 0.0175 };
    let options =
        ReduceOptions { node: Some([6, 5, 11].into()), every: Some(11), measure: true, ..ReduceOptions::default() };
    let locality = reduce_scene(&scene, &options, |_| {}).unwrap().locality.unwrap();
    let measured = locality.measured.unwrap();
    assert!(!locality.is_local && locality.warnings[0].contains("nodule"), "{:?}", locality.warnings);
    assert!(
        measured.predicted_pct / measured.measured_pct < 1.5 && measured.measured_pct / measured.predicted_pct < 1.5,
        "{measured:?}"
    );
}

// Check that what a budget asks for does what it asks for, and that larger models are nearer.
#[test]
fn a_budget_names_what_meets_it() {
    let options = ReduceOptions { every: Some(11), error_pct: Some(15.0), ..ReduceOptions::default() };
    let locality = study("drag_friction", &options).locality.unwrap();
    let budget = locality.budget.unwrap();
    let patch = budget.patch.expect("a patch meets 15 %");
    let sizes = &locality.sizes;
    let chosen = sizes.iter().position(|size| size.patch == patch).unwrap();
    assert!(sizes[chosen].contact.band_pct <= 15.0);
    assert!(sizes[..chosen].iter().all(|size| size.contact.band_pct > 15.0));
    let states = budget.states.expect("a number of states meets 15 %");
    assert!(states < 10, "{states}");
    let bases = &locality.bases;
    assert!(bases.len() > 5 && bases.windows(2).all(|pair| pair[1].error_pct <= pair[0].error_pct * 1.05), "{bases:?}");
    assert!(sizes[0].contact.at_rest_pct > sizes[sizes.len() - 1].contact.at_rest_pct);
}

#[test]
fn a_contact_that_is_none_is_refused() {
    let path = in_repository("scenes/drag_friction.toml");
    let scene = Scene::load(path.as_ref()).unwrap();
    let no_node = "is no node of the surface";
    for (node, words) in [([5, 5, 5], no_node), ([5, 5, 0], no_node), ([99, 0, 0], "is outside the body")] {
        let error =
            reduce_scene(&scene, &ReduceOptions { node: Some(node.into()), ..ReduceOptions::default() }, |_| {})
                .unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        assert!(error.to_string().contains(words) && error.to_string().contains(&format!("{node:?}")), "{error}");
    }
}
