//! How causes look: each has words, a colour and a sign of its own.

use std::fmt::Write;

use palpate::runtime::SlipCause;

use crate::drawing::svg::Sign;

/// The causes in the order of a legend.
pub(crate) const CAUSES: [SlipCause; 6] = [
    SlipCause::LateWake,
    SlipCause::LongTick,
    SlipCause::StalledPeer,
    SlipCause::Policy,
    SlipCause::Fault,
    SlipCause::None,
];

/// The class that colours a cause.
pub(crate) fn class(cause: SlipCause) -> String {
    format!("cause{}", cause as u8)
}

pub(crate) fn name(cause: SlipCause) -> &'static str {
    match cause {
        SlipCause::None => "no cause recorded",
        cause => cause.name(),
    }
}

/// What happened, as the end of a sentence.
pub(crate) fn words(cause: SlipCause) -> &'static str {
    match cause {
        SlipCause::None => "no cause was recorded",
        SlipCause::LateWake => "its thread was woken too late: the system or another thread had the core",
        SlipCause::LongTick => "its own work took longer than its period allows",
        SlipCause::StalledPeer => "it waited for another group or for a device that did not deliver",
        SlipCause::Policy => "its overrun policy gave periods up",
        SlipCause::Fault => "it had failed and was not yet started again",
    }
}

pub(crate) fn sign(cause: SlipCause) -> Sign {
    match cause {
        SlipCause::LateWake => Sign::Triangle,
        SlipCause::LongTick => Sign::Square,
        SlipCause::StalledPeer => Sign::Diamond,
        SlipCause::Policy => Sign::Disc,
        SlipCause::Fault | SlipCause::None => Sign::Cross,
    }
}

/// The sign of a cause, to stand in a line of text.
pub(crate) fn icon(cause: SlipCause) -> String {
    let (class, path) = (class(cause), sign(cause).path(6.0, 6.0));
    format!(
        "<svg class=\"icon\" viewBox=\"0 0 12 12\" aria-hidden=\"true\"><path class=\"sign {class}\" d=\"{path}\"/></svg>"
    )
}

/// A cause with its sign.
pub(crate) fn badge(cause: SlipCause) -> String {
    format!("<span class=\"badge\">{}{}</span>", icon(cause), name(cause))
}

/// The colours of lines with their words, and `more` about them, which are HTML.
pub(crate) fn key(entries: &[(&str, &str)], more: &str) -> String {
    let mut out = String::from("<p class=\"legend\">");
    for (class, words) in entries {
        let _ = write!(out, "<span class=\"badge\"><i class=\"dash {class}\"></i>{words}</span>");
    }
    let _ = writeln!(out, "<span class=\"faint\">{more}</span></p>");
    out
}

/// The signs of these causes, with what filled and hollow ones mean; nothing without a cause.
pub(crate) fn legend(causes: &[SlipCause]) -> String {
    if causes.is_empty() {
        return String::new();
    }
    let mut out = String::from("<p class=\"legend\">");
    for &cause in causes {
        out.push_str(&badge(cause));
    }
    out.push_str(
        "<span class=\"faint\">upper row, filled: periods skipped; lower row, hollow: deadlines missed</span></p>\n",
    );
    out
}

/// Patterns for what was skipped, one for each cause; for all pictures of a page.
pub(crate) fn hatches() -> String {
    let mut out = String::from("<svg class=\"defs\" width=\"0\" height=\"0\" aria-hidden=\"true\"><defs>\n");
    for cause in CAUSES {
        let (number, class) = (cause as u8, class(cause));
        // Slanted one way or the other, so that two causes side by side differ without colour.
        let turn = if number.is_multiple_of(2) { 45 } else { -45 };
        let width = if number > 2 { 3 } else { 2 };
        let _ = writeln!(
            out,
            "<pattern id=\"hatch{number}\" class=\"{class}\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" \
             patternTransform=\"rotate({turn})\"><path class=\"hatch\" d=\"M0 0V6\" stroke-width=\"{width}\"/></pattern>"
        );
    }
    out.push_str("</defs></svg>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_has_words_a_class_and_a_hatch() {
        assert_eq!(CAUSES.len(), SlipCause::ALL.len());
        let hatches = hatches();
        for cause in CAUSES {
            assert!(hatches.contains(&format!("id=\"hatch{}\"", cause as u8)) && !words(cause).is_empty());
            assert!(icon(cause).contains(&class(cause)));
        }
        // Those that a log can name differ in shape too.
        let signs: Vec<Sign> = CAUSES[..5].iter().map(|&cause| sign(cause)).collect();
        assert!((0..5).all(|i| (0..i).all(|k| signs[i] != signs[k])));
    }
}
