//! The one validation that builder and scene files pass through.

use super::Scene;
use crate::error::Error;

pub(super) fn validate(_scene: &Scene) -> Result<(), Error> {
    Ok(())
}
