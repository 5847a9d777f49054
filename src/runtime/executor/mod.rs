//! The two executors: threads in real time, and virtual time on one thread.

pub(crate) mod device_wait;
pub(crate) mod disturbance;
pub(crate) mod group_thread;
pub(crate) mod threaded;
pub(crate) mod virtual_time;

/// How a graph is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Execution {
    /// One thread for everything, in the order of virtual time, as fast as the machine allows; bit-identical every time.
    Virtual,
    /// One thread per rate group, in real time.
    Threaded,
}
