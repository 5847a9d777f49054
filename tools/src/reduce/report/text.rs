//! A reduction for a terminal of 100 columns.

use super::table::{Table, wrapped};
use super::{map, tables, words};
use crate::reduce::findings::{Locality, ReductionStudy};

/// The study as text, every line ended by a newline.
pub fn to_text(study: &ReductionStudy) -> String {
    let mut text = String::new();
    if let Some(found) = &study.locality {
        locality(&mut text, found);
    }
    if let Some(verdict) = words::tables_verdict(study) {
        block(&mut text, &wrapped(&verdict));
        for table in &study.tables {
            block(&mut text, &tables::published(table).to_text());
        }
        let note = [words::MEASURES, words::ROUNDING].map(wrapped).concat();
        block(&mut text, &note);
    }
    for response in &study.responses {
        block(&mut text, &tables::models(response).to_text());
        for channel in 0..response.channels.len() {
            block(&mut text, &tables::decibel_table(response, channel).to_text());
        }
    }
    if !study.responses.is_empty() {
        block(&mut text, &wrapped(words::RESPONSES));
    }
    for decay in &study.hankel {
        block(&mut text, &wrapped(&tables::hankel_values(decay)));
        with_rows(&mut text, &tables::truncations(decay));
    }
    for shapes in &study.shapes {
        with_rows(&mut text, &tables::shares(shapes));
    }
    let facts = format!("{}: {}; docs/reduce.md says what each figure means", study.subject, words::facts(study));
    let debug = words::debug_note().map(wrapped).unwrap_or_default();
    block(&mut text, &(wrapped(&facts) + &debug));
    text
}

/// Verdict first, then what it rests on.
fn locality(text: &mut String, locality: &Locality) {
    block(text, &wrapped(&words::locality_verdict(locality)));
    let mut lines: Vec<String> =
        locality.warnings.iter().map(|warning| wrapped(&format!("warning: {warning}"))).collect();
    lines.push(wrapped(&words::contact(locality)));
    lines.extend(words::budget(locality).map(|budget| wrapped(&budget)));
    lines.extend(locality.measured.iter().map(|measured| wrapped(&words::measured(measured))));
    block(text, &lines.concat());
    with_rows(text, &tables::percentiles(locality));
    if let Some(face) = map::faces(locality).first() {
        block(text, &(map::map(face, locality.contact.node) + &wrapped(&map::legend())));
    }
    with_rows(text, &tables::sizes(locality));
    with_rows(text, &tables::bases(locality));
    block(text, &wrapped(words::LOCALITY));
}

/// A part, with an empty line before it.
fn block(text: &mut String, part: &str) {
    if !text.is_empty() && !part.is_empty() {
        text.push('\n');
    }
    text.push_str(part);
}

fn with_rows(text: &mut String, table: &Table) {
    if !table.rows.is_empty() {
        block(text, &table.to_text());
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::super::table::WIDTH;
    use super::*;

    #[test]
    fn the_verdict_is_the_first_line_and_everything_has_its_part() {
        let text = to_text(&sample());
        assert!(text.starts_with("Not local. "), "{text}");
        for part in [
            "warning: a stiff inclusion",
            "Contact: node 66 at (60.0, 50.0, 50.0) mm",
            "An error of 0.500 % between resyncs is met by",
            "Measured in the time domain",
            "Errors of the patch over the surface (%)",
            "Error between resyncs on z_max",
            "Patch sizes",
            "Reduced surroundings",
            "Table 1, 2D, zeta 1",
            "The paper does not define its % error.",
            "tangential: gain (dB re 1 N/m)",
            "normal: gain (dB re 1 N/m)",
            "48 of 524 above the numerical rank: 118,",
            "Truncations, 12 x 12 cells, zeta 1",
            "Where the states move the body, Fig. 5",
        ] {
            assert!(text.contains(part), "{part:?} is not in\n{text}");
        }
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(!text.contains("NaN") && !text.contains(" inf"), "{text}");
    }

    #[test]
    fn what_was_not_asked_for_is_not_there() {
        let text = to_text(&ReductionStudy { subject: "table1".into(), ..ReductionStudy::default() });
        assert!(text.starts_with("table1: palpate "), "{text}");
    }
}
