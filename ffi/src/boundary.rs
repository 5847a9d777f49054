//! The border to C: nothing unwinds across it, and every failure leaves a code and a text.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::code::{Failure, PalpateCode};
use crate::last_error;

/// Makes a code of what `call` came to.
///
/// # Real-time
/// Wait-free, real-time safe, unless `call` panics.
#[inline]
pub(crate) fn boundary(call: impl FnOnce() -> Result<(), Failure>) -> PalpateCode {
    // Unwind safe: what a panic leaves half done is behind a lock or in a handle, and each of them is looked at anew.
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(())) => PalpateCode::Ok,
        Ok(Err(failure)) => fail(&failure),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("of unknown kind");
            let code = fail(&Failure::of(PalpateCode::Internal, format!("palpate panicked: {text}")));
            // What a program throws may panic again when it is dropped.
            std::mem::forget(panic);
            code
        }
    }
}

fn fail(failure: &Failure) -> PalpateCode {
    let more = match failure.code {
        PalpateCode::NullPointer => " is null",
        PalpateCode::WrongSize => {
            ": its `size` is not that of this library's: set it to sizeof, with the header of the same version"
        }
        _ => "",
    };
    last_error::keep([&failure.text, more]);
    failure.code
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_code_and_a_text() {
        assert_eq!(boundary(|| panic!("deliberate")), PalpateCode::Internal);
        assert_eq!(boundary(|| std::panic::panic_any(7)), PalpateCode::Internal);
        assert_eq!(boundary(|| Ok(())), PalpateCode::Ok);
    }
}
