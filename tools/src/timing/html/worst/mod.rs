//! The worst ticks: a list to choose from, the place for the timeline that a script draws, and a picture of each without it.

mod picture;
mod script_data;
mod view;

use std::fmt::Write;

use super::causes::{badge, hatches};
use super::summary::{at, what_happened};
use crate::drawing::html::{escaped, sentence};
use crate::timing::TimingReport;
use crate::units::{duration, force, plural};
use picture::still;
use script_data::data;
use view::View;

const SCRIPT: &str = include_str!("timeline.js");

/// How the pictures are read.
const KEY: &str = "<p class=\"legend\"><span class=\"badge\"><i class=\"box late\"></i>due, not yet awake (thin)</span>\
    <span class=\"badge\"><i class=\"box work\"></i>at work</span><span class=\"badge\"><i class=\"box missed\"></i>at work, \
    deadline missed (framed, with the sign of its cause)</span><span class=\"badge\"><i class=\"box hatched\"></i>periods \
    skipped (hatched, with the sign of their cause)</span><span class=\"badge\"><i class=\"box deadline\"></i>deadline</span>\
    <span class=\"badge\"><i class=\"dash c1\"></i>force before safety</span><span class=\"badge\"><i class=\"dash c2 dashed\">\
    </i>force commanded</span></p>\n";

/// The chapter and its script; nothing if no tick took any time.
pub(crate) fn worst(report: &TimingReport) -> String {
    let mut out = String::from("<h2 id=\"worst\">The worst ticks</h2>\n");
    if report.worst.is_empty() {
        out.push_str("<p class=\"faint\">There is none: the log holds no single releases, or none took any time that was measured.</p>\n");
        return out;
    }
    let views: Vec<View<'_>> = report.worst.iter().map(|worst| View::of(report, worst)).collect();
    out.push_str(
        "<p class=\"faint\">One of each episode, the longest overdue in deadlines first; time is counted from when the first \
         period was due that the tick stands for.</p>\n<ol class=\"worst\">\n",
    );
    for (number, view) in views.iter().enumerate() {
        out.push_str(&entry(number, view));
    }
    out.push_str("</ol>\n");
    out.push_str(&hatches());
    out.push_str(LIVE);
    out.push_str(KEY);
    out.push_str("<div class=\"stills\">\n");
    for (number, view) in views.iter().enumerate() {
        let title = format!("{}. {} at {}", number + 1, view.worst.group, at(view.worst));
        let _ = writeln!(
            out,
            "<figure id=\"moment{number}\"><h3>{}</h3><p>{}</p><div class=\"wide\">\n{}</div></figure>",
            escaped(&title),
            sentence(&what_happened(view.worst)),
            still(view, &title)
        );
    }
    out.push_str("</div>\n");
    let _ = writeln!(
        out,
        "<script type=\"application/json\" id=\"moments\">{}</script>\n<script>\n{SCRIPT}</script>",
        data(&views)
    );
    out
}

/// What the script fills and shows.
const LIVE: &str = "<section class=\"live\" id=\"timeline\" aria-label=\"Timeline around a worst tick\" hidden>\n\
    <div class=\"tools\"><strong id=\"tl-title\"></strong><span class=\"buttons\">\
    <button type=\"button\" id=\"tl-out\" aria-label=\"zoom out\">&#8722;</button>\
    <button type=\"button\" id=\"tl-in\" aria-label=\"zoom in\">+</button>\
    <button type=\"button\" id=\"tl-left\" aria-label=\"earlier\">&#8592;</button>\
    <button type=\"button\" id=\"tl-right\" aria-label=\"later\">&#8594;</button>\
    <button type=\"button\" id=\"tl-tick\">the tick</button>\
    <button type=\"button\" id=\"tl-all\">all</button></span></div>\n<p id=\"tl-words\"></p>\n\
    <div id=\"tl-plot\" tabindex=\"0\" role=\"group\" aria-roledescription=\"timeline\" aria-describedby=\"tl-help\"></div>\n\
    <p id=\"tl-info\" role=\"status\" aria-live=\"polite\"></p>\n\
    <p id=\"tl-help\" class=\"faint\">Drag to move; click into it, then turn the wheel to zoom, or pinch. Keys: + and &#8722; \
    zoom, arrows left and right move, up and down choose a group, n and p the next and the previous tick, 0 shows all.</p>\n\
    </section>\n";

fn entry(number: usize, view: &View<'_>) -> String {
    let worst = view.worst;
    let what = match (worst.is_trouble(), worst.timing.slips) {
        (false, _) => "<span class=\"badge\">in time</span>".to_owned(),
        (true, 0) => format!("{} missed", badge(worst.cause)),
        (true, slips) => format!("{} {} skipped", badge(worst.cause), plural(slips.into(), "period", "periods")),
    };
    let mut more = String::new();
    if !worst.meanwhile.is_empty() {
        let _ = write!(more, "<span class=\"faint\">meanwhile {} at work</span>", escaped(&worst.meanwhile.join(", ")));
    }
    if let Some(step) = worst.force_step_n {
        let _ = write!(more, "<span class=\"faint\">force step {}</span>", force(step));
    }
    format!(
        "<li><a href=\"#moment{number}\" data-moment=\"{number}\"><strong>{}</strong><span>{}</span><span>overdue {}</span>\
         <span>{what}</span>{more}</a></li>\n",
        escaped(&worst.group),
        at(worst),
        duration(worst.overdue.0)
    )
}
