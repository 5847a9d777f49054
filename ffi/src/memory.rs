//! What C points at: the one place where pointers are followed.
//!
//! A null pointer and a struct of another size are failures. What else a pointer may be, the caller answers for: the exported
//! functions say so under *Safety*.

use std::ffi::{CStr, c_char};

use crate::code::{Failure, PalpateCode};
use crate::types::{
    PalpateBlock, PalpateCommand, PalpateContact, PalpateDevice, PalpateState, PalpateSummary, PalpateTetrahedra,
    PalpateTool,
};

/// A struct that begins with its own size in bytes, so that one of another version is recognised.
///
/// # Safety
/// The type is `repr(C)`, its first field is a `u32` with the size, and it consists of numbers and pointers, for which every pattern of
/// bits is a value.
pub(crate) unsafe trait Sized32: Copy {
    /// The name in C.
    const NAME: &'static str;
}

macro_rules! sized {
    ($($type:ident)*) => {
        $(
            // SAFETY: each is `repr(C)`, begins with `size: u32` and has numbers and pointers only.
            unsafe impl Sized32 for $type {
                const NAME: &'static str = stringify!($type);
            }
        )*
    };
}

sized! { PalpateBlock PalpateCommand PalpateContact PalpateDevice PalpateState PalpateSummary PalpateTetrahedra PalpateTool }

/// Reads the struct at `pointer`.
///
/// # Safety
/// `pointer` is null or points at a struct whose first field is its size, which can be read and is not written meanwhile.
#[inline]
pub(crate) unsafe fn read<T: Sized32>(pointer: *const T) -> Result<T, Failure> {
    // SAFETY: the caller's promise.
    unsafe { check_size(pointer)? };
    // SAFETY: the caller's promise, and the size is that of `T`, of which every pattern of bits is a value.
    Ok(unsafe { pointer.read_unaligned() })
}

/// Fills the struct at `pointer`.
///
/// # Safety
/// The same as of [`read`], and it can be written.
#[inline]
pub(crate) unsafe fn write<T: Sized32>(pointer: *mut T, value: T) -> Result<(), Failure> {
    // SAFETY: the caller's promise.
    unsafe { check_size(pointer)? };
    // SAFETY: the caller's promise, and the size is that of `T`.
    unsafe { pointer.write_unaligned(value) };
    Ok(())
}

/// Checks the size that the struct at `pointer` says it has.
///
/// # Safety
/// That of [`read`].
#[inline]
pub(crate) unsafe fn check_size<T: Sized32>(pointer: *const T) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(PalpateCode::NullPointer, T::NAME));
    }
    // SAFETY: the caller's promise: it begins with its size, whatever that is.
    let size = unsafe { pointer.cast::<u32>().read_unaligned() };
    if size as usize != size_of::<T>() {
        return Err(Failure::new(PalpateCode::WrongSize, T::NAME));
    }
    Ok(())
}

/// Puts `value` at `pointer`.
///
/// # Safety
/// `pointer` is null or can be written.
pub(crate) unsafe fn put<T: Copy>(pointer: *mut T, value: T, name: &'static str) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(PalpateCode::NullPointer, name));
    }
    // SAFETY: the caller's promise.
    unsafe { pointer.write_unaligned(value) };
    Ok(())
}

/// Puts what `make` gives at `pointer`, and nothing before that: so nothing is made that nobody gets.
///
/// # Safety
/// That of [`put`].
pub(crate) unsafe fn put_made<T: Copy + Default>(
    pointer: *mut T,
    name: &'static str,
    make: impl FnOnce() -> Result<T, Failure>,
) -> Result<(), Failure> {
    // SAFETY: the caller's promise.
    unsafe { put(pointer, T::default(), name)? };
    let made = make()?;
    // SAFETY: the caller's promise.
    unsafe { put(pointer, made, name) }
}

/// The `count` numbers at `pointer`.
///
/// # Safety
/// `pointer` is null or points at `count` values that can be read, and are not written during the call.
pub(crate) unsafe fn numbers<T: Copy>(pointer: *const T, count: usize, name: &'static str) -> Result<Vec<T>, Failure> {
    let bytes = count.checked_mul(size_of::<T>()).filter(|&bytes| isize::try_from(bytes).is_ok());
    if bytes.is_none() {
        return Err(Failure::argument(format!("{count} {name} are more than memory has")));
    }
    if pointer.is_null() {
        return if count == 0 { Ok(Vec::new()) } else { Err(Failure::new(PalpateCode::NullPointer, name)) };
    }
    // SAFETY: the caller's promise; no more than memory can have.
    Ok((0..count).map(|place| unsafe { pointer.add(place).read_unaligned() }).collect())
}

/// Puts `values` at `pointer`, where there is room for `room` of them.
///
/// # Safety
/// `pointer` is null or points at room for `room` values.
pub(crate) unsafe fn fill<T: Copy>(
    values: impl ExactSizeIterator<Item = T>,
    pointer: *mut T,
    room: usize,
    name: &'static str,
) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(PalpateCode::NullPointer, name));
    }
    let count = values.len();
    if room < count {
        return Err(Failure::argument(format!("{name}: room for {room}, and there are {count}")));
    }
    for (place, value) in values.take(count).enumerate() {
        // SAFETY: the caller's promise, and there is room.
        unsafe { pointer.add(place).write_unaligned(value) };
    }
    Ok(())
}

/// The text at `pointer`.
///
/// # Safety
/// `pointer` is null or points at a text that a zero byte ends, which is not written during the call.
pub(crate) unsafe fn text(pointer: *const c_char, name: &'static str) -> Result<String, Failure> {
    if pointer.is_null() {
        return Err(Failure::new(PalpateCode::NullPointer, name));
    }
    // SAFETY: the caller's promise.
    let text = unsafe { CStr::from_ptr(pointer) };
    let text = text.to_str().map_err(|_| Failure::argument(format!("{name} is not UTF-8")))?;
    Ok(text.to_owned())
}
