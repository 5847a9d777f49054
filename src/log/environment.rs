//! What a log says about the run as a whole: who wrote it, on what, and what the system granted.

use std::collections::BTreeMap;

/// How a run was executed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Execution {
    /// In simulated time, as fast as the machine allows: lateness is zero by construction.
    #[default]
    Virtual,
    /// On real threads.
    Threaded {
        /// The start of the run, in nanoseconds since the Unix epoch.
        start_unix_ns: u64,
    },
}

/// A rate group, in the order that [`TickTiming::group`](crate::runtime::record::TickTiming::group) counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupInfo {
    /// Its name; its topics are `/timing/NAME` and `/stats/NAME`.
    pub name: String,
    /// Releases per second.
    pub rate_hz: f64,
}

/// Everything about a run that is not a record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Environment {
    /// The version of palpate that wrote the log.
    pub palpate_version: String,
    /// The instruction set that the vector kernels used.
    pub instruction_set: String,
    /// Virtual or threaded.
    pub execution: Execution,
    /// The local model.
    pub model: String,
    /// The haptic rate (Hz).
    pub haptic_hz: f64,
    /// The rate of the global model (Hz).
    pub global_hz: f64,
    /// The rate groups.
    pub groups: Vec<GroupInfo>,
    /// Names of the bits in [`CommandSample::limits`](super::CommandSample::limits), lowest first.
    pub limit_stages: Vec<String>,
    /// What the system granted: policy, priority, cpu, mlock, ...
    pub granted: BTreeMap<String, String>,
    /// The scene file as text. It travels as the attachment `scene.toml`; a reader leaves it empty.
    pub scene: Option<String>,
}

impl Environment {
    /// The name of rate group `group`: its own, or `group-N` if the environment does not know it.
    pub fn group_name(&self, group: u16) -> String {
        match self.groups.get(usize::from(group)) {
            Some(info) => info.name.clone(),
            None => format!("group-{group}"),
        }
    }

    /// The Unix time of the start (ns): what is added to the time of a record to give its log time.
    pub fn epoch_ns(&self) -> u64 {
        match self.execution {
            Execution::Virtual => 0,
            Execution::Threaded { start_unix_ns } => start_unix_ns,
        }
    }

    /// As keys and values: the metadata record `environment`.
    pub fn to_map(&self, schema_version: u32) -> BTreeMap<String, String> {
        let execution = match self.execution {
            Execution::Virtual => "virtual",
            Execution::Threaded { .. } => "threaded",
        };
        let mut map: BTreeMap<String, String> = [
            ("schema_version", schema_version.to_string()),
            ("palpate_version", self.palpate_version.clone()),
            ("instruction_set", self.instruction_set.clone()),
            ("execution", execution.to_owned()),
            ("start_unix_ns", self.epoch_ns().to_string()),
            ("model", self.model.clone()),
            ("haptic_hz", self.haptic_hz.to_string()),
            ("global_hz", self.global_hz.to_string()),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into();
        for (i, group) in self.groups.iter().enumerate() {
            map.insert(format!("group.{i}.name"), group.name.clone());
            map.insert(format!("group.{i}.rate_hz"), group.rate_hz.to_string());
        }
        for (i, stage) in self.limit_stages.iter().enumerate() {
            map.insert(format!("limit_stage.{i}"), stage.clone());
        }
        map.extend(self.granted.iter().map(|(key, value)| (format!("granted.{key}"), value.clone())));
        map
    }

    /// Reads [`to_map`](Self::to_map) back. What is missing stays empty and what is unknown is left out, so that logs of
    /// older and newer versions can be read.
    pub fn from_map(map: &BTreeMap<String, String>) -> Self {
        let text = |key: &str| map.get(key).cloned().unwrap_or_default();
        let number = |key: &str| map.get(key).and_then(|value| value.parse::<f64>().ok()).unwrap_or(0.0);
        let execution = match text("execution").as_str() {
            "threaded" => Execution::Threaded { start_unix_ns: text("start_unix_ns").parse().unwrap_or(0) },
            _ => Execution::Virtual,
        };
        let groups = (0..)
            .map_while(|i| map.get(&format!("group.{i}.name")).map(|name| (i, name)))
            .map(|(i, name)| GroupInfo { name: name.clone(), rate_hz: number(&format!("group.{i}.rate_hz")) })
            .collect();
        let granted = map
            .iter()
            .filter_map(|(key, value)| Some((key.strip_prefix("granted.")?.to_owned(), value.clone())))
            .collect();
        Self {
            palpate_version: text("palpate_version"),
            instruction_set: text("instruction_set"),
            execution,
            model: text("model"),
            haptic_hz: number("haptic_hz"),
            global_hz: number("global_hz"),
            groups,
            limit_stages: (0..).map_while(|i| map.get(&format!("limit_stage.{i}")).cloned()).collect(),
            granted,
            scene: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_environment_survives_the_trip_through_keys_and_values() {
        let environment = Environment {
            palpate_version: "0.1.0".into(),
            instruction_set: "avx2".into(),
            execution: Execution::Threaded { start_unix_ns: 1_700_000_000_123_456_789 },
            model: "patch".into(),
            haptic_hz: 1000.0,
            global_hz: 29.97,
            groups: vec![
                GroupInfo { name: "haptic".into(), rate_hz: 1000.0 },
                GroupInfo { name: "global".into(), rate_hz: 29.97 },
            ],
            limit_stages: vec!["clamp".into(), "slew".into()],
            granted: [("policy".to_owned(), "other".to_owned())].into(),
            scene: None,
        };
        assert_eq!(Environment::from_map(&environment.to_map(1)), environment);
        assert_eq!(environment.group_name(1), "global");
        assert_eq!(environment.group_name(7), "group-7");
    }
}
