//! What the operating system is asked for: clock, sleep, policy, memory. The only file that names libc.
//!
//! Every request that can be refused returns the refusal as a sentence for the report; none of them fails a run.

pub(crate) use imp::{
    ThreadProbe, block_signals, give_way, lock_memory, may_lock_everything, monotonic, set_deadline, set_realtime,
    set_timer_slack, sleep_until, stay_awake, thread_cpu,
};

use std::collections::BTreeSet;
use std::fs::read_to_string;

/// The niceness of a thread that gives way.
pub(crate) const BACKGROUND_NICE: i32 = 15;

/// A capability of the kernel's, with which a limit is passed by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Capability {
    pub(crate) name: &'static str,
    bit: u32,
}

pub(crate) const CAP_IPC_LOCK: Capability = Capability { name: "CAP_IPC_LOCK", bit: 14 };
pub(crate) const CAP_SYS_NICE: Capability = Capability { name: "CAP_SYS_NICE", bit: 23 };

impl Capability {
    /// True if the process of this `/proc/self/status` has it.
    pub(crate) fn is_in(self, status: &str) -> bool {
        let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
        let mask = effective.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        mask.is_some_and(|mask| mask & (1 << self.bit) != 0)
    }
}

/// Lets the calling thread run on these cores only.
pub(crate) fn pin_to(cpus: &[usize]) -> Result<(), String> {
    let closed = |cpus: &[usize], to: &[usize]| match cpus.iter().find(|cpu| !to.contains(cpu)) {
        Some(cpu) => Err(format!("core {cpu} is not open to this process (taskset -pc, or its cgroup's cpuset.cpus)")),
        None => Ok(()),
    };
    closed(cpus, &pinnable_cores())?;
    imp::set_affinity(cpus)?;
    // The kernel leaves out what the cgroup does not have, and says nothing.
    closed(cpus, &open_cores())
}

/// The cores that the calling thread may run on.
fn open_cores() -> Vec<usize> {
    core_affinity::get_core_ids().unwrap_or_default().into_iter().map(|core| core.id).collect()
}

/// The numbers of the processor cores that a group of a run on threads may be [pinned](crate::RateGroup::pin) to, in order: those
/// open to the calling thread, and those that are isolated, which nobody inherits and everybody may ask for.
///
/// # Real-time
/// Not real-time safe: reads files. Before the run.
pub fn pinnable_cores() -> Vec<usize> {
    let isolated = read_to_string("/sys/devices/system/cpu/isolated").unwrap_or_default();
    pinnable(open_cores(), &isolated, &cores_there())
}

fn pinnable(open: Vec<usize>, isolated: &str, there: &[usize]) -> Vec<usize> {
    let isolated = cores_in(isolated).into_iter().filter(|core| there.contains(core));
    open.into_iter().chain(isolated).collect::<BTreeSet<_>>().into_iter().collect()
}

/// Writes to as much of the calling thread's stack as a tick may need, so that where memory is not locked its first
/// deep call faults no page.
#[inline(never)]
pub(crate) fn touch_stack() {
    const DEEPEST_TICK: usize = 128 * 1024;
    std::hint::black_box(&mut [1_u8; DEEPEST_TICK]);
}

/// How many processor cores the process may use, isolated ones included.
pub(crate) fn cores() -> usize {
    let shared = std::thread::available_parallelism().map_or(1, usize::from);
    shared + pinnable_cores().len() - open_cores().len()
}

/// The numbers of the processor cores that are there, whoever may use them; empty if the system does not say.
pub(crate) fn cores_there() -> Vec<usize> {
    cores_in(&read_to_string("/sys/devices/system/cpu/online").unwrap_or_default())
}

/// The numbers in a list of the kernel's: `0-2,5`.
fn cores_in(list: &str) -> Vec<usize> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.parse().ok()?..=last.parse().ok()?)
    };
    list.trim().split(',').filter_map(range).flatten().collect()
}

/// The kernel's release and build.
pub(crate) fn kernel() -> String {
    match (read_to_string("/proc/sys/kernel/osrelease"), read_to_string("/proc/sys/kernel/version")) {
        (Ok(release), Ok(version)) => format!("Linux {} {}", release.trim(), version.trim()),
        _ => std::env::consts::OS.to_owned(),
    }
}

/// What the kernel reads the time from.
pub(crate) fn clock_source() -> String {
    let path = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    read_to_string(path).map_or_else(|_| "not available".to_owned(), |name| name.trim().to_owned())
}

#[cfg(target_os = "linux")]
mod imp {
    use super::CAP_IPC_LOCK;
    use std::fs::File;
    use std::io::{Error, Write};
    use std::sync::OnceLock;

    const NANOS_PER_S: u64 = 1_000_000_000;

    /// Time since some start of the machine's own, in nanoseconds.
    ///
    /// # Real-time
    /// Wait-free, no system call (vDSO).
    #[inline]
    pub(crate) fn monotonic() -> u64 {
        read(libc::CLOCK_MONOTONIC)
    }

    /// CPU time that the calling thread has used, in nanoseconds.
    ///
    /// # Real-time
    /// A system call: not for a tick on a real-time thread.
    pub(crate) fn thread_cpu() -> u64 {
        read(libc::CLOCK_THREAD_CPUTIME_ID)
    }

    /// Reads a clock that always exists, in nanoseconds.
    #[inline]
    fn read(clock: libc::clockid_t) -> u64 {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: the pointer is to a timespec of our own; both clocks that are asked for always exist.
        unsafe { libc::clock_gettime(clock, &mut time) };
        time.tv_sec as u64 * NANOS_PER_S + time.tv_nsec as u64
    }

    /// Sleeps until [`monotonic`] has reached `time`, or a signal came.
    #[inline]
    pub(crate) fn sleep_until(time: u64) {
        let time = libc::timespec {
            tv_sec: (time / NANOS_PER_S) as libc::time_t,
            tv_nsec: (time % NANOS_PER_S) as libc::c_long,
        };
        // SAFETY: the pointer is to a timespec of our own; an absolute sleep writes no remainder.
        unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &time, std::ptr::null_mut()) };
    }

    /// Sets the cores of the calling thread.
    pub(crate) fn set_affinity(cpus: &[usize]) -> Result<(), String> {
        let refused = |why: &dyn std::fmt::Display| Err(format!("cores {cpus:?} refused: {why}"));
        if let Some(cpu) = cpus.iter().find(|&&cpu| cpu >= libc::CPU_SETSIZE as usize) {
            return refused(&format!("core {cpu} is beyond the {} that are possible", libc::CPU_SETSIZE));
        }
        // SAFETY: all zeros is an empty set; `CPU_SET` stays within it, as was checked; the pointer is to our own set,
        // and 0 means the calling thread.
        let result = unsafe {
            let mut set: libc::cpu_set_t = std::mem::zeroed();
            cpus.iter().for_each(|&cpu| libc::CPU_SET(cpu, &mut set));
            libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set)
        };
        if result == 0 { Ok(()) } else { refused(&Error::last_os_error()) }
    }

    /// The kernel's `struct sched_attr`, in its first version.
    #[repr(C)]
    struct SchedAttr {
        size: u32,
        policy: u32,
        flags: u64,
        nice: i32,
        priority: u32,
        runtime: u64,
        deadline: u64,
        period: u64,
    }

    const SCHED_FLAG_RESET_ON_FORK: u64 = 1;

    /// Gives the calling thread SCHED_DEADLINE: `runtime` of a processor within `deadline` of each `period`, in
    /// nanoseconds.
    pub(crate) fn set_deadline(runtime: u64, deadline: u64, period: u64) -> Result<(), String> {
        let attr = SchedAttr {
            size: size_of::<SchedAttr>() as u32,
            policy: libc::SCHED_DEADLINE as u32,
            // Threads that this one creates start without the policy.
            flags: SCHED_FLAG_RESET_ON_FORK,
            nice: 0,
            priority: 0,
            runtime,
            deadline,
            period,
        };
        // SAFETY: the pointer is to a structure of our own that says its size; 0 is the calling thread, and no flags.
        let result = unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const attr, 0) };
        if result == 0 {
            return Ok(());
        }
        let error = Error::last_os_error();
        let remedy = match error.raw_os_error() {
            Some(libc::EPERM) => {
                "; it takes CAP_SYS_NICE and a thread that may run on every core of its root domain: leave `pin` out, or \
                 give the process an exclusive cpuset"
            }
            Some(libc::EBUSY) => {
                "; the budgets of all such threads are above what the kernel keeps for them: lower them"
            }
            Some(libc::EINVAL) => "; the budget must be at least 1024 ns",
            _ => "",
        };
        Err(format!("SCHED_DEADLINE {runtime} of {period} ns refused: {error}{remedy}"))
    }

    /// Gives the calling thread SCHED_FIFO at `priority`.
    pub(crate) fn set_realtime(priority: u8) -> Result<(), String> {
        let parameter = libc::sched_param { sched_priority: priority.into() };
        // Threads that this one creates start without the policy: a library called by an actor must not inherit it.
        let policy = libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK;
        // The system call itself: musl's wrapper always fails, and 0 means the calling thread.
        // SAFETY: the pointer is to a sched_param of our own and outlives the call.
        let result = unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, policy, &raw const parameter) };
        if result == 0 {
            return Ok(());
        }
        Err(format!(
            "SCHED_FIFO {priority} refused: {} (setcap cap_sys_nice=ep on the program, or rtprio in limits.d)",
            Error::last_os_error()
        ))
    }

    /// Lets the calling thread give way to others of its policy: one that computes all the time gets a thirtieth of a processor beside it.
    pub(crate) fn give_way() -> Result<(), String> {
        // SAFETY: the call takes numbers alone; 0 means the calling thread.
        let result = unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, super::BACKGROUND_NICE) };
        if result == 0 { Ok(()) } else { Err(format!("giving way refused: {}", Error::last_os_error())) }
    }

    /// A thread seen from another one: the time that it computed, and whether it waits for anything but a processor.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct ThreadProbe {
        id: libc::pid_t,
        clock: Option<libc::clockid_t>,
    }

    impl ThreadProbe {
        /// The calling thread.
        pub(crate) fn of_this_thread() -> Self {
            let mut clock = 0;
            // SAFETY: the first asks for a number; the second takes the calling thread's own handle and a pointer to a
            // number of our own.
            let (id, result) =
                unsafe { (libc::gettid(), libc::pthread_getcpuclockid(libc::pthread_self(), &raw mut clock)) };
            Self { id, clock: (result == 0).then_some(clock) }
        }

        /// CPU time that the thread has used, in nanoseconds; `None` if it has ended.
        pub(crate) fn cpu(&self) -> Option<u64> {
            let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
            // SAFETY: the pointer is to a timespec of our own; the clock of a thread that is gone is refused.
            let result = unsafe { libc::clock_gettime(self.clock?, &raw mut time) };
            (result == 0).then_some(time.tv_sec as u64 * NANOS_PER_S + time.tv_nsec as u64)
        }

        /// True if the thread could go on if it were given a processor, or was stopped from outside; not so if it waits for
        /// a lock, a device, a page, or if nobody knows.
        pub(crate) fn is_ready(&self) -> bool {
            let stat = std::fs::read_to_string(format!("/proc/self/task/{}/stat", self.id)).unwrap_or_default();
            // The name before the state may hold anything, brackets too.
            stat.rsplit_once(") ").is_some_and(|(_, state)| state.starts_with(['R', 'T', 't']))
        }

        /// Puts the thread behind all others: it may be spinning and would keep its core from its replacement.
        pub(crate) fn put_behind(&self) {
            let parameter = libc::sched_param { sched_priority: 0 };
            // The flag that the thread may have already: to clear it takes a privilege.
            let policy = libc::SCHED_IDLE | libc::SCHED_RESET_ON_FORK;
            // SAFETY: the pointer is to a sched_param of our own and outlives the call. A refusal leaves the thread as it is.
            unsafe { libc::syscall(libc::SYS_sched_setscheduler, self.id, policy, &raw const parameter) };
        }
    }

    /// Leaves signals to the program's other threads: a handler on this one would make system calls in a tick. Those
    /// that a thread causes itself, by a bad access for example, stay.
    pub(crate) fn block_signals() {
        const OWN: [libc::c_int; 6] =
            [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGTRAP, libc::SIGABRT];
        let mut set = std::mem::MaybeUninit::<libc::sigset_t>::uninit();
        // SAFETY: `sigfillset` initialises the set, which the others then read and write; none keeps the pointer.
        unsafe {
            libc::sigfillset(set.as_mut_ptr());
            for signal in OWN {
                libc::sigdelset(set.as_mut_ptr(), signal);
            }
            // Cannot fail with this first argument.
            libc::pthread_sigmask(libc::SIG_BLOCK, set.as_ptr(), std::ptr::null_mut());
        }
    }

    /// Makes the calling thread's sleeps end as close to their time as the timer can.
    pub(crate) fn set_timer_slack() -> Result<(), String> {
        // SAFETY: PR_SET_TIMERSLACK takes a number and touches no memory.
        let result = unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1 as libc::c_ulong, 0, 0, 0) };
        if result == 0 { Ok(()) } else { Err(format!("refused: {}", Error::last_os_error())) }
    }

    /// Keeps the processors out of idle states that take time to leave, for as long as the file is open: about 25 us of
    /// every wake-up. It costs power.
    pub(crate) fn stay_awake() -> Result<File, String> {
        const DEVICE: &str = "/dev/cpu_dma_latency";
        let refused = |error: Error| format!("refused: {DEVICE}: {error} (a udev rule opens it to a group)");
        let mut file = File::options().write(true).open(DEVICE).map_err(refused)?;
        // The largest latency allowed, in microseconds, as the kernel's PM QoS interface reads it.
        file.write_all(&0_i32.to_ne_bytes()).map_err(refused)?;
        Ok(file)
    }

    /// Locks the process's memory, now and future, once; every call returns what the first one achieved.
    pub(crate) fn lock_memory() -> Result<(), String> {
        static RESULT: OnceLock<Result<(), String>> = OnceLock::new();
        RESULT
            .get_or_init(|| {
                may_lock_everything()?;
                // SAFETY: takes flags and touches no memory of ours.
                let result = unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
                if result == 0 { Ok(()) } else { Err(format!("refused: {}", Error::last_os_error())) }
            })
            .clone()
    }

    /// Whether locking would work, without locking anything.
    ///
    /// Under a finite limit the lock itself can succeed and a later allocation then fails, which would be a crash for a
    /// refused privilege.
    pub(crate) fn may_lock_everything() -> Result<(), String> {
        let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        // SAFETY: the pointer is to an rlimit of our own.
        let known = unsafe { libc::getrlimit(libc::RLIMIT_MEMLOCK, &mut limit) } == 0;
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        if CAP_IPC_LOCK.is_in(&status) || (known && limit.rlim_cur == libc::RLIM_INFINITY) {
            return Ok(());
        }
        Err(format!("not locked: the limit is {} bytes (ulimit -l unlimited, or CAP_IPC_LOCK)", limit.rlim_cur))
    }
}

#[cfg(not(target_os = "linux"))]
mod imp {
    use std::sync::OnceLock;
    use std::time::{Duration, Instant};

    const NOT_AVAILABLE: &str = "not available on this system";

    pub(crate) fn monotonic() -> u64 {
        static START: OnceLock<Instant> = OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_nanos() as u64
    }

    /// The nearest that there is: it counts preemption too.
    pub(crate) fn thread_cpu() -> u64 {
        monotonic()
    }

    pub(crate) fn sleep_until(time: u64) {
        std::thread::sleep(Duration::from_nanos(time.saturating_sub(monotonic())));
    }

    pub(crate) fn set_realtime(_priority: u8) -> Result<(), String> {
        Err(NOT_AVAILABLE.to_owned())
    }

    pub(crate) fn give_way() -> Result<(), String> {
        Err(NOT_AVAILABLE.to_owned())
    }

    pub(crate) fn set_deadline(_runtime: u64, _deadline: u64, _period: u64) -> Result<(), String> {
        Err(NOT_AVAILABLE.to_owned())
    }

    /// One core, where the system can do that.
    pub(crate) fn set_affinity(cpus: &[usize]) -> Result<(), String> {
        match cpus {
            &[id] if core_affinity::set_for_current(core_affinity::CoreId { id }) => Ok(()),
            _ => Err(format!("cores {cpus:?} refused: {NOT_AVAILABLE}")),
        }
    }

    /// Knows nothing here.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct ThreadProbe;

    impl ThreadProbe {
        pub(crate) fn of_this_thread() -> Self {
            Self
        }

        pub(crate) fn cpu(&self) -> Option<u64> {
            None
        }

        pub(crate) fn is_ready(&self) -> bool {
            false
        }

        pub(crate) fn put_behind(&self) {}
    }

    pub(crate) fn block_signals() {}

    pub(crate) fn set_timer_slack() -> Result<(), String> {
        Err(NOT_AVAILABLE.to_owned())
    }

    pub(crate) fn stay_awake() -> Result<std::fs::File, String> {
        Err("not available on this system".to_owned())
    }

    pub(crate) fn lock_memory() -> Result<(), String> {
        Err(NOT_AVAILABLE.to_owned())
    }

    pub(crate) fn may_lock_everything() -> Result<(), String> {
        Err(NOT_AVAILABLE.to_owned())
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_sleep_never_ends_before_its_time() {
        for _ in 0..3 {
            let due = monotonic() + 200_000;
            while monotonic() < due {
                sleep_until(due);
            }
            assert!(monotonic() >= due);
        }
    }

    #[test]
    fn the_kernels_list_of_cores_is_read_as_it_writes_it() {
        assert_eq!(cores_in("0-2,5,8-9\n"), [0, 1, 2, 5, 8, 9]);
        assert_eq!(cores_in("0\n"), [0]);
        assert_eq!(cores_in(""), [] as [usize; 0]);
        assert!(cores_there().len() >= cores() || cores_there().is_empty());
    }

    #[test]
    fn a_core_that_does_not_exist_is_refused_and_named() {
        assert!(pin_to(&[usize::MAX]).unwrap_err().contains(&usize::MAX.to_string()));
    }

    #[test]
    fn an_isolated_core_may_be_asked_for_although_nobody_inherits_it() {
        assert_eq!(pinnable(vec![0, 1, 2], "3\n", &[0, 1, 2, 3]), [0, 1, 2, 3]);
        assert_eq!(pinnable(vec![2], "1,3-5\n", &[0, 1, 2, 3]), [1, 2, 3]);
        // Check that one which is closed and shared with others stays closed
        assert_eq!(pinnable(vec![1], "\n", &[0, 1]), [1]);
    }

    #[test]
    fn a_thread_is_pinned_to_the_cores_that_were_granted() {
        let open = open_cores();
        std::thread::spawn(move || {
            assert_eq!(pin_to(&open), Ok(()));
            assert_eq!(pin_to(&open[..1]), Ok(()));
            assert_eq!(open_cores(), open[..1]);
        })
        .join()
        .unwrap();
    }
}
