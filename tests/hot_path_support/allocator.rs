//! An allocator that ends the process when a thread that has armed itself uses it.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    // Initialised at compile time and without a destructor: reading it neither allocates nor runs code of its own.
    static ARMED: Cell<bool> = const { Cell::new(false) };
}

/// From now on the calling thread may not touch the heap.
pub fn arm() {
    ARMED.set(true);
}

/// The calling thread may use the heap again.
pub fn disarm() {
    ARMED.set(false);
}

/// The system's allocator, for threads that are not armed.
pub struct Guarded;

fn check(offence: &'static [u8]) {
    if ARMED.get() {
        // SAFETY: writes bytes that live for ever to standard error, then ends; formatting would allocate.
        unsafe {
            libc::write(2, offence.as_ptr().cast(), offence.len());
            libc::abort();
        }
    }
}

// SAFETY: every call is passed to the system's allocator as it came.
unsafe impl GlobalAlloc for Guarded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        check(b"a real-time tick allocated\n");
        // SAFETY: the caller keeps alloc's contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        check(b"a real-time tick allocated\n");
        // SAFETY: the caller keeps alloc_zeroed's contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        check(b"a real-time tick grew an allocation\n");
        // SAFETY: the caller keeps realloc's contract.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        check(b"a real-time tick freed memory\n");
        // SAFETY: the caller keeps dealloc's contract.
        unsafe { System.dealloc(block, layout) }
    }
}
