//! A reduction for programs: one JSON document.
//!
//! Field names are stable; later versions only add fields. Units are in the names; floats read back exactly. A figure that is not
//! there or not finite is `null`, and so is `locality` where it was not asked for; the lists are then empty.
//!
//! | field | content |
//! | --- | --- |
//! | `schema_version` | 1 |
//! | `subject`, `seconds` | what was studied, and the wall time of all of it (s) |
//! | `palpate_version`, `debug_build` | what computed |
//! | `tables[]` | `title`, `rows[]` |
//! | `tables[].rows[]` | `cells` along each axis, `damping_ratio`, `order`, `reduced_order` (asked for), `states` (kept), `method`, `error_percent`, `hinf_percent`, `published_error_percent`, `ratio` (computed over published), `seconds`, `published_seconds`, `stable` |
//! | `responses[]` | `title`, `channels`, `unit` of the gains, `frequencies_hz`, `models[]`, the reference first |
//! | `responses[].models[]` | `name`, `order`, `gains[channel][frequency]` as `[re, im]`, `at_rest_error_percent`, `worst_error_percent`, `worst_hz`, `estimate_percent`, `seconds` |
//! | `hankel[]` | `title`, `order`, `unit`, `values` above the numerical rank, `truncations[]` with `order`, `error_percent`, `hinf_percent` |
//! | `shapes[]` | `title`, `nodes_m`, `input_m`, `in_local`, `states[]` with `hankel` (over the largest), `amplitude` (over the node that moves most), `local_share` (0 to 1) |
//! | `locality` | `local`, `verdict` (a sentence, not for programs), `warnings`, `patch`, `patch_bounds_m`, `spacing_m`, `band_hz`, `band_limit_percent`, `at_rest_limit_percent`, `reference_percent`, `contact`, `faces[]`, `sizes[]`, `bases[]`, `budget`, `measured` |
//! | a contact | `node`, `position_m`, `stiffness_n_per_m`, `at_rest_error_percent`, `band_error_percent`, `worst_error_percent` |
//! | `locality.faces[]` | `face`, `axes`, `first_m`, `second_m`, `contacts`: the first axis fastest, `null` where the node is held |
//! | `locality.sizes[]` | `patch`, `nodes`, `contact` and `worst_contact` with this patch |
//! | `locality.bases[]` | `states`, `error_percent` |
//! | `locality.budget` | `error_percent`, `patch` and `states` that meet it (`null`: none does); `null` if no budget was given |
//! | `locality.measured` | `predicted_percent`, `measured_percent`, `predicted_at_rest_percent`, `measured_at_rest_percent`; `null` if it was not measured |

use serde_json::{Value, json};

use super::figures::ratio;
use super::words::locality_verdict;
use crate::reduce::findings::{
    ContactLocality, FaceMap, HankelDecay, Locality, ModelResponse, ReductionRow, ReductionStudy, ReductionTable,
    ResponseFigure, StateShapes,
};

/// The study as one JSON document.
pub fn to_json(study: &ReductionStudy) -> String {
    json!({
        "schema_version": 1,
        "subject": study.subject,
        "palpate_version": env!("CARGO_PKG_VERSION"),
        "debug_build": cfg!(debug_assertions),
        "tables": all(&study.tables, table),
        "responses": all(&study.responses, response),
        "hankel": all(&study.hankel, hankel),
        "shapes": all(&study.shapes, shapes),
        "locality": study.locality.as_ref().map(locality),
        "seconds": study.seconds,
    })
    .to_string()
}

fn all<T>(items: &[T], of: impl Fn(&T) -> Value) -> Value {
    items.iter().map(of).collect()
}

fn table(table: &ReductionTable) -> Value {
    json!({ "title": table.title, "rows": all(&table.rows, row) })
}

fn row(row: &ReductionRow) -> Value {
    json!({
        "cells": row.cells,
        "damping_ratio": row.damping_ratio,
        "order": row.order,
        "reduced_order": row.reduced_order,
        "states": row.states,
        "method": row.method,
        "error_percent": row.error_pct,
        "hinf_percent": row.hinf_pct,
        "published_error_percent": row.published_error_pct,
        "ratio": ratio(row.error_pct, row.published_error_pct),
        "seconds": row.seconds,
        "published_seconds": row.published_s,
        "stable": row.is_stable,
    })
}

fn response(figure: &ResponseFigure) -> Value {
    json!({
        "title": figure.title,
        "channels": figure.channels,
        "unit": figure.unit,
        "frequencies_hz": figure.hz,
        "models": all(&figure.models, model),
    })
}

fn model(model: &ModelResponse) -> Value {
    json!({
        "name": model.name,
        "order": model.order,
        "gains": model.gains,
        "at_rest_error_percent": model.at_rest_pct,
        "worst_error_percent": model.worst_pct,
        "worst_hz": model.worst_hz,
        "estimate_percent": model.estimate_pct,
        "seconds": model.seconds,
    })
}

fn hankel(decay: &HankelDecay) -> Value {
    let truncation = |cut: &crate::reduce::findings::Truncation| json!({ "order": cut.order, "error_percent": cut.error_pct, "hinf_percent": cut.hinf_pct });
    json!({
        "title": decay.title,
        "order": decay.order,
        "unit": decay.unit,
        "values": decay.values,
        "truncations": all(&decay.truncations, truncation),
    })
}

fn shapes(shapes: &StateShapes) -> Value {
    json!({
        "title": shapes.title,
        "nodes_m": shapes.nodes,
        "input_m": shapes.input,
        "in_local": shapes.in_local,
        "states": all(&shapes.states, |state| json!({
            "hankel": state.hankel,
            "amplitude": state.amplitude,
            "local_share": state.local_share,
        })),
    })
}

fn locality(locality: &Locality) -> Value {
    json!({
        "local": locality.is_local,
        "verdict": locality_verdict(locality),
        "warnings": locality.warnings,
        "patch": locality.patch,
        "spacing_m": locality.spacing_m,
        "patch_bounds_m": locality.patch_bounds_m,
        "band_limit_percent": locality.band_limit_pct,
        "at_rest_limit_percent": locality.at_rest_limit_pct,
        "reference_percent": locality.reference_pct,
        "band_hz": locality.band_hz,
        "contact": contact(&locality.contact),
        "faces": all(&locality.faces, face),
        "sizes": all(&locality.sizes, |size| json!({
            "patch": size.patch,
            "nodes": size.nodes,
            "contact": contact(&size.contact),
            "worst_contact": contact(&size.worst),
        })),
        "bases": all(&locality.bases, |basis| json!({ "states": basis.states, "error_percent": basis.error_pct })),
        "budget": locality.budget.map(|budget| json!({
            "error_percent": budget.error_pct,
            "patch": budget.patch,
            "states": budget.states,
        })),
        "measured": locality.measured.as_ref().map(|measured| json!({
            "predicted_percent": measured.predicted_pct,
            "measured_percent": measured.measured_pct,
            "predicted_at_rest_percent": measured.predicted_at_rest_pct,
            "measured_at_rest_percent": measured.measured_at_rest_pct,
        })),
    })
}

fn face(face: &FaceMap) -> Value {
    json!({
        "face": face.face,
        "axes": face.axes,
        "first_m": face.first_m,
        "second_m": face.second_m,
        "contacts": all(&face.contacts, |here| here.as_ref().map_or(Value::Null, contact)),
    })
}

fn contact(contact: &ContactLocality) -> Value {
    json!({
        "node": contact.node,
        "position_m": contact.position_m,
        "stiffness_n_per_m": contact.stiffness_n_per_m,
        "at_rest_error_percent": contact.at_rest_pct,
        "band_error_percent": contact.band_pct,
        "worst_error_percent": contact.worst_pct,
    })
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;

    #[test]
    fn every_number_reads_back_exactly() {
        let study = sample();
        let json = to_json(&study);
        // By the standard library's parser: that of serde_json may be off by the last bit.
        let numbers = |after: &str, key: &str| -> Vec<f64> {
            let list = json.split(after).nth(1).unwrap().split(&format!("\"{key}\":")).nth(1).unwrap();
            let end = list.find(['"', '}']).unwrap_or(list.len());
            let words = list[..end].split(['[', ']', ',']).filter(|word| !word.is_empty());
            words.map(|word| word.parse().unwrap()).collect()
        };
        let gains: Vec<f64> = study.responses[0].models[0].gains.iter().flatten().flatten().copied().collect();
        assert_eq!(numbers("\"responses\":", "gains"), gains);
        assert_eq!(numbers("\"hankel\":[", "values"), study.hankel[0].values);
        assert_eq!(numbers("\"shapes\":", "amplitude"), study.shapes[0].states[0].amplitude);
        let document: Value = serde_json::from_str(&json).unwrap();
        let row = &document["tables"][0]["rows"][1];
        assert_eq!(
            (&row["published_error_percent"], &row["published_seconds"]),
            (&0.00396.into(), &(0.07 * 10.0).into())
        );
        assert_eq!(row["error_percent"].as_f64(), Some(study.tables[0].rows[1].error_pct));
    }

    #[test]
    fn what_is_not_there_or_not_finite_is_null() {
        let mut study = sample();
        study.responses[0].models[1].gains[0][0] = [f64::INFINITY, f64::NAN];
        let document: Value = serde_json::from_str(&to_json(&study)).unwrap();
        let row = &document["tables"][2]["rows"][5];
        for figure in ["error_percent", "published_error_percent", "ratio", "published_seconds"] {
            assert_eq!(row.get(figure), Some(&Value::Null), "{figure}");
        }
        assert_eq!(document["responses"][0]["models"][1]["gains"][0][0], json!([null, null]));
        assert_eq!(document["locality"]["faces"][1]["contacts"][0], Value::Null);
        let empty: Value = serde_json::from_str(&to_json(&ReductionStudy::default())).unwrap();
        assert_eq!((&empty["locality"], &empty["tables"]), (&Value::Null, &json!([])));
    }

    #[test]
    fn the_locality_is_complete() {
        let document: Value = serde_json::from_str(&to_json(&sample())).unwrap();
        let locality = &document["locality"];
        assert_eq!((&locality["local"], &locality["patch"]), (&false.into(), &json!([4, 4, 2])));
        assert_eq!(locality["faces"][0]["contacts"].as_array().unwrap().len(), 144);
        assert_eq!(locality["contact"]["band_error_percent"], 7.2);
        assert_eq!(locality["sizes"][3]["worst_contact"]["node"], 79);
        assert_eq!(locality["budget"], json!({"error_percent": 0.5, "patch": [10, 10, 6], "states": 24}));
        assert_eq!(locality["measured"]["measured_percent"], 6.0);
    }
}
