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
//! | `locality.faces[]` | `face`, `axes`, `first_m`, `second_m`, `ends_m` (of the body along both), `contacts`: the first axis fastest, `null` where the node is held |
//! | `locality.sizes[]` | `patch`, `nodes`, `contact` and `worst_contact` with this patch |
//! | `locality.bases[]` | `states`, `error_percent` |
//! | `locality.budget` | `error_percent`, `patch` and `states` that meet it (`null`: none does); `null` if no budget was given |
//! | `locality.measured` | `predicted_percent`, `measured_percent`, `predicted_at_rest_percent`, `measured_at_rest_percent`; `null` if it was not measured |

use serde_json::json;

use super::figures::ratio;
use super::words::locality_verdict;
use crate::reduce::findings::ReductionStudy;

/// The study as one JSON document.
pub fn to_json(study: &ReductionStudy) -> String {
    let mut document = json!(study);
    document["schema_version"] = json!(1);
    document["palpate_version"] = json!(env!("CARGO_PKG_VERSION"));
    document["debug_build"] = json!(cfg!(debug_assertions));
    for (at, table) in study.tables.iter().enumerate() {
        for (number, row) in table.rows.iter().enumerate() {
            document["tables"][at]["rows"][number]["ratio"] = json!(ratio(row.error_pct, row.published_error_pct));
        }
    }
    if let Some(locality) = &study.locality {
        document["locality"]["verdict"] = json!(locality_verdict(locality));
    }
    document.to_string()
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;
    use serde_json::Value;

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
