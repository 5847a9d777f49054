//! The two executors: threads in real time, and virtual time on one thread.

pub(crate) mod beginning;
pub(crate) mod device_wait;
pub(crate) mod disturbance;
pub(crate) mod group_thread;
pub(crate) mod hosted;
pub(crate) mod schedule;
pub(crate) mod threaded;
pub(crate) mod virtual_time;

/// The execution of a graph: in virtual time or in real time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Execution {
    /// One thread for everything, in the order of virtual time, as fast as the machine allows; bit-identical every
    /// time.
    Virtual,
    /// One thread per rate group, in real time.
    #[default]
    Threaded,
}
