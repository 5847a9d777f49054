//! What is alive: setups and sessions by number, so that a number that was freed, or never given, is recognised.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::code::{Failure, PalpateCode};

/// The values of one kind that are alive. Numbers are given once, from 1, over all kinds.
pub(crate) struct Handles<T> {
    alive: Mutex<BTreeMap<u64, Arc<Mutex<T>>>>,
    /// What a number that is none of these was meant to be.
    kind: &'static str,
}

/// The last number that was given.
static LAST: Mutex<u64> = Mutex::new(0);

impl<T> Handles<T> {
    pub(crate) const fn new(kind: &'static str) -> Self {
        Self { alive: Mutex::new(BTreeMap::new()), kind }
    }

    pub(crate) fn add(&self, value: T) -> u64 {
        let number = {
            let mut last = lock(&LAST);
            *last += 1;
            *last
        };
        lock(&self.alive).insert(number, Arc::new(Mutex::new(value)));
        number
    }

    /// The value with this number, which another thread may hold.
    pub(crate) fn get(&self, number: u64) -> Result<Arc<Mutex<T>>, Failure> {
        lock(&self.alive).get(&number).cloned().ok_or_else(|| self.unknown(number))
    }

    /// Calls `with` with the value of this number. Whoever else wants it waits.
    pub(crate) fn with<R>(&self, number: u64, with: impl FnOnce(&mut T) -> Result<R, Failure>) -> Result<R, Failure> {
        let value = self.get(number)?;
        with(&mut lock(&value))
    }

    /// Takes the value out: its number is recognised as gone from now on.
    pub(crate) fn take(&self, number: u64) -> Result<Arc<Mutex<T>>, Failure> {
        lock(&self.alive).remove(&number).ok_or_else(|| self.unknown(number))
    }

    fn unknown(&self, number: u64) -> Failure {
        let was_given = (1..=*lock(&LAST)).contains(&number);
        let what = if was_given { "is gone, or of another kind" } else { "was never given" };
        Failure::of(PalpateCode::BadHandle, format!("no {} {number}: it {what}", self.kind))
    }
}

/// Locks also after a panic: that was told, and what it left half done tells its own story.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_given_once_and_what_is_gone_is_told_from_what_never_was() {
        let (some, others) = (Handles::new("some"), Handles::new("other"));
        let (first, second) = (some.add('a'), others.add('b'));
        assert_ne!(first, second);
        assert_eq!(some.with(first, |value| Ok(*value)).unwrap(), 'a');
        some.take(first).unwrap();
        let text = |result: Result<_, Failure>| result.map(|_| ()).unwrap_err().text.into_owned();
        assert!(text(some.take(first)).contains("is gone"));
        assert!(text(some.get(second)).contains("another kind"));
        assert!(text(some.get(0)).contains("never given") && text(some.get(u64::MAX)).contains("never given"));
    }
}
