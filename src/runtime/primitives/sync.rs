//! The only file that names raw atomics: the standard library's, or loom's when the crate is built with `--cfg loom`.
//!
//! The atomics are type aliases, not re-exports: `clippy.toml` bans the types themselves everywhere else, and a lint
//! looks through a re-export but not through an alias.
#![allow(clippy::disallowed_types)]

#[cfg(loom)]
mod imp {
    pub(crate) use loom::cell::UnsafeCell;
    pub(crate) type AtomicBool = loom::sync::atomic::AtomicBool;
    pub(crate) type AtomicU8 = loom::sync::atomic::AtomicU8;
    pub(crate) type AtomicU64 = loom::sync::atomic::AtomicU64;
    pub(crate) type AtomicUsize = loom::sync::atomic::AtomicUsize;
}

#[cfg(not(loom))]
mod imp {
    pub(crate) type AtomicBool = std::sync::atomic::AtomicBool;
    pub(crate) type AtomicU8 = std::sync::atomic::AtomicU8;
    pub(crate) type AtomicU64 = std::sync::atomic::AtomicU64;
    pub(crate) type AtomicUsize = std::sync::atomic::AtomicUsize;

    /// The standard cell with loom's interface: every access is a closure, so that loom can check it.
    #[repr(transparent)]
    pub(crate) struct UnsafeCell<T>(std::cell::UnsafeCell<T>);

    impl<T> UnsafeCell<T> {
        pub(crate) fn new(value: T) -> Self {
            Self(std::cell::UnsafeCell::new(value))
        }

        #[inline]
        pub(crate) fn with<R>(&self, read: impl FnOnce(*const T) -> R) -> R {
            read(self.0.get())
        }

        #[inline]
        pub(crate) fn with_mut<R>(&self, write: impl FnOnce(*mut T) -> R) -> R {
            write(self.0.get())
        }
    }
}

pub(crate) use imp::{AtomicBool, AtomicU8, AtomicU64, AtomicUsize, UnsafeCell};
pub(crate) use std::sync::atomic::Ordering;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks a mutex, also after a panic under it: whoever locks one of ours leaves whole what it guards, and what may
/// panic there is at most a program's `init`, which runs before anything is changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps what two threads write on cache lines of their own; two lines, because adjacent lines are fetched in pairs.
#[derive(Debug, Default)]
#[repr(C, align(128))]
pub(crate) struct CachePadded<T>(pub(crate) T);

impl<T> std::ops::Deref for CachePadded<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

/// Checks a model under every interleaving that loom finds.
#[cfg(all(test, loom))]
pub(crate) fn check(model: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    // Bounded preemptions keep the model small; known bugs of lock-free code need two or three.
    builder.preemption_bound = Some(3);
    builder.check(model);
}
