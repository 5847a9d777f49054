//! What the system granted, as keys and values for the log.

use std::collections::BTreeMap;

use crate::runtime::{GroupGrant, SystemGrant};

/// The grant as text: the machine, what the process got, and a line per rate group.
pub(super) fn granted(grant: &SystemGrant) -> BTreeMap<String, String> {
    let machine = format!("{}, clock {}, {} cores", kernel(&grant.kernel), grant.clock_source, grant.cores);
    let mut map: BTreeMap<String, String> = [("machine".to_owned(), machine)].into();
    if !grant.virtual_time {
        map.insert("memory".to_owned(), format!("mlockall {}", grant.mlock));
        map.insert("timer slack".to_owned(), grant.timer_slack.clone());
        map.insert("idle states".to_owned(), grant.idle_states.clone());
        map.extend(grant.groups.iter().map(|group| (group.name.clone(), in_words(group))));
    }
    map
}

/// System and release, without the build's own story.
fn kernel(kernel: &str) -> String {
    kernel.split_whitespace().take(2).collect::<Vec<_>>().join(" ")
}

fn in_words(group: &GroupGrant) -> String {
    let priority = if group.priority > 0 { format!(" {}", group.priority) } else { String::new() };
    let cpu = group.cpu.map_or("any cpu".to_owned(), |cpu| format!("cpu {cpu}"));
    let refused = if group.refused.is_empty() { String::new() } else { format!("; {}", group.refused) };
    format!("{}{priority} on {cpu}, {}{refused}", group.policy, group.wait)
}
