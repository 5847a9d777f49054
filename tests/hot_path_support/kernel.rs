//! What the kernel is asked about, or told to forbid, by the thread that calls.

use std::io::Error;

/// Kills the process with SIGSYS at the calling thread's next system call that is no sleep. There is no way back.
///
/// # Errors
/// The reason why the kernel refused.
pub fn forbid_everything_but_sleep() -> Result<(), Error> {
    #[cfg(target_arch = "x86_64")]
    const ARCHITECTURE: u32 = 0xc000_003e;
    #[cfg(target_arch = "aarch64")]
    const ARCHITECTURE: u32 = 0xc000_00b7;
    // Offsets in the kernel's seccomp_data.
    const NUMBER: u32 = 0;
    const ARCH: u32 = 4;
    const LOAD: u32 = libc::BPF_LD | libc::BPF_W | libc::BPF_ABS;
    const IS: u32 = libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K;
    const RETURN: u32 = libc::BPF_RET | libc::BPF_K;
    let step = |code: u32, k: u32, jt: u8, jf: u8| libc::sock_filter { code: code as u16, jt, jf, k };
    let mut steps = [
        step(LOAD, ARCH, 0, 0),
        step(IS, ARCHITECTURE, 0, 3),
        step(LOAD, NUMBER, 0, 0),
        step(IS, libc::SYS_clock_nanosleep as u32, 2, 0),
        // How the kernel goes on with a sleep that a stop signal interrupted.
        step(IS, libc::SYS_restart_syscall as u32, 1, 0),
        step(RETURN, libc::SECCOMP_RET_KILL_PROCESS, 0, 0),
        step(RETURN, libc::SECCOMP_RET_ALLOW, 0, 0),
    ];
    let program = libc::sock_fprog { len: steps.len() as u16, filter: steps.as_mut_ptr() };
    // SAFETY: the first call takes numbers only; the second reads the program, which outlives it. Without the flag that
    // synchronises threads the filter is the calling thread's own.
    let refused = unsafe {
        libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0
            || libc::syscall(libc::SYS_seccomp, libc::SECCOMP_SET_MODE_FILTER, 0, &raw const program) != 0
    };
    if refused { Err(Error::last_os_error()) } else { Ok(()) }
}

/// What the kernel counted for the calling thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Usage {
    /// Page faults that needed no disk, and those that did.
    pub faults: [i64; 2],
    /// How often it gave up its core to wait for something.
    pub waits: i64,
}

impl Usage {
    pub fn now() -> Self {
        // SAFETY: rusage is plain numbers, for which zero is a value.
        let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
        // SAFETY: the pointer is to an rusage of our own.
        unsafe { libc::getrusage(libc::RUSAGE_THREAD, &mut usage) };
        Self { faults: [usage.ru_minflt, usage.ru_majflt], waits: usage.ru_nvcsw }
    }
}

/// True if the calling thread is scheduled by SCHED_FIFO.
pub fn is_realtime() -> bool {
    // SAFETY: takes a number.
    let policy = unsafe { libc::sched_getscheduler(0) };
    policy & !libc::SCHED_RESET_ON_FORK == libc::SCHED_FIFO
}

/// Touches a page that is not in memory.
pub fn fault_a_page() {
    const PAGE: usize = 4096;
    let (rights, kind) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
    // SAFETY: maps a page that nothing else knows. Where all memory is locked it comes with the page in place, so it is
    // unlocked and given back before it is written.
    unsafe {
        let page = libc::mmap(std::ptr::null_mut(), PAGE, rights, kind, -1, 0);
        libc::munlock(page, PAGE);
        assert_eq!(libc::madvise(page, PAGE, libc::MADV_DONTNEED), 0);
        page.cast::<u8>().write_volatile(1);
    }
}

/// Sleeps a little, as a thread does that waits for a lock.
pub fn wait_a_little() {
    let span = libc::timespec { tv_sec: 0, tv_nsec: 50_000 };
    // SAFETY: the pointer is to a timespec of our own; no remainder is asked for.
    unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, 0, &span, std::ptr::null_mut()) };
}

/// A system call that does nothing.
pub fn ask_for_the_parent() {
    // SAFETY: takes and touches nothing.
    unsafe { libc::getppid() };
}

/// Ends the process at once: the filtered thread could not end in order.
pub fn exit_now(code: i32) -> ! {
    // SAFETY: does not return; nothing of this process is used afterwards.
    unsafe { libc::_exit(code) }
}
