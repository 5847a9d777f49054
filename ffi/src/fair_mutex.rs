//! A mutex that is taken in turns.

use std::sync::{Mutex, MutexGuard};

use crate::handles::lock;

/// A mutex whose holder, when it takes it again at once, comes after those who waited meanwhile.
///
/// The standard one goes to whoever is awake, and that is the thread that has just let it go. Here whoever waits for the value holds
/// the door, which the last holder has to pass again.
#[derive(Debug, Default)]
pub(crate) struct FairMutex<T> {
    door: Mutex<()>,
    value: Mutex<T>,
}

impl<T> FairMutex<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { door: Mutex::new(()), value: Mutex::new(value) }
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, T> {
        let _door = lock(&self.door);
        lock(&self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;
    use std::time::Duration;

    // Check that one who takes it again and again lets another in.
    #[test]
    fn who_waits_comes_before_who_takes_it_again() {
        const ROUNDS: u32 = 200;
        let (mutex, begun) = (FairMutex::new(false), Barrier::new(2));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                begun.wait();
                *mutex.lock() = true;
            });
            let held_in_vain = |round: u32| {
                let has_come = mutex.lock();
                if round == 0 {
                    begun.wait();
                }
                std::thread::sleep(Duration::from_millis(5));
                !*has_come
            };
            let rounds = (0..ROUNDS).take_while(|&round| held_in_vain(round)).count();
            assert!(rounds < 20, "another waited {rounds} rounds of 5 ms");
        });
    }
}
