//! Who is still running, what went wrong first, what is started again, and in which order things stop.

pub(crate) mod overdue;
pub(crate) mod restart;
pub(crate) mod stop;
pub(crate) mod supervisor;
