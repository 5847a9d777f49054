//! Samples of two records, put together again.

use super::packing::{PART, has_part, kind_and_device, without_part};
use super::{CommandSample, ForceSample, LogRecord, ToolSample};
use crate::runtime::Record;

/// Reads records as samples: of one that has two records, the part waits for the other.
///
/// Parts belong to a device, a kind of sample and a time: records of several devices may come in any order between them. A part
/// that waits in vain, because the other record was lost, gives way to the next of its kind; a record whose part was lost is
/// lost with it, rather than read as a sample of something else.
///
/// ```
/// use palpate::log::{JoinedRecords, LogRecord, ToolSample};
/// use palpate::model::{Turn, Vec3};
///
/// let orientation = Turn::from_axis_angle(&Vec3::z_axis(), 0.5);
/// let sent = LogRecord::Tool(ToolSample { orientation, ..ToolSample::default() });
/// let [Some(part), Some(record)] = sent.to_records() else { panic!("a turned tool has a part") };
/// let mut joined = JoinedRecords::default();
/// assert_eq!((joined.read(&part), joined.read(&record)), (None, Some(sent)));
/// assert_eq!(joined.read(&record), None, "its part is used up");
/// ```
///
/// # Real-time
/// For loggers: the first part of a kind and device may allocate.
#[derive(Clone, Debug, Default)]
pub struct JoinedRecords {
    /// One for each device and kind at most.
    waiting: Vec<Record>,
}

impl JoinedRecords {
    /// The sample that is whole with this record; `None` for a part, and for records that are not palpate's.
    ///
    /// # Real-time
    /// Allocates for the first parts: for loggers.
    pub fn read(&mut self, record: &Record) -> Option<LogRecord> {
        let Some((kind, device)) = kind_and_device(record.channel) else { return LogRecord::from_record(record) };
        if kind == PART {
            let is_same = |waiting: &&mut Record| (waiting.channel, waiting.code) == (record.channel, record.code);
            match self.waiting.iter_mut().find(is_same) {
                Some(waiting) => *waiting = *record,
                None => self.waiting.push(*record),
            }
            return None;
        }
        if !has_part(kind) {
            return LogRecord::from_record(record);
        }
        let kind = without_part(kind);
        let belongs = |part: &Record| {
            kind_and_device(part.channel) == Some((PART, device)) && part.code == kind && part.stamp == record.stamp
        };
        let part = self.waiting.swap_remove(self.waiting.iter().position(belongs)?);
        let mut sample = LogRecord::of_kind(kind, record, device)?;
        match &mut sample {
            LogRecord::Force(force) => ForceSample::join(force, &part),
            LogRecord::Command(command) => CommandSample::join(command, &part),
            LogRecord::Tool(tool) => ToolSample::join(tool, &part),
            _ => return None,
        }
        Some(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Turn, Vec3};
    use crate::runtime::Nanos;

    fn force(time: u64, device: u16, torque: f64) -> LogRecord {
        let force_n = [time as f64, f64::from(device), 0.0];
        let sample =
            ForceSample { time: Nanos(time), force_n, torque_n_m: [0.0, torque, 0.0], ..ForceSample::default() };
        LogRecord::Force(ForceSample { device, ..sample })
    }

    fn command(time: u64, device: u16, torque: f64) -> LogRecord {
        let sample = CommandSample { time: Nanos(time), torque_n_m: [torque; 3], ..CommandSample::default() };
        LogRecord::Command(CommandSample { device, ..sample })
    }

    fn tool(time: u64, device: u16, angle: f64) -> LogRecord {
        let orientation = Turn::from_axis_angle(&Vec3::x_axis(), angle);
        LogRecord::Tool(ToolSample { time: Nanos(time), orientation, device, ..ToolSample::default() })
    }

    fn read(joined: &mut JoinedRecords, records: &[Option<Record>]) -> Vec<LogRecord> {
        records.iter().flatten().filter_map(|record| joined.read(record)).collect()
    }

    #[test]
    fn parts_of_several_devices_and_kinds_may_come_between_each_other() {
        let samples: Vec<LogRecord> =
            (0..3).flat_map(|device| [force(7, device, 0.5), tool(7, device, 0.1), command(7, device, 2.0)]).collect();
        let records: Vec<_> = samples.iter().map(LogRecord::to_records).collect();
        let parts_first: Vec<_> =
            records.iter().map(|[part, _]| *part).chain(records.iter().map(|[_, main]| *main)).collect();
        let mut joined = JoinedRecords::default();
        assert_eq!(read(&mut joined, &parts_first), samples);
        assert!(joined.waiting.is_empty());
        // The mains in another order than their parts.
        let backwards: Vec<_> =
            records.iter().map(|[part, _]| *part).chain(records.iter().rev().map(|[_, main]| *main)).collect();
        let reversed: Vec<_> = samples.iter().rev().copied().collect();
        assert_eq!(read(&mut joined, &backwards), reversed);
    }

    // Check that no tick gets the torque of another, whichever of two records of a tick was lost.
    #[test]
    fn a_lost_record_mixes_up_no_ticks() {
        let ticks = [force(1, 0, 0.1), force(2, 0, 0.2), force(3, 0, 0.0), force(4, 0, 0.4)];
        let records: Vec<Option<Record>> = ticks.iter().flat_map(LogRecord::to_records).collect();
        assert_eq!(records.iter().flatten().count(), 7, "no torque needs no part");
        for lost in 0..records.len() {
            let mut left = records.clone();
            left[lost] = None;
            let whole = read(&mut JoinedRecords::default(), &left);
            let expected: Vec<_> =
                (0..4).filter(|tick| lost / 2 != *tick || records[lost].is_none()).map(|tick| ticks[tick]).collect();
            assert_eq!(whole, expected, "without record {lost}");
        }
    }

    #[test]
    fn what_waits_is_bounded_and_what_is_foreign_is_none() {
        let mut joined = JoinedRecords::default();
        for time in 0..100 {
            for device in 0..3 {
                let [part, _] = tool(time, device, 0.3).to_records();
                assert_eq!(joined.read(&part.unwrap()), None);
            }
        }
        assert_eq!(joined.waiting.len(), 3);
        let foreign = Record { channel: crate::runtime::Channel(9999), ..force(1, 0, 0.0).to_records()[1].unwrap() };
        assert_eq!(joined.read(&foreign), None);
    }
}
