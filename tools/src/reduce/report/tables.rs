//! The tables of a reduction, the same for a terminal and for a page.

use super::figures::{NONE, by, decibel_cell, figure, hertz, is_there, optional, percentile, published_ratio, time};
use super::table::{Column, Table};
use crate::reduce::findings::{
    HankelDecay, Locality, PatchError, ReductionRow, ReductionTable, ResponseFigure, StateShapes,
};

/// Frequencies of a response that are written out.
const FREQUENCIES: usize = 10;
/// States that are written out.
const STATES: usize = 12;
/// What both errors of a reduced model are.
const ERROR: (&str, &str) = ("error\n%", "2 (sum of the Hankel singular values left out) / (sum of all)");
const HINF: (&str, &str) = ("H-inf\n%", "largest error of the frequency response over its largest gain");
/// The contact that stands for the worst ones.
const WORST: &str = "the same at the contact of the surface that is worst between resyncs for the scene's patch";

fn columns(of: &[(&str, &str)]) -> Vec<Column> {
    of.iter().map(|(head, meaning)| Column::new(*head, *meaning)).collect()
}

/// Published against computed.
pub(super) fn published(table: &ReductionTable) -> Table {
    let is_one =
        |of: fn(&ReductionRow, &ReductionRow) -> bool| table.rows.windows(2).all(|pair| of(&pair[0], &pair[1]));
    let row = |row: &ReductionRow| {
        let kept = if row.states == row.reduced_order { "" } else { " of " };
        let asked = if kept.is_empty() { String::new() } else { row.reduced_order.to_string() };
        vec![
            by(&row.cells),
            hertz(row.damping_ratio),
            row.order.to_string(),
            format!("{}{kept}{asked}", row.states),
            figure(row.error_pct),
            if is_there(row.published_error_pct) { figure(row.published_error_pct) } else { NONE.to_owned() },
            optional(published_ratio(row)),
            figure(row.hinf_pct),
            time(row.seconds),
            row.published_s.map_or(NONE.to_owned(), time),
            if row.is_stable { "yes" } else { "NO" }.to_owned(),
            row.method.clone(),
        ]
    };
    let mut shown = Table {
        title: table.title.clone(),
        columns: columns(&[
            ("cells", "cells along each axis"),
            ("zeta", "damping ratio"),
            ("order", "states of the full model"),
            (
                "states\nkept",
                "states of the reduced model, of those asked for where fewer are above the numerical rank",
            ),
            ERROR,
            ("published\n%", "the paper's % error, which it does not define"),
            ("ratio", "computed over published"),
            HINF,
            ("time", "wall time, assembly included"),
            ("published\ntime", "the paper's"),
            ("stable", "every pole of the reduced model lies in the left half plane"),
            ("method", "how it was reduced"),
        ]),
        rows: table.rows.iter().map(row).collect(),
    };
    // What is the same in all rows stands in the title; a row keeps its name.
    if let Some(first) = table.rows.first() {
        if is_one(|a, b| a.damping_ratio == b.damping_ratio) {
            shown.title.push_str(&format!(", zeta {}", hertz(first.damping_ratio)));
            shown.drop_column(1);
        } else if is_one(|a, b| a.cells == b.cells) {
            shown.title.push_str(&format!(", {} cells", by(&first.cells)));
            shown.drop_column(0);
        }
    }
    shown
}

/// One line per model.
pub(super) fn models(figure_of: &ResponseFigure) -> Table {
    let rows = figure_of.models.iter().enumerate().map(|(number, model)| {
        let error = |error: String| if number == 0 { NONE.to_owned() } else { error };
        vec![
            model.name.clone(),
            model.order.to_string(),
            error(figure(model.at_rest_pct)),
            error(figure(model.worst_pct)),
            error(hertz(model.worst_hz)),
            optional(model.estimate_pct),
            time(model.seconds),
        ]
    });
    Table {
        title: figure_of.title.clone(),
        columns: columns(&[
            ("model", ""),
            ("order", "states"),
            ("error at rest\n%", "norm of the difference over all channels over the norm of the reference, at 0 Hz"),
            ("worst error\n%", "the same at the worst frequency above rest"),
            ("at\nHz", "where that is"),
            ("estimate\n%", "the model's own estimate of its worst error, made without the reference"),
            ("time", "wall time to make it"),
        ]),
        rows: rows.collect(),
    }
}

/// Gains of one channel at about ten frequencies (dB).
pub(super) fn decibel_table(figure_of: &ResponseFigure, channel: usize) -> Table {
    let name = figure_of.channels.get(channel).map_or("", String::as_str);
    let mut shown = vec![Column::new("Hz", "frequency")];
    shown.extend(figure_of.models.iter().map(|model| Column::new(model.name.replace(' ', "\n"), "")));
    let row = |at: usize| {
        let gains = figure_of.models.iter().map(|model| model.gains.get(channel).and_then(|gains| gains.get(at)));
        let cells = gains.map(|gain| gain.map_or(NONE.to_owned(), |gain| decibel_cell(*gain)));
        [hertz(figure_of.hz[at])].into_iter().chain(cells).collect()
    };
    Table {
        title: format!("{name}: gain (dB re 1 {})", figure_of.unit),
        columns: shown,
        rows: spread(figure_of.hz.len(), FREQUENCIES).into_iter().map(row).collect(),
    }
}

/// At most `most` of the numbers below `count`, evenly spread, the first and the last among them.
fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most).map(|at| (at * (count - 1) + (most - 1) / 2) / (most - 1)).collect()
}

/// What truncations of a balanced system cost.
pub(super) fn truncations(decay: &HankelDecay) -> Table {
    let rows = decay.truncations.iter();
    let row = |cut: &crate::reduce::findings::Truncation| {
        vec![cut.order.to_string(), figure(cut.error_pct), figure(cut.hinf_pct)]
    };
    Table {
        title: format!("Truncations, {}", decay.title),
        columns: columns(&[("states", "states kept"), ERROR, HINF]),
        rows: rows.map(row).collect(),
    }
}

/// Hankel singular values in one line.
pub(super) fn hankel_values(decay: &HankelDecay) -> String {
    let first: Vec<String> = decay.values.iter().take(STATES).map(|value| figure(*value)).collect();
    let more = if decay.values.len() > STATES { ", ..." } else { "" };
    format!(
        "Hankel singular values of {} ({}), {} of {} above the numerical rank: {}{more}",
        decay.title,
        decay.unit,
        decay.values.len(),
        decay.order,
        first.join(", ")
    )
}

/// How much of each of the first states is within the local model.
pub(super) fn shares(shapes: &StateShapes) -> Table {
    let rows =
        shapes.states.iter().take(STATES).enumerate().map(|(number, state)| {
            vec![(number + 1).to_string(), figure(state.hankel), figure(100.0 * state.local_share)]
        });
    let local = shapes.in_local.iter().filter(|is_in| **is_in).count();
    Table {
        title: format!(
            "Where the states move the body, {}: {local} of {} nodes are the local model's",
            shapes.title,
            shapes.nodes.len()
        ),
        columns: columns(&[
            ("state", "in the order of the Hankel singular values"),
            ("sigma\n/ largest", "Hankel singular value over the largest"),
            (
                "within the\nlocal model %",
                "share of the sum of squares of the displacements that the local model's nodes have",
            ),
        ]),
        rows: rows.collect(),
    }
}

/// Percentiles over the contacts of each face, and over all.
pub(super) fn percentiles(locality: &Locality) -> Table {
    type Of = fn(&crate::reduce::findings::ContactLocality) -> f64;
    const SHARES: [f64; 3] = [0.5, 0.9, 1.0];
    let band: Of = |contact| contact.band_pct;
    let rest: Of = |contact| contact.at_rest_pct;
    let row = |name: &str, contacts: &[&crate::reduce::findings::ContactLocality]| {
        let mut cells = vec![name.to_owned(), contacts.len().to_string()];
        for of in [band, rest] {
            let mut errors: Vec<f64> = contacts.iter().map(|contact| of(contact)).filter(|e| e.is_finite()).collect();
            errors.sort_unstable_by(f64::total_cmp);
            cells.extend(SHARES.map(|share| optional(percentile(&errors, share))));
        }
        cells
    };
    let of_face = |face: usize| locality.faces[face].contacts.iter().flatten().collect::<Vec<_>>();
    let mut rows: Vec<Vec<String>> =
        (0..locality.faces.len()).map(|face| row(&locality.faces[face].face, &of_face(face))).collect();
    if locality.faces.len() > 1 {
        rows.push(row("all", &(0..locality.faces.len()).flat_map(of_face).collect::<Vec<_>>()));
    }
    Table {
        title: "Errors of the patch over the surface (%)".to_owned(),
        columns: columns(&[
            ("face", ""),
            ("contacts", "nodes of the surface that were looked at"),
            ("band\np50", "half of the contacts have less between resyncs"),
            ("band\np90", "90 % of the contacts have less between resyncs"),
            ("band\nmax", "the worst contact between resyncs"),
            ("at rest\np50", "half of the contacts have less at rest"),
            ("at rest\np90", "90 % of the contacts have less at rest"),
            ("at rest\nmax", "the worst contact at rest"),
        ]),
        rows,
    }
}

/// Errors by the size of the patch.
pub(super) fn sizes(locality: &Locality) -> Table {
    let row = |size: &PatchError| {
        let errors =
            [&size.contact, &size.worst].into_iter().flat_map(|at| [at.band_pct, at.at_rest_pct, at.worst_pct]);
        [by(&size.patch), size.nodes.to_string()].into_iter().chain(errors.map(figure)).collect()
    };
    Table {
        title: "Patch sizes, between held surroundings (%)".to_owned(),
        columns: columns(&[
            ("patch", "nodes along the surface, along it, into depth"),
            ("nodes\nthat move", ""),
            ("contact\nband", "error at the contact, rms between resyncs"),
            ("contact\nat rest", "error at the contact at rest"),
            ("contact\nworst", "error at the contact at the worst frequency between resyncs"),
            ("worst contact\nband", WORST),
            ("worst contact\nat rest", WORST),
            ("worst contact\nworst", WORST),
        ]),
        rows: locality.sizes.iter().map(row).collect(),
    }
}

/// Errors by the number of states of the reduced surroundings.
pub(super) fn bases(locality: &Locality) -> Table {
    Table {
        title: "Reduced surroundings (predictive) at the contact".to_owned(),
        columns: columns(&[("states", "states r"), ("error\n%", "of the linear contact force")]),
        rows: locality.bases.iter().map(|basis| vec![basis.states.to_string(), figure(basis.error_pct)]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::super::table::WIDTH;
    use super::*;

    #[test]
    fn published_and_computed_stand_beside_each_other() {
        let study = sample();
        let text = published(&study.tables[0]).to_text();
        assert!(text.starts_with("Table 1, 2D, zeta 1\n"), "{text}");
        let row = text.lines().find(|line| line.starts_with("10 x 10")).unwrap();
        let cells: Vec<&str> = row.split_whitespace().collect();
        assert_eq!(
            cells[3..],
            ["304", "20", "0.00832", "0.00396", "2.10", "0.00119", "4.20", "ms", "700", "ms", "yes", "modal"]
        );
        // Fewer states than were asked for are told.
        assert!(published(&study.tables[1]).to_text().contains("14 of 20"));
        // Nothing is held against rounding.
        assert_eq!(published(&study.tables[1]).rows[0][4..6], ["1.08e-13", "-"]);
        let damping = published(&study.tables[2]).to_text();
        assert!(damping.starts_with("Table 2, 12 x 12 cells\n"), "{damping}");
        let last = damping.lines().last().unwrap().split_whitespace().collect::<Vec<_>>();
        assert_eq!(last, ["2", "524", "20", "-", "-", "-", "-", "50.0", "ms", "-", "NO", "modal"]);
    }

    #[test]
    fn the_reference_has_no_error_and_others_have() {
        let study = sample();
        let text = models(&study.responses[0]).to_text();
        let line = |name: &str| {
            text.lines().find(|line| line.starts_with(name)).unwrap().split_whitespace().collect::<Vec<_>>()
        };
        assert_eq!(line("full")[1..], ["524", "-", "-", "-", "-", "1.50", "ms"]);
        assert_eq!(line("balanced")[1..], ["20", "0.0500", "0.0900", "12.3", "0.110", "1.50", "ms"]);
    }

    #[test]
    fn ten_frequencies_are_written_out_in_decibels() {
        let study = sample();
        let table = decibel_table(&study.responses[0], 1);
        assert_eq!((table.rows.len(), &*table.rows[0][0], &*table.rows[9][0]), (10, "0", "3162"));
        // 120 - 60 at rest.
        assert_eq!(table.rows[0][1], "35.56");
        assert_eq!(spread(3, 10), [0, 1, 2]);
        assert_eq!(spread(100, 4), [0, 33, 66, 99]);
    }

    #[test]
    fn every_table_fits_the_terminal() {
        let study = sample();
        let locality = study.locality.as_ref().unwrap();
        let mut tables = vec![percentiles(locality), sizes(locality), bases(locality), truncations(&study.hankel[0])];
        tables.extend(study.tables.iter().map(published));
        tables.extend(study.responses.iter().flat_map(|of| [models(of), decibel_table(of, 0)]));
        tables.extend(study.shapes.iter().map(shares));
        for table in tables {
            assert!(table.rows.iter().all(|row| row.len() == table.columns.len()), "{table:?}");
            let text = table.to_text();
            assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        }
    }

    #[test]
    fn percentiles_are_of_each_face_and_of_all() {
        let study = sample();
        let table = percentiles(study.locality.as_ref().unwrap());
        let names: Vec<(&str, &str)> = table.rows.iter().map(|row| (&*row[0], &*row[1])).collect();
        assert_eq!(names, [("z_max", "144"), ("x_max", "60"), ("all", "204")]);
        assert_eq!(table.rows[0][4], "24.0");
    }
}
