//! What a panic in an actor prints: nothing. Its text and place are kept for the report.
//!
//! The standard hook takes the lock of standard error and writes there, which a real-time thread must not do. Ours does
//! so only for panics outside of actors; for those inside it copies the place into a buffer of the thread's own.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, Location, catch_unwind, set_hook, take_hook};
use std::sync::Once;

/// Longest file name kept, in bytes; the end of a longer one is what tells files apart.
const LONGEST: usize = 96;

/// Where a panic happened.
#[derive(Clone, Copy)]
struct Place {
    file: [u8; LONGEST],
    length: usize,
    line: u32,
}

thread_local! {
    // Constant and without a destructor: reading and writing them never allocates.
    static IN_ACTOR: Cell<bool> = const { Cell::new(false) };
    static PLACE: Cell<Place> = const { Cell::new(Place { file: [0; LONGEST], length: 0, line: 0 }) };
}

/// Puts our hook in front of the program's, once per process. A hook that the program sets later replaces both.
pub(crate) fn install() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let program = take_hook();
        set_hook(Box::new(move |info| match info.location() {
            Some(location) if IN_ACTOR.get() => keep(location),
            _ => program(info),
        }));
    });
}

/// Calls an actor; a panic in it is kept quiet, and its text is the error.
///
/// # Real-time
/// Wait-free, real-time safe, unless it panics.
#[inline]
pub(crate) fn guarded<R>(call: impl FnOnce() -> R) -> Result<R, String> {
    let before = IN_ACTOR.replace(true);
    let result = caught(call);
    IN_ACTOR.set(before);
    result
}

/// Calls an actor where the program's own hook may print: before and after the run.
pub(crate) fn caught<R>(call: impl FnOnce() -> R) -> Result<R, String> {
    // Unwind safe: after a panic an actor is asked whether it can go on, or stopped and dropped, nothing else.
    catch_unwind(AssertUnwindSafe(call)).map_err(text_of)
}

fn keep(location: &Location<'_>) {
    let name = location.file().as_bytes();
    let end = &name[name.len().saturating_sub(LONGEST)..];
    let mut file = [0; LONGEST];
    file[..end.len()].copy_from_slice(end);
    PLACE.set(Place { file, length: end.len(), line: location.line() });
}

/// Takes the place of this thread's last quiet panic, as ` at FILE:LINE`; empty if the program's own hook saw it.
pub(crate) fn place() -> String {
    let place = PLACE.replace(Place { file: [0; LONGEST], length: 0, line: 0 });
    let file = String::from_utf8_lossy(&place.file[..place.length]).into_owned();
    if file.is_empty() { file } else { format!(" at {file}:{}", place.line) }
}

/// What a panic said.
fn text_of(panic: Box<dyn Any + Send>) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    let place = PLACE.get();
    // What was thrown is the actor's own value, and its drop may panic like anything else of it. What that throws is
    // leaked: this has to end.
    let _ = catch_unwind(AssertUnwindSafe(|| drop(panic))).map_err(std::mem::forget);
    PLACE.set(place);
    text.unwrap_or_else(|| "no text was given".to_owned())
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_panic_in_an_actor_leaves_its_place_and_one_outside_does_not() {
        install();
        assert_eq!(guarded(|| panic!("inside")), Err::<(), _>("inside".to_owned()));
        let line = line!() - 1;
        assert!(place().ends_with(&format!("panic_hook.rs:{line}")));
        assert_eq!(place(), "", "it is taken once");
        assert!(caught(|| panic!("outside, printed by the test harness")).is_err());
        assert_eq!(place(), "");
    }
}
