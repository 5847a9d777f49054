//! The text of the last failure of each thread, in a buffer of its own: a failing tick allocates nothing either.

use std::cell::RefCell;
use std::ffi::c_char;

/// Longest text, in bytes, with the zero at its end.
const LONGEST: usize = 1024;

thread_local! {
    // Constant and without a destructor: neither the first nor the last use on a thread allocates.
    static TEXT: RefCell<[u8; LONGEST]> = const { RefCell::new([0; LONGEST]) };
}

/// Keeps `parts` one behind the other, shortened if need be, without what would end them early.
///
/// # Real-time
/// Wait-free, real-time safe.
pub(crate) fn keep(parts: [&str; 2]) {
    TEXT.with_borrow_mut(|kept| {
        let mut length = 0;
        for part in parts {
            let whole = part.len().min(LONGEST - 1 - length);
            let fits = (0..=whole).rev().find(|&end| part.is_char_boundary(end)).unwrap_or(0);
            kept[length..length + fits].copy_from_slice(&part.as_bytes()[..fits]);
            length += fits;
        }
        kept[..length].iter_mut().filter(|byte| **byte == 0).for_each(|byte| *byte = b' ');
        kept[length] = 0;
    });
}

/// Where the text is, for as long as the thread lives; the next failure overwrites it.
///
/// # Real-time
/// Wait-free, real-time safe.
pub(crate) fn text() -> *const c_char {
    TEXT.with(|kept| kept.as_ptr().cast())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept() -> String {
        TEXT.with_borrow(|kept| std::ffi::CStr::from_bytes_until_nul(kept).unwrap().to_str().unwrap().to_owned())
    }

    #[test]
    fn a_text_is_kept_whole_if_it_fits_and_cut_between_characters_if_not() {
        keep(["one\0two", " three"]);
        assert_eq!(kept(), "one two three");
        keep([&"ü".repeat(LONGEST), "x"]);
        assert_eq!(kept(), format!("{}x", "ü".repeat((LONGEST - 1) / 2)));
        keep(["", ""]);
        assert_eq!(kept(), "");
    }
}
