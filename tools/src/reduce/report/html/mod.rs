//! A reduction as a page with plots, in one file: no network, no script.

mod hankel;
mod locality;
mod published;
mod responses;
mod shapes;

use std::fmt::Write;

use super::table::prose;
use super::words;
use crate::drawing::html::{escaped, page};
use crate::drawing::svg::{Chart, Line, Point, Sign, heat_style};
use crate::reduce::findings::ReductionStudy;

const STYLE: &str = include_str!("reduce.css");
/// Charts stand three beside each other, or one on a narrow screen.
const SIZE: [f64; 2] = [360.0, 250.0];

/// The study as an HTML page that needs nothing else.
pub fn to_html(study: &ReductionStudy) -> String {
    let mut body = format!("<h1>Model reduction: {}</h1>\n", escaped(&study.subject));
    if let Some(found) = &study.locality {
        body.push_str(&locality::verdict(found));
    }
    if let Some(verdict) = words::tables_verdict(study) {
        let _ = writeln!(body, "<p class=\"lead\">{}</p>", escaped(&verdict));
    }
    let _ = writeln!(body, "<p class=\"faint\">{}</p>", escaped(&words::facts(study)));
    if let Some(note) = words::debug_note() {
        let _ = writeln!(body, "<p class=\"note\">{}</p>", escaped(note));
    }
    let mut style = STYLE.to_owned() + &heat_style();
    if let Some(found) = &study.locality {
        body.push_str(&locality::maps(found));
        body.push_str(&locality::sizes(found));
    }
    body.push_str(&published::tables(&study.tables));
    body.push_str(&responses::responses(&study.responses, &mut style));
    body.push_str(&hankel::decays(&study.hankel));
    body.push_str(&shapes::shapes(&study.shapes));
    page(&format!("palpate reduce: {}", study.subject), &style, &body)
}

/// A chart or a map with what it shows, a sentence that may have `code` in it.
fn figure(svg: &str, caption: &str) -> String {
    let caption =
        if caption.is_empty() { String::new() } else { format!("<figcaption>{}</figcaption>", prose(caption)) };
    format!("<figure class=\"chart\">\n{svg}{caption}</figure>\n")
}

/// A curve of a chart with what it is called beside it.
#[derive(Clone, Debug)]
struct Curve<'a> {
    name: &'a str,
    class: &'static str,
    is_hollow: bool,
    points: Vec<(f64, f64)>,
}

impl<'a> Curve<'a> {
    /// Without the points that a logarithmic axis cannot show.
    fn new(name: &'a str, class: &'static str, points: impl Iterator<Item = (f64, f64)>) -> Self {
        let points = points.filter(|(x, y)| x.is_finite() && y.is_finite() && *y > 0.0).collect();
        Self { name, class, is_hollow: false, points }
    }

    fn hollow(self) -> Self {
        Self { is_hollow: true, ..self }
    }
}

/// Draws curves with their points into a chart, and names them below it.
fn with_points(mut chart: Chart<'_>, curves: &[Curve<'_>], caption: &str) -> String {
    let mut legend = String::from("<div class=\"legend\">");
    for curve in curves.iter().filter(|curve| !curve.points.is_empty()) {
        let dash = if curve.is_hollow { " d1" } else { "" };
        let (class, hollow) = (curve.class, if curve.is_hollow { " hollow" } else { "" });
        let points = curve.points.iter().map(|at| Point {
            class: class.to_owned(),
            label: String::new(),
            at: *at,
            sign: Sign::Disc,
            is_hollow: curve.is_hollow,
        });
        chart.points.extend(points);
        chart.lines.push(Line { class: format!("{class}{dash}"), name: "", points: curve.points.clone() });
        let _ = write!(
            legend,
            "<span class=\"badge\"><svg class=\"key\" viewBox=\"0 0 30 10\"><path class=\"line {class}{dash}\" d=\"M0 5H30\"/>\
             <g class=\"{class}\"><circle class=\"point{hollow}\" cx=\"15\" cy=\"5\" r=\"3.5\"/></g></svg>{}</span>",
            escaped(curve.name)
        );
    }
    legend.push_str("</div>\n");
    let caption = if caption.is_empty() { String::new() } else { prose(caption) };
    format!("<figure class=\"chart\">\n{}{legend}<figcaption>{caption}</figcaption></figure>\n", chart.to_svg())
}

/// All y of some curves.
fn heights<'a>(curves: &'a [Curve<'_>]) -> impl Iterator<Item = f64> + use<'a> {
    curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.1))
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;

    /// Check that every element is closed where it was opened.
    #[track_caller]
    fn assert_is_balanced(page: &str) {
        let mut open = Vec::new();
        for part in page.split('<').skip(1) {
            let tag = part.split('>').next().unwrap();
            let name = tag.split([' ', '\n', '/']).find(|word| !word.is_empty()).unwrap_or_default();
            match tag {
                _ if tag.starts_with('!') || ["meta", "br", "input"].contains(&name) || tag.ends_with('/') => {}
                _ if tag.starts_with('/') => assert_eq!(open.pop(), Some(name), "{part}"),
                _ => open.push(name),
            }
        }
        assert!(open.is_empty(), "{open:?}");
    }

    #[test]
    fn the_page_has_every_part_and_needs_nothing_else() {
        let page = to_html(&sample());
        // For a look at it in a browser.
        if let Some(file) = std::env::var_os("PALPATE_SAMPLE_PAGE") {
            std::fs::write(file, &page).unwrap();
        }
        assert_is_balanced(&page);
        for part in [
            "<title>palpate reduce: scenes/&lt;nodule&gt;.toml</title>",
            "NOT LOCAL",
            "Without what lies outside",
            "a stiff inclusion at (70, 60, 40)\u{a0}mm",
            "error (%), between resyncs",
            "error (%), at rest",
            "tangential: gain",
            "normal: phase",
            "phase (deg)",
            "Hankel singular values",
            "Table 1, 3D",
            "Table 2",
            "damping ratio",
            "published",
            "top layer",
            "vertical slice",
            "states r",
            "prefers-color-scheme: dark",
            "@media print",
        ] {
            assert!(page.contains(part), "{part:?} is not in the page");
        }
        for outside in ["http", "src=", "@import", "url(", "<script", "<link", "NaN", "\"inf", " inf"] {
            assert!(!page.contains(outside), "the page has {outside:?}");
        }
    }

    #[test]
    fn a_study_of_nothing_and_figures_that_are_missing_still_make_a_page() {
        assert_is_balanced(&to_html(&ReductionStudy::default()));
        let mut study = sample();
        for model in &mut study.responses[0].models {
            model.gains = vec![vec![[f64::NAN, 0.0]; 2]];
        }
        study.hankel[0].values.clear();
        study.hankel[0].truncations.clear();
        study.tables[0].rows.clear();
        for shapes in &mut study.shapes {
            shapes.states[0].amplitude = vec![f64::NAN];
            shapes.in_local.clear();
        }
        let locality = study.locality.as_mut().unwrap();
        locality.faces[0].contacts = vec![None; 144];
        locality.faces[1].first_m.clear();
        locality.sizes.clear();
        let page = to_html(&study);
        assert_is_balanced(&page);
        assert!(!page.contains("NaN"), "{page}");
    }
}
