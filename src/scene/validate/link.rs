//! A link that can be.

use super::super::{LinkSpec, Scene};
use super::check::{at_most_ms, not_negative, positive};
use crate::error::Error;
use crate::model::local::Feedback;

/// Longer than anybody waits for a force (ms).
const MAX_DELAY_MS: f64 = 60_000.0;
/// Outages, each of which every message is held against.
const MAX_OUTAGES: usize = 256;

pub(super) fn validate(scene: &Scene) -> Result<(), Error> {
    let Some(link) = &scene.link else { return Ok(()) };
    let LinkSpec { delay_ms, jitter_ms, loss, duplicate, reorder, rate_mbit_s, down_s, .. } = link;
    for (field, ms) in [("link.delay_ms", *delay_ms), ("link.jitter_ms", *jitter_ms)] {
        not_negative(field, ms)?;
        at_most_ms(field, ms, MAX_DELAY_MS)?;
    }
    for (field, share) in [("link.loss", *loss), ("link.duplicate", *duplicate), ("link.reorder", *reorder)] {
        if !(0.0..1.0).contains(&share) {
            return Err(Error::scene(
                field,
                format!("is {share}, must be a share from 0 to below 1, 0.01 for one in a hundred"),
            ));
        }
    }
    rate_mbit_s.map_or(Ok(()), |rate| positive("link.rate_mbit_s", rate))?;
    if down_s.len() > MAX_OUTAGES {
        return Err(Error::scene(
            "link.down_s",
            format!("has {} outages, must be at most {MAX_OUTAGES}", down_s.len()),
        ));
    }
    match down_s.iter().find(|[from, until]| !(0.0 <= *from && from < until && until.is_finite())) {
        None => feedback(scene),
        Some(outage) => {
            let message = format!("has {outage:?}, must be pairs of times such as [1.0, 1.5]: from, and until");
            Err(Error::scene("link.down_s", message))
        }
    }
}

fn feedback(scene: &Scene) -> Result<(), Error> {
    let late = scene.local.feedback.filter(|&feedback| feedback != Feedback::Trajectory);
    late.map_or(Ok(()), |feedback| {
        let message = format!(
            "is {:?}, which comes too late over a link and would tear the body: leave it out, or do without a link",
            feedback.name()
        );
        Err(Error::scene("local.feedback", message))
    })
}
