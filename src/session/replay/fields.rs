//! The fields of a logged sample, each by its bits: -0.0 is not 0.0, and a NaN is itself.

use crate::log::LogRecord;

/// The first field in which two samples of one topic differ.
pub(super) fn first_difference(one: &LogRecord, other: &LogRecord) -> Option<&'static str> {
    // Nearly always: all bits at once.
    if one.to_records() == other.to_records() {
        return None;
    }
    let pairs = fields(one).into_iter().zip(fields(other));
    Some(pairs.into_iter().find(|(one, other)| one != other).map_or("kind", |((name, _), _)| name))
}

/// Name and bits of every field of a computed sample, in the order of its definition.
fn fields(record: &LogRecord) -> Vec<(&'static str, u64)> {
    let mut all = vec![("time", record.time().0)];
    let mut add = |name: &'static str, bits: &[u64]| all.extend(bits.iter().map(|bits| (name, *bits)));
    match record {
        LogRecord::Force(r) => {
            add("force_n", &r.force_n.map(f64::to_bits));
            add("model_version", &[r.model_version.into()]);
            add("served_by", &[r.served_by as u64]);
            add("model_age_s", &[r.model_age_s.to_bits()]);
            add("energy_j", &[r.energy_j.to_bits()]);
            add("torque_n_m", &r.torque_n_m.map(f64::to_bits));
        }
        LogRecord::Command(r) => {
            add("force_n", &r.force_n.map(f64::to_bits));
            add("limits", &[r.limits.into()]);
            add("energy_j", &[r.energy_j.to_bits()]);
            add("tank_j", &[r.tank_j.to_bits()]);
            add("torque_n_m", &r.torque_n_m.map(f64::to_bits));
        }
        LogRecord::Contact(r) => {
            add("mode", &[r.mode as u64]);
            add("triangle", &[r.triangle.into()]);
            add("weights", &r.weights.map(f64::to_bits));
            add("normal", &singles(r.normal));
            add("normal_force_n", &[r.normal_force_n.to_bits().into()]);
            add("tangential_force_n", &[r.tangential_force_n.to_bits().into()]);
            add("area_m2", &[r.area_m2.to_bits().into()]);
            add("count", &[r.count.into()]);
        }
        LogRecord::ContactPoint(r) => {
            add("place_m", &singles(r.place_m));
            add("normal", &singles(r.normal));
            add("force_n", &singles(r.force_n));
            add("triangle", &[r.triangle.into()]);
            add("mode", &[r.mode as u64]);
        }
        LogRecord::Resync(r) => {
            add("version", &[r.version.into()]);
            add("age", &[r.age.0]);
            add("jump_before_n", &[r.jump_before_n.to_bits()]);
            add("jump_after_n", &[r.jump_after_n.to_bits()]);
            add("energy_j", &[r.energy_j.to_bits()]);
        }
        LogRecord::Global(r) => {
            add("version", &[r.version.into()]);
            add("first_tick", &[r.first_tick]);
            add("last_tick", &[r.last_tick]);
        }
        LogRecord::Probe(r) => {
            add("node", &[r.node.into()]);
            add("local_m", &r.local_m.map(f64::to_bits));
            add("global_m", &r.global_m.map(f64::to_bits));
        }
        // Inputs and measurements: nothing is computed that they could be compared with.
        LogRecord::Tick(_)
        | LogRecord::Actors(_)
        | LogRecord::Event(_)
        | LogRecord::Port(_)
        | LogRecord::Input(_)
        | LogRecord::Tool(_)
        | LogRecord::Link(_) => {}
    }
    all
}

fn singles(vector: [f32; 3]) -> [u64; 3] {
    vector.map(|component| component.to_bits().into())
}

/// A sample in one line.
pub(super) fn in_words(record: &LogRecord) -> String {
    let t = record.time().as_secs_f64();
    let whose = if record.device() > 0 { format!("device {}, ", record.device()) } else { String::new() };
    match record {
        LogRecord::Force(r) => format!(
            "{:?} N ({whose}t = {t} s, model {}, age {:?} s, energy {:?} J)",
            r.force_n, r.model_version, r.model_age_s, r.energy_j
        ),
        LogRecord::Command(r) => format!("{:?} N ({whose}t = {t} s, limits {})", r.force_n, r.limits),
        other => format!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{
        CommandSample, ContactPointSample, ContactSample, ForceSample, GlobalTick, JoinedRecords, ProbeSample, Resync,
    };
    use crate::runtime::Record;

    // Check that every bit of the records that a sample uses belongs to a named field, whether it has a part or none.
    #[test]
    fn every_flipped_bit_of_a_computed_sample_is_a_difference_with_a_name() {
        let torque_n_m = [1.0, 2.0, 3.0];
        let samples: [LogRecord; 7] = [
            LogRecord::Force(ForceSample { torque_n_m, ..ForceSample::default() }),
            LogRecord::Command(CommandSample { torque_n_m, ..CommandSample::default() }),
            LogRecord::Contact(ContactSample::default()),
            LogRecord::ContactPoint(ContactPointSample::default()),
            LogRecord::Resync(Resync::default()),
            LogRecord::Global(GlobalTick::default()),
            LogRecord::Probe(ProbeSample::default()),
        ];
        for sample in samples {
            let [part, main] = sample.to_records();
            let main = main.unwrap();
            let mut names = Vec::new();
            for word in 0..6 {
                for bit in 0..64 {
                    let flipped = |record: Record| {
                        let mut flipped = record;
                        flipped.words[word] ^= 1 << bit;
                        flipped
                    };
                    names.extend(changed(&sample, part, flipped(main)));
                    names.extend(part.and_then(|part| changed(&sample, Some(flipped(part)), main)));
                }
            }
            for bit in 0..32 {
                let index = Record { index: main.index ^ 1 << bit, ..main };
                let code = Record { code: main.code ^ 1 << (bit % 16), ..main };
                names.extend([index, code].iter().filter_map(|flipped| changed(&sample, part, *flipped)));
                let at = |record: Record| Record { stamp: crate::runtime::Nanos(record.stamp.0 ^ 1 << bit), ..record };
                names.extend(changed(&sample, part.map(at), at(main)));
            }
            names.sort_unstable();
            names.dedup();
            let mut named: Vec<_> = fields(&sample).into_iter().map(|(name, _)| name).collect();
            named.sort_unstable();
            named.dedup();
            assert_eq!(names, named, "{sample:?}");
        }
    }

    /// The field that a changed record changes; `None` for bits that the sample does not use.
    fn changed(sample: &LogRecord, part: Option<Record>, main: Record) -> Option<&'static str> {
        let mut joined = JoinedRecords::default();
        let other = [part, Some(main)].iter().flatten().filter_map(|record| joined.read(record)).next().unwrap();
        let is_used = other.to_records() != sample.to_records();
        assert_eq!(first_difference(sample, &other).is_some(), is_used, "{other:?}");
        first_difference(sample, &other)
    }
}
