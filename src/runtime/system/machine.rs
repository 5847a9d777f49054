//! How far a machine is prepared for real time, read from the kernel's own files: findings with a remedy each, explained
//! in `docs/realtime.md`. A file that is not there leaves its finding unknown.

use crate::rate_group::RateGroup;
use crate::system::os::{CAP_IPC_LOCK, CAP_SYS_NICE, Capability};
use std::fmt;
use std::path::Path;

/// The state of one thing that real time needs of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Readiness {
    /// The machine has it.
    Ready,
    /// The machine lacks it.
    Missing,
    /// The kernel does not say.
    Unknown,
}

/// One thing that real time needs of the machine, and how it stands there.
///
/// # Real-time
/// Not real-time safe: allocates. Before the run.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct MachineFinding {
    /// The name of the thing, that of its section in `docs/realtime.md`.
    pub name: &'static str,
    /// The state that it is in.
    pub state: Readiness,
    /// What was found, in words.
    pub found: String,
    /// What to do about it, in a sentence.
    pub remedy: &'static str,
}

impl fmt::Display for MachineFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.found)?;
        if self.state == Readiness::Missing { write!(f, "; {}", self.remedy) } else { Ok(()) }
    }
}

/// What a machine whose files are below `root` has and lacks for these groups; nothing if none of them is real-time.
pub(crate) fn findings(root: &Path, groups: &[RateGroup]) -> Vec<MachineFinding> {
    if !groups.iter().any(RateGroup::is_realtime) {
        return Vec::new();
    }
    let read = |path: &str| std::fs::read_to_string(root.join(path)).ok().map(|text| text.trim().to_owned());
    vec![
        preempt_rt(read("sys/kernel/realtime"), read("proc/sys/kernel/version")),
        isolation(read("sys/devices/system/cpu/isolated"), groups),
        throttling(read("proc/sys/kernel/sched_rt_runtime_us")),
        smt(read("sys/devices/system/cpu/smt/active")),
        governor(read("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")),
        idle_states(
            read("sys/devices/system/cpu/cpuidle/current_driver"),
            can_write(&root.join("dev/cpu_dma_latency")),
        ),
        limit("priority limit", "Max realtime priority", 99, CAP_SYS_NICE, read),
        limit("memory lock", "Max locked memory", u64::MAX, CAP_IPC_LOCK, read),
        priorities(groups),
    ]
}

fn finding(name: &'static str, state: Option<bool>, found: String, remedy: &'static str) -> MachineFinding {
    let state = match state {
        Some(true) => Readiness::Ready,
        Some(false) => Readiness::Missing,
        None => Readiness::Unknown,
    };
    let found = if state == Readiness::Unknown && found.is_empty() { "unknown".to_owned() } else { found };
    MachineFinding { name, state, found, remedy }
}

fn preempt_rt(realtime: Option<String>, version: Option<String>) -> MachineFinding {
    // A kernel without the patches has no such file: its version says so.
    let is = match (realtime, version) {
        (Some(flag), _) => Some(flag == "1"),
        (None, Some(version)) => Some(version.contains("PREEMPT_RT")),
        (None, None) => None,
    };
    let found = is.map_or("", |is| if is { "a PREEMPT_RT kernel" } else { "not a PREEMPT_RT kernel" });
    finding("kernel", is, found.to_owned(), "boot one: linux-image-rt on Debian, or PREEMPT_RT=y from 6.12 on")
}

fn isolation(isolated: Option<String>, groups: &[RateGroup]) -> MachineFinding {
    let remedy = "boot with isolcpus=, nohz_full= and irqaffinity= and pin the group to an isolated core";
    let Some(list) = isolated else { return finding("isolation", None, String::new(), remedy) };
    let cores = core_list(&list);
    let pinned = |group: &RateGroup| !group.cores().is_empty() && group.cores().iter().all(|core| cores.contains(core));
    let open: Vec<_> = groups.iter().filter(|group| group.is_realtime() && !pinned(group)).collect();
    let names: Vec<_> = open.iter().map(|group| format!("`{}`", group.name)).collect();
    let on = if list.is_empty() { "no core is isolated".to_owned() } else { format!("cores {list} are isolated") };
    let found = if open.is_empty() { on } else { format!("{on}, {} runs elsewhere", names.join(", ")) };
    finding("isolation", Some(open.is_empty()), found, remedy)
}

/// The numbers in a list such as `2-3,6`.
fn core_list(list: &str) -> Vec<usize> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.trim().parse::<usize>().ok()?..=last.trim().parse().ok()?)
    };
    list.split(',').filter_map(range).flatten().collect()
}

fn throttling(runtime_us: Option<String>) -> MachineFinding {
    let runtime = runtime_us.and_then(|text| text.parse::<i64>().ok());
    let found = match runtime {
        None => String::new(),
        Some(-1) => "off".to_owned(),
        Some(us) => format!("real-time threads are stopped after {us} us of each period"),
    };
    let remedy = "sysctl kernel.sched_rt_runtime_us=-1, on a machine whose loops are known to sleep";
    finding("throttling", runtime.map(|us| us == -1), found, remedy)
}

fn smt(active: Option<String>) -> MachineFinding {
    let found = match active.as_deref() {
        Some("0") => "off",
        Some(_) => "two threads share a core",
        None => "",
    };
    let off = active.as_deref().map(|active| active == "0");
    finding("SMT", off, found.to_owned(), "echo off > /sys/devices/system/cpu/smt/control, or nosmt at boot")
}

fn governor(governor: Option<String>) -> MachineFinding {
    let is = governor.as_deref().map(|name| name == "performance");
    let found = governor.map_or(String::new(), |name| format!("the governor is {name}"));
    finding("governor", is, found, "cpupower frequency-set -g performance")
}

/// Opened as a run opens it, which says more than the file's rights do; closed at once, so that nothing is asked for.
fn can_write(path: &Path) -> bool {
    std::fs::File::options().write(true).open(path).is_ok()
}

fn idle_states(driver: Option<String>, can_hold: bool) -> MachineFinding {
    let is = driver.as_deref().map(|driver| driver == "none" || can_hold);
    let found = match (driver.as_deref(), can_hold) {
        (None, _) => String::new(),
        (Some("none"), _) => "the kernel uses none".to_owned(),
        (Some(driver), true) => format!("{driver}, held off while a run lasts"),
        (Some(driver), false) => format!("{driver}, and /dev/cpu_dma_latency cannot be written to hold them off"),
    };
    finding("C-states", is, found, "boot with processor.max_cstate=1 or intel_idle.max_cstate=1")
}

/// The soft limit `key`, which a process with the `capability` passes by.
fn limit(
    name: &'static str,
    key: &str,
    least: u64,
    capability: Capability,
    read: impl Fn(&str) -> Option<String>,
) -> MachineFinding {
    let limits = read("proc/self/limits").unwrap_or_default();
    let line = limits.lines().find_map(|line| line.strip_prefix(key));
    let soft = line.and_then(|line| line.split_whitespace().next());
    let enough = soft.map(|soft| soft.parse().unwrap_or(u64::MAX) >= least);
    let passes_by = enough == Some(false) && capability.is_in(&read("proc/self/status").unwrap_or_default());
    let found = match (soft, passes_by) {
        (Some(soft), true) => format!("the limit is {soft}, which {} passes by", capability.name),
        (Some(soft), false) => format!("the limit is {soft}"),
        (None, _) => String::new(),
    };
    let remedy = "give the user rtprio 99 and memlock unlimited in /etc/security/limits.d";
    finding(name, enough.map(|enough| enough || passes_by), found, remedy)
}

fn priorities(groups: &[RateGroup]) -> MachineFinding {
    let low: Vec<_> = groups.iter().filter(|group| group.priority.is_some_and(|priority| priority <= 50)).collect();
    let names: Vec<_> = low.iter().map(|group| format!("`{}`", group.name)).collect();
    let found = match &names[..] {
        [] => "above the interrupt threads' 50".to_owned(),
        names => format!("{} is not above the interrupt threads' 50", names.join(", ")),
    };
    let remedy = "take a priority from 51 on, or lower that of the interrupts with chrt";
    finding("priority", Some(low.is_empty()), found, remedy)
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    fn group() -> RateGroup {
        RateGroup::hz(1000).name("g").realtime(80).pin(3)
    }

    /// A machine with these files.
    fn machine(name: &str, files: &[(&str, &str)]) -> std::path::PathBuf {
        let root = std::env::temp_dir().join(format!("palpate-machine-{}-{name}", std::process::id()));
        for (path, text) in files {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        root
    }

    fn states(root: &Path, group: RateGroup) -> Vec<(&'static str, Readiness)> {
        let found = findings(root, &[group]);
        let _ = std::fs::remove_dir_all(root);
        found.iter().map(|finding| (finding.name, finding.state)).collect()
    }

    #[test]
    fn a_machine_that_says_nothing_is_unknown_and_no_error() {
        let states = states(Path::new("/nowhere"), group());
        assert!(states[..8].iter().all(|(_, state)| *state == Readiness::Unknown), "{states:?}");
        assert!(findings(Path::new("/nowhere"), &[RateGroup::hz(10)]).is_empty());
    }

    #[test]
    fn a_machine_brought_to_real_time_is_ready_in_every_point() {
        let files = [
            ("sys/kernel/realtime", "1\n"),
            ("sys/devices/system/cpu/isolated", "1,2-3\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "-1\n"),
            ("sys/devices/system/cpu/smt/active", "0\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n"),
            ("sys/devices/system/cpu/cpuidle/current_driver", "intel_idle\n"),
            ("dev/cpu_dma_latency", ""),
            ("proc/self/limits", "Max locked memory  unlimited  unlimited  bytes\nMax realtime priority  99  99  \n"),
        ];
        let states = states(&machine("ready", &files), group());
        assert!(states.iter().all(|(_, state)| *state == Readiness::Ready), "{states:?}");
    }

    #[test]
    fn idle_states_that_a_file_is_there_for_but_cannot_be_written_are_not_held_off() {
        let files = [("sys/devices/system/cpu/cpuidle/current_driver", "intel_idle\n"), ("dev/cpu_dma_latency/in", "")];
        // A folder in its place, which root cannot write either.
        let states = states(&machine("unwritable", &files), group());
        assert!(states.contains(&("C-states", Readiness::Missing)), "{states:?}");
    }

    #[test]
    fn a_limit_is_passed_by_with_its_capability_and_not_by_who_the_user_is() {
        let limits = "Max locked memory  65536  65536  bytes\nMax realtime priority  0  0  \n";
        let of = |name: &str, capabilities: &str| {
            let status = format!("Name:\tx\nCapEff:\t{capabilities}\nSeccomp:\t0\n");
            let files = [("proc/self/limits", limits), ("proc/self/status", status.as_str())];
            let states = states(&machine(name, &files), group());
            ["priority limit", "memory lock"].map(|name| states.iter().find(|state| state.0 == name).unwrap().1)
        };
        assert_eq!(of("no-capability", "0000000000000000"), [Readiness::Missing; 2]);
        assert_eq!(of("sys-nice", "0000000000800000"), [Readiness::Ready, Readiness::Missing]);
        assert_eq!(of("ipc-lock", "0000000000004000"), [Readiness::Missing, Readiness::Ready]);
    }

    #[test]
    fn every_point_that_a_machine_lacks_is_named_with_a_remedy() {
        let files = [
            ("proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC\n"),
            ("sys/devices/system/cpu/isolated", "\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
            ("sys/devices/system/cpu/smt/active", "1\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n"),
            ("sys/devices/system/cpu/cpuidle/current_driver", "acpi_idle\n"),
        ];
        let root = machine("bare", &files);
        let found = findings(&root, &[group().realtime(50)]);
        std::fs::remove_dir_all(&root).unwrap();
        let missing: Vec<_> = found.iter().filter(|finding| finding.state == Readiness::Missing).collect();
        let names: Vec<_> = missing.iter().map(|finding| finding.name).collect();
        assert_eq!(names, ["kernel", "isolation", "throttling", "SMT", "governor", "C-states", "priority"]);
        assert!(missing.iter().all(|finding| finding.to_string().ends_with(finding.remedy)));
    }
}
