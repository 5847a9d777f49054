//! The table of all runs, as CSV and as Markdown.

use std::fmt::Write as _;

use crate::figures::ForceFigure;
use crate::forces::Difference;
use crate::runs::ForceRuns;

/// One model in one scene.
pub struct Row {
    pub figure: u32,
    pub scene: &'static str,
    pub model: &'static str,
    /// What counts as 100 %, and its unit.
    pub peak: f64,
    pub unit: &'static str,
    pub difference: Difference,
    pub resyncs: usize,
    /// Behind `full`, where it was determined.
    pub delay_ms: Option<f64>,
}

/// Rows by figure.
#[derive(Default)]
pub struct Table {
    rows: Vec<Row>,
}

impl Table {
    pub fn push(&mut self, row: Row) {
        self.rows.push(row);
    }

    /// Adds a row for each model of a scene.
    pub fn add_forces(&mut self, figure: &ForceFigure, runs: &ForceRuns) {
        for run in runs.all() {
            self.push(Row {
                figure: figure.number,
                scene: figure.scene,
                model: run.model.name(),
                peak: runs.peak,
                unit: "N",
                difference: runs.difference(run),
                resyncs: run.resyncs.len(),
                delay_ms: None,
            });
        }
    }

    /// Brings the rows into the paper's order.
    pub fn sort(&mut self) {
        self.rows.sort_by_key(|row| row.figure);
    }

    /// As CSV, with a header.
    pub fn to_csv(&self) -> String {
        let mut text =
            String::from("figure,scene,model,peak_of_full,unit,rms_pct,max_pct,worst_tick_jump_pct,resyncs,delay_ms\n");
        for row in &self.rows {
            let Difference { rms, max, jump } = row.difference;
            let delay = row.delay_ms.map(|ms| format!("{ms:.2}")).unwrap_or_default();
            let Row { figure, scene, model, peak, unit, resyncs, .. } = row;
            writeln!(
                text,
                "{figure},{scene},\"{model}\",{peak:.5},{unit},{rms:.4},{max:.4},{jump:.4},{resyncs},{delay}"
            )
            .expect("a String takes every text");
        }
        text
    }

    /// As Markdown, aligned so that it reads well on a terminal, too.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from(
            "Difference from `full` and worst change from one tick to the next, in % of the peak of `full`:\n\n\
             | Fig. | scene         | model         |     peak |   rms % |   max % |  jump % | resyncs |\n\
             | ---: | ------------- | ------------- | -------: | ------: | ------: | ------: | ------: |\n",
        );
        for row in &self.rows {
            let Difference { rms, max, jump } = row.difference;
            writeln!(
                text,
                "| {:>4} | {:<13} | {:<13} | {:>8} | {rms:>7.2} | {max:>7.2} | {jump:>7.2} | {:>7} |",
                row.figure,
                row.scene,
                row.model,
                format!("{:.3} {}", row.peak, row.unit),
                row.resyncs
            )
            .expect("a String takes every text");
        }
        text
    }
}
