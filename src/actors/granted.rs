//! What the system granted, as keys and values for the log.

use std::collections::BTreeMap;

use crate::runtime::SystemGrant;

/// The grant as text: `mlock`, `kernel`, ... and `GROUP.policy`, `GROUP.cpu`, ... for every rate group.
pub(super) fn granted(grant: &SystemGrant) -> BTreeMap<String, String> {
    let mut map: BTreeMap<String, String> = [
        ("mlock", grant.mlock.clone()),
        ("timer_slack", grant.timer_slack.clone()),
        ("clock_source", grant.clock_source.clone()),
        ("kernel", grant.kernel.clone()),
        ("cores", grant.cores.to_string()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into();
    for group in &grant.groups {
        let cpu = group.cpu.map_or("any".to_owned(), |cpu| cpu.to_string());
        let facts = [
            ("policy", group.policy.clone()),
            ("priority", group.priority.to_string()),
            ("cpu", cpu),
            ("wait", group.wait.clone()),
            ("refused", group.refused.clone()),
        ];
        map.extend(facts.map(|(key, value)| (format!("{}.{key}", group.name), value)));
    }
    map
}
