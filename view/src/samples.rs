//! Records of every tick, joined to the rows that strips are drawn from.

use std::collections::BTreeMap;

use bytes::Bytes;
use palpate::log::{CommandSample, LogRecord};
use palpate::runtime::Nanos;

use crate::frames::Writer;

/// Records of one tick come together but for those of other threads; a row waits for so long.
const JOINED: Nanos = Nanos(20_000_000);

/// A device's tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Row {
    /// Computed force on the tool (N), before the safety pipeline.
    pub(crate) force_n: [f64; 3],
    /// Commanded force (N), after it.
    pub(crate) command_n: [f64; 3],
    /// From the scheduled time to the end of the wait (us), and of the work (us).
    pub(crate) lateness_us: f64,
    pub(crate) execution_us: f64,
    /// Age of the local model (ms).
    pub(crate) age_ms: f64,
    /// What the tool has given to the simulation (mJ), and the passivity ledger (mJ).
    pub(crate) energy_mj: f64,
    pub(crate) ledger_mj: f64,
    /// Normal force over area (kPa); zero for a point.
    pub(crate) pressure_kpa: f64,
    /// True in the tick of a resync.
    pub(crate) is_resync: bool,
    /// Safety stages that acted: a bit each.
    pub(crate) limits: u16,
}

/// Joins records to rows.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    waiting: BTreeMap<(u16, Nanos), Row>,
    /// Lateness and execution of the haptic group by scheduled time (us), for devices that share the tick.
    timings: BTreeMap<Nanos, [f64; 2]>,
    newest: Nanos,
    deadline: Nanos,
}

impl Rows {
    /// Takes a record; those of group 0 are the haptic group's.
    pub(crate) fn push(&mut self, record: &LogRecord) {
        let time = record.time();
        self.newest = self.newest.max(time);
        match record {
            LogRecord::Force(sample) => {
                let row = self.row(sample.device, time);
                row.force_n = sample.force_n;
                (row.age_ms, row.energy_mj) = (1e3 * sample.model_age_s, 1e3 * sample.energy_j);
            }
            LogRecord::Command(sample) => {
                let row = self.row(sample.device, time);
                let CommandSample { force_n, limits, energy_j, .. } = *sample;
                (row.command_n, row.limits, row.ledger_mj) = (force_n, limits, 1e3 * energy_j);
            }
            LogRecord::Contact(sample) => {
                self.row(sample.device, time).pressure_kpa = 1e-3 * f64::from(sample.mean_pressure_pa());
            }
            LogRecord::Resync(resync) => {
                self.row(resync.device, time).is_resync = true;
            }
            LogRecord::Tick(timing) if timing.group == 0 => {
                let us = |from: Nanos, to: Nanos| 1e-3 * to.saturating_sub(from).0 as f64;
                self.deadline = timing.deadline.saturating_sub(timing.scheduled);
                let figures = [us(timing.scheduled, timing.woke), us(timing.start, timing.end)];
                self.timings.insert(timing.scheduled, figures);
            }
            _ => {}
        }
    }

    fn row(&mut self, device: u16, time: Nanos) -> &mut Row {
        self.waiting.entry((device, time)).or_default()
    }

    /// The rows that are whole, a message per device.
    pub(crate) fn take(&mut self) -> Vec<Bytes> {
        let mut by_device: BTreeMap<u16, Vec<(Nanos, Row)>> = BTreeMap::new();
        let ready = self.newest.saturating_sub(JOINED);
        self.until(ready, |device, time, row| by_device.entry(device).or_default().push((time, row)));
        by_device.into_iter().map(|(device, rows)| block(device, self.deadline, &rows)).collect()
    }

    /// All rows by device and time, when nothing follows any more.
    pub(crate) fn all(mut self) -> Vec<(u16, Nanos, Row)> {
        let mut rows = Vec::new();
        self.until(Nanos(u64::MAX), |device, time, row| rows.push((device, time, row)));
        rows
    }

    /// The time that a tick of the haptic group has.
    pub(crate) fn deadline(&self) -> Nanos {
        self.deadline
    }

    fn until(&mut self, ready: Nanos, mut pass_on: impl FnMut(u16, Nanos, Row)) {
        for ((device, time), mut row) in self.waiting.extract_if(.., |(_, time), _| *time < ready) {
            [row.lateness_us, row.execution_us] = self.timings.get(&time).copied().unwrap_or_default();
            pass_on(device, time, row);
        }
        self.timings = self.timings.split_off(&ready);
    }
}

/// The message of `rows`, whose ticks have so much time.
pub(crate) fn block(device: u16, deadline: Nanos, rows: &[(Nanos, Row)]) -> Bytes {
    let first = rows.first().map_or(Nanos::ZERO, |row| row.0);
    let mut to = Writer::new(3, 24 + 4 * Row::FLOATS * rows.len());
    to.u32(device.into()).f64(first.as_secs_f64()).f64(deadline.as_secs_f64());
    for (time, row) in rows {
        to.f32(1e3 * time.saturating_sub(first).as_secs_f64() as f32);
        row.numbers().into_iter().for_each(|number| to.f32(number as f32));
    }
    to.0.into()
}

impl Row {
    /// Milliseconds since the first row, and the numbers.
    pub(crate) const FLOATS: usize = 15;

    fn numbers(&self) -> [f64; Self::FLOATS - 1] {
        let ([fx, fy, fz], [cx, cy, cz]) = (self.force_n, self.command_n);
        let Self { lateness_us, execution_us, age_ms, energy_mj, ledger_mj, pressure_kpa, limits, .. } = *self;
        [
            fx,
            fy,
            fz,
            cx,
            cy,
            cz,
            lateness_us,
            execution_us,
            age_ms,
            energy_mj,
            ledger_mj,
            pressure_kpa,
            f64::from(limits),
            f64::from(u8::from(self.is_resync)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::log::ForceSample;
    use palpate::runtime::TickTiming;

    #[test]
    fn records_of_one_tick_are_one_row_however_they_come() {
        let time = Nanos(1_000_000);
        let tick = TickTiming {
            scheduled: time,
            woke: Nanos(1_010_000),
            start: Nanos(1_011_000),
            end: Nanos(1_061_000),
            deadline: Nanos(2_000_000),
            ..TickTiming::default()
        };
        let command = CommandSample { time, force_n: [0.0, 0.0, 1.0], ..CommandSample::default() };
        let force = ForceSample { time, force_n: [0.1, 0.2, 0.3], model_age_s: 0.02, ..ForceSample::default() };
        let records = [LogRecord::Tick(tick), LogRecord::Command(command), LogRecord::Force(force)];
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut rows = Rows::default();
            order.iter().for_each(|&place| rows.push(&records[place]));
            assert!(rows.take().is_empty(), "more may come");
            let deadline = rows.deadline();
            let rows: Vec<_> = rows.all().into_iter().map(|(_, time, row)| (time, row)).collect();
            let message = block(0, deadline, &rows);
            assert_eq!((rows.len(), message.len()), (1, 24 + 4 * Row::FLOATS));
            let float = |n: usize| f32::from_le_bytes(message[24 + 4 * n..][..4].try_into().unwrap());
            assert_eq!([float(1), float(6), float(7), float(8), float(9)], [0.1, 1.0, 10.0, 50.0, 20.0]);
            assert_eq!(f64::from_le_bytes(message[16..24].try_into().unwrap()), 1e-3, "the deadline");
        }
    }
}
