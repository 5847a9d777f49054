//! What actors exchange values and samples through: typed ports, with a form for each executor.

pub(crate) mod exchange_port;
pub(crate) mod hot_swap;
pub(crate) mod hot_swap_queue;
pub(crate) mod inlet;
pub(crate) mod outlet;
pub(crate) mod port_state;
pub(crate) mod port_traffic;
pub(crate) mod queue_port;
pub(crate) mod restartable;
pub(crate) mod virtual_exchange;
pub(crate) mod virtual_queue;
