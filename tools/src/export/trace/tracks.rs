//! Which track of a trace a release is drawn on.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::io::{self, Write};

use palpate::log::Environment;
use palpate::runtime::Nanos;

use super::events::{Events, Track};
use crate::drawing::html::JsonString;

/// Track numbers from one rate group to the next.
const TRACKS_PER_GROUP: u32 = 1000;

/// The tracks of the rate groups: the fastest on top.
///
/// A group has one track. Only where releases overlap, as in virtual time with a latency above the period, the later one
/// goes to a further track: slices of one track must not overlap partially.
#[derive(Debug, Default)]
pub(super) struct Tracks {
    groups: BTreeMap<u16, Lanes>,
    /// Groups by rate, the fastest first.
    order: Vec<u16>,
}

#[derive(Debug)]
struct Lanes {
    name: String,
    /// Among the groups as they are known now.
    rank: usize,
    first: u32,
    /// When each is free again.
    free_from: Vec<Nanos>,
}

impl Tracks {
    /// Learns the rates of the groups. Tracks that were already used stay where they are.
    pub(super) fn set_environment(&mut self, environment: &Environment) {
        let rate = |group: &u16| environment.groups[usize::from(*group)].rate_hz;
        self.order = (0..u16::try_from(environment.groups.len()).unwrap_or(u16::MAX)).collect();
        self.order.sort_by(|a, b| rate(b).partial_cmp(&rate(a)).unwrap_or(Ordering::Equal));
    }

    /// The track of a release of `group` from `start` to `end`, which is named in the trace when it is first used.
    pub(super) fn place<W: Write>(
        &mut self,
        group: u16,
        name: &str,
        (start, end): (Nanos, Nanos),
        events: &mut Events<W>,
    ) -> io::Result<Track> {
        let known = self.order.iter().position(|known| *known == group);
        // Groups that the environment does not know come after those that it does.
        let rank = known.unwrap_or(self.order.len() + usize::from(group));
        // In the order in which they are met: more groups may become known later.
        let met = self.groups.len() as u32 + 1;
        let lanes = self.groups.entry(group).or_insert_with(|| Lanes {
            name: name.to_owned(),
            rank,
            first: met * TRACKS_PER_GROUP,
            free_from: Vec::new(),
        });
        let lane = match lanes.free_from.iter().position(|free| *free <= start) {
            Some(lane) => lane,
            // Times that mean nothing overlap without end.
            None if lanes.free_from.len() + 1 >= TRACKS_PER_GROUP as usize => lanes.free_from.len() - 1,
            None => {
                lanes.free_from.push(Nanos::ZERO);
                let lane = lanes.free_from.len() - 1;
                let name = match lane {
                    0 => lanes.name.clone(),
                    overlapping => format!("{} (overlapping {overlapping})", lanes.name),
                };
                let track = lanes.track(lane);
                events.metadata("thread_name", track, format_args!("\"name\":{}", JsonString(&name)))?;
                events.metadata(
                    "thread_sort_index",
                    track,
                    format_args!("\"sort_index\":{}", (lanes.rank + 1) * TRACKS_PER_GROUP as usize + lane),
                )?;
                lane
            }
        };
        lanes.free_from[lane] = end;
        Ok(lanes.track(lane))
    }

    /// The first track of a group that was used.
    pub(super) fn of_group(&self, group: u16) -> Option<Track> {
        self.groups.get(&group).map(|lanes| lanes.track(0))
    }
}

impl Lanes {
    fn track(&self, lane: usize) -> Track {
        Track(self.first + lane as u32)
    }
}
