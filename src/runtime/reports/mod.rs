//! What a run tells of itself: at any moment, and when it is over.

pub(crate) mod group_live;
pub(crate) mod live;
pub(crate) mod report;
pub(crate) mod tell;
pub(crate) mod text;
