//! The predicted motion of a ring as bytes.
//!
//! A motion is smooth but where something happens, so that few of its samples tell the others: as many are sent as bring all of them
//! back within [`CLOSE`], a thousandth of the largest of its quantity, where what a forecast gets wrong is per cents. What is sent is
//! rounded to [`STEPS`], and hardly leaves the curve through what was sent before, so that what is left of a number fits in a byte as a rule.

use super::knots::Knots;
use crate::bytes::{BytesReader, BytesWriter};

/// Quantities: positions, velocities, forces.
const QUANTITIES: usize = 3;
/// Steps from zero to the largest number.
const STEPS: f64 = 8191.0;
/// Numbers of one path at most: a ring of 1,000 nodes for 1,000 steps.
pub(super) const MOST_NUMBERS: usize = 9_000_000;
/// How far a number may come back from what it was, in steps.
const CLOSE: f64 = 8.0;

/// Appends `samples`, each of [`QUANTITIES`] times `numbers` numbers; positions are told from those of the first.
pub(super) fn write(to: &mut BytesWriter<'_>, numbers: usize, samples: &[f64]) {
    let size = QUANTITIES * numbers;
    let (first, samples) = match samples.get(..numbers) {
        Some(first) if numbers > 0 && (size..=MOST_NUMBERS).contains(&samples.len()) => (first, samples),
        _ => (&[][..], &[][..]),
    };
    to.list(first, |to, &number| to.f64(number));
    if first.is_empty() {
        return;
    }
    let (told, steps) = round(samples, first);
    // What is rounded is half a step off already.
    let knots = Knots::of(&told, size, CLOSE - 0.5);
    to.list(&knots.gaps(), |to, &gap| to.u8(gap));
    steps.iter().for_each(|&step| to.f32(step));
    let mut expected = vec![0.0; size];
    for (number, sample) in knots.samples().iter().enumerate() {
        knots.expected(number).write(&told, &mut expected);
        for (number, expected) in told[sample * size..].iter().zip(&expected) {
            let beside = (number - expected.round()) as i32;
            // Small ones of either sign are small numbers.
            to.varint(((beside << 1) ^ (beside >> 31)).cast_unsigned());
        }
    }
}

/// What is told of `samples`, in whole steps, and the step of each quantity.
fn round(samples: &[f64], first: &[f64]) -> (Vec<f64>, [f32; QUANTITIES]) {
    let (numbers, size) = (first.len(), QUANTITIES * first.len());
    let (mut told, mut largest) = (samples.to_vec(), [0.0; QUANTITIES]);
    for sample in told.chunks_exact_mut(size) {
        sample.iter_mut().zip(first).for_each(|(number, first)| *number -= first);
        for (largest, numbers) in largest.iter_mut().zip(sample.chunks_exact(numbers)) {
            *largest = numbers.iter().fold(*largest, |largest: f64, number| largest.max(number.abs()));
        }
    }
    // A quantity that is nothing in single precision is not told.
    let steps =
        largest.map(|largest| Some((largest / STEPS) as f32).filter(|step| *step >= f32::MIN_POSITIVE).unwrap_or(0.0));
    for sample in told.chunks_exact_mut(size) {
        for (&step, numbers) in steps.iter().zip(sample.chunks_exact_mut(numbers)) {
            let share = if step > 0.0 { 1.0 / f64::from(step) } else { 0.0 };
            numbers.iter_mut().for_each(|number| *number = (*number * share).round());
        }
    }
    (told, steps)
}

/// Takes what [`write`] has appended: the samples in place of `samples`, and how many numbers a quantity has.
pub(super) fn read(from: &mut BytesReader<'_>, samples: &mut Vec<f64>) -> Option<usize> {
    samples.clear();
    let (mut first, mut gaps) = (Vec::new(), Vec::new());
    from.list(size_of::<f64>(), &mut first, BytesReader::f64)?;
    let numbers = first.len();
    if numbers == 0 {
        return Some(0);
    }
    from.list(1, &mut gaps, BytesReader::u8)?;
    let knots = Knots::apart(&gaps)?;
    let steps = [from.f32()?, from.f32()?, from.f32()?].map(f64::from);
    let size = QUANTITIES * numbers;
    let total = (knots.samples().last()? + 1).checked_mul(size)?;
    // Each number is a byte at least.
    if total > MOST_NUMBERS || knots.samples().len() * size > from.0.len() || steps.iter().any(|&step| step < 0.0) {
        return None;
    }
    samples.resize(total, 0.0);
    let mut expected = vec![0.0; size];
    for (number, sample) in knots.samples().iter().enumerate() {
        knots.expected(number).write(samples, &mut expected);
        for (number, expected) in samples[sample * size..].iter_mut().zip(&expected) {
            let beside = from.varint()?;
            let beside = (beside >> 1).cast_signed() ^ -(beside & 1).cast_signed();
            *number = Some(f64::from(beside) + expected.round()).filter(|rounded| rounded.abs() <= STEPS + 1.0)?;
        }
    }
    for (sample, curve) in knots.others() {
        curve.write(samples, &mut expected);
        samples[sample * size..][..size].copy_from_slice(&expected);
    }
    for sample in samples.chunks_exact_mut(size) {
        for (step, numbers) in steps.iter().zip(sample.chunks_exact_mut(numbers)) {
            numbers.iter_mut().for_each(|number| *number *= step);
        }
        sample.iter_mut().zip(&first).for_each(|(number, first)| *number += first);
    }
    Some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two nodes on their way: quantities of different sizes, and a jolt of what is `jolt` times as large.
    fn samples(count: usize, jolt: f64) -> Vec<f64> {
        let at = |n: usize| {
            let t = n as f64 * 1e-2;
            let jolted = if n == 40 { 1.0 + jolt } else { 1.0 };
            (0..18)
                .map(move |i| f64::from(i) * 0.1 + (3.0 * t + f64::from(i)).sin() * 10.0_f64.powi(i / 6 - 3) * jolted)
        };
        (0..count).flat_map(at).collect()
    }

    fn sent(samples: &[f64]) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&mut BytesWriter(&mut bytes), 6, samples);
        bytes
    }

    #[test]
    fn a_path_comes_back_as_exact_as_was_said_and_in_a_byte_for_several_numbers() {
        for (jolt, most_bytes) in [(0.0, 0.25), (0.5, 0.5)] {
            let samples = samples(200, jolt);
            let bytes = sent(&samples);
            assert!(
                (bytes.len() as f64) < most_bytes * samples.len() as f64,
                "{} bytes for {}",
                bytes.len(),
                samples.len()
            );
            let (mut came, mut from) = (vec![7.0], BytesReader(&bytes));
            assert_eq!(read(&mut from, &mut came), Some(6));
            assert!(from.0.is_empty() && came.len() == samples.len());
            let told = |at: usize| samples[at] - if at % 18 < 6 { samples[at % 18] } else { 0.0 };
            for quantity in 0..QUANTITIES {
                let numbers = || (0..samples.len()).filter(|at| at % 18 / 6 == quantity);
                let largest = numbers().map(|at| told(at).abs()).fold(0.0, f64::max);
                let apart = numbers().map(|at| (samples[at] - came[at]).abs()).fold(0.0, f64::max);
                assert!(apart <= 1.001 * CLOSE / STEPS * largest, "quantity {quantity}: {apart} of {largest}");
            }
            assert_eq!(came[..6], samples[..6], "the first positions to the last bit");
        }
    }

    #[test]
    fn a_path_of_a_few_samples_comes_back() {
        for count in 1..6 {
            let samples = samples(count, 0.0);
            let mut came = Vec::new();
            assert_eq!(read(&mut BytesReader(&sent(&samples)), &mut came), Some(6));
            assert_eq!(came.len(), samples.len());
            samples.iter().zip(&came).for_each(|(a, b)| assert!((a - b).abs() < 3e-3, "{a} {b}"));
        }
    }

    #[test]
    fn a_path_that_rests_comes_back() {
        for (count, rest) in (1..6).flat_map(|count| [1.5, 1.7e-41].map(|rest| (count, rest))) {
            let samples = [rest; 18].repeat(count);
            let mut came = Vec::new();
            assert_eq!(read(&mut BytesReader(&sent(&samples)), &mut came), Some(6));
            assert!(came.len() == samples.len() && came.iter().all(|number| (number - rest).abs() < 1e-6));
        }
    }

    #[test]
    fn no_path_is_one_of_no_numbers() {
        let mut bytes = Vec::new();
        write(&mut BytesWriter(&mut bytes), 0, &[]);
        assert_eq!(read(&mut BytesReader(&bytes), &mut Vec::new()), Some(0));
    }

    #[test]
    fn numbers_that_nobody_writes_are_refused() {
        let bytes = sent(&samples(200, 0.0));
        // A number beyond the steps.
        let gaps = 4 + 6 * 8;
        let numbers = gaps + 4 + usize::from(bytes[gaps]) + 3 * 4;
        let mut wild = bytes.clone();
        wild.splice(numbers..=numbers, [0xfe, 0xff, 0xff, 0xff, 0x0f]);
        assert_eq!(read(&mut BytesReader(&wild), &mut Vec::new()), None);
        for gap in [0, 200] {
            let mut apart = bytes.clone();
            apart[gaps + 4] = gap;
            assert_eq!(read(&mut BytesReader(&apart), &mut Vec::new()), None);
        }
    }
}
