//! What tests of the runtime share.
#![allow(dead_code, unused_macros)]

use std::time::{Duration, Instant};

/// Runs test bodies in both executions.
macro_rules! in_both_executions {
    ($($name:ident)*) => {
        mod in_virtual_time { $(#[test] fn $name() { super::$name(palpate_runtime::Execution::Virtual) })* }
        mod on_threads { $(#[test] fn $name() { super::$name(palpate_runtime::Execution::Threaded) })* }
    };
}

/// Keeps the thread busy.
pub fn busy(span: Duration) {
    let start = Instant::now();
    while start.elapsed() < span {
        std::hint::spin_loop();
    }
}
