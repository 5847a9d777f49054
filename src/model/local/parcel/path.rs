//! The predicted motion of a ring as bytes.
//!
//! Each of its three quantities is rounded to a 16-bit share of the largest there is: 1.5e-5 of it, where what a forecast gets wrong is
//! per cents. Numbers of a motion hardly leave the line through the two before, so that what is left of them fits in a byte as
//! a rule.

use crate::bytes::{BytesReader, BytesWriter};

/// Quantities: positions, velocities, forces.
const QUANTITIES: usize = 3;
/// Steps from zero to the largest number.
const STEPS: f64 = 32767.0;
/// Numbers of one path at most: a ring of 2,000 nodes for 2,000 steps.
const MOST_NUMBERS: usize = 36_000_000;

/// Appends `samples`, each of [`QUANTITIES`] times `numbers` numbers; positions are told from those of the first.
pub(super) fn write(to: &mut BytesWriter<'_>, numbers: usize, samples: &[f64]) {
    let size = QUANTITIES * numbers;
    let (first, count) = match samples.get(..numbers) {
        Some(first) if numbers > 0 && size * (samples.len() / size) <= MOST_NUMBERS => (first, samples.len() / size),
        _ => (&[][..], 0),
    };
    to.list(first, |to, &number| to.f64(number));
    to.u32(count as u32);
    if count == 0 {
        return;
    }
    let told = |sample: &[f64], at: usize| if at < numbers { sample[at] - first[at] } else { sample[at] };
    let largest = |quantity: usize| {
        let of = |sample| (quantity * numbers..(quantity + 1) * numbers).map(move |at| told(sample, at).abs());
        samples.chunks_exact(size).flat_map(of).fold(0.0, f64::max)
    };
    let steps: [f64; QUANTITIES] = std::array::from_fn(|quantity| f64::from((largest(quantity) / STEPS) as f32));
    steps.iter().for_each(|&step| to.f32(step as f32));
    let mut lines = Lines::new(size);
    for sample in samples.chunks_exact(size) {
        for at in 0..size {
            let step = steps[at / numbers];
            let rounded = if step > 0.0 { (told(sample, at) / step).round() as i32 } else { 0 };
            to.varint(lines.leave(at, rounded));
        }
    }
}

/// Takes what [`write`] has appended: the samples in place of `samples`, and how many numbers a quantity has.
pub(super) fn read(from: &mut BytesReader<'_>, samples: &mut Vec<f64>) -> Option<usize> {
    samples.clear();
    let mut first = Vec::new();
    from.list(size_of::<f64>(), &mut first, BytesReader::f64)?;
    let (numbers, count) = (first.len(), from.u32()? as usize);
    if numbers == 0 || count == 0 {
        return (numbers == 0 && count == 0).then_some(0);
    }
    let steps = [from.f32()?, from.f32()?, from.f32()?].map(f64::from);
    let size = QUANTITIES * numbers;
    let total = size.checked_mul(count)?;
    // Each number is a byte at least.
    if total > MOST_NUMBERS || total > from.0.len() || steps.iter().any(|&step| step < 0.0) {
        return None;
    }
    samples.reserve(total);
    let mut lines = Lines::new(size);
    for _ in 0..count {
        for at in 0..size {
            let told = f64::from(lines.follow(at, from.varint()?)) * steps[at / numbers];
            samples.push(if at < numbers { first[at] + told } else { told });
        }
    }
    Some(numbers)
}

/// The last two of each number, which the next one is on a line with.
struct Lines(Vec<[i32; 2]>);

impl Lines {
    fn new(size: usize) -> Self {
        Self(vec![[0; 2]; size])
    }

    /// What `number` is beside the line.
    fn leave(&mut self, at: usize, number: i32) -> u32 {
        let beside = number.wrapping_sub(self.next(at));
        self.push(at, number);
        // Small ones of either sign are small numbers.
        ((beside << 1) ^ (beside >> 31)).cast_unsigned()
    }

    /// The number that is so far beside the line.
    fn follow(&mut self, at: usize, beside: u32) -> i32 {
        let beside = (beside >> 1).cast_signed() ^ -(beside & 1).cast_signed();
        let number = self.next(at).wrapping_add(beside);
        self.push(at, number);
        number
    }

    fn next(&self, at: usize) -> i32 {
        let [before, last] = self.0[at];
        last.wrapping_add(last.wrapping_sub(before))
    }

    fn push(&mut self, at: usize, number: i32) {
        self.0[at] = [self.0[at][1], number];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two nodes on their way.
    fn samples(count: usize) -> Vec<f64> {
        let at = |n: usize| {
            let t = n as f64 * 1e-2;
            (0..18).map(move |i| f64::from(i) * 0.1 + (3.0 * t + f64::from(i)).sin() * 10.0_f64.powi(i / 6 - 3))
        };
        (0..count).flat_map(at).collect()
    }

    #[test]
    fn a_path_comes_back_as_exact_as_was_said_and_in_little_more_than_a_byte_for_each_number() {
        let sent = samples(100);
        let mut bytes = Vec::new();
        write(&mut BytesWriter(&mut bytes), 6, &sent);
        assert!(bytes.len() < sent.len() * 3 / 2, "{} bytes for {} numbers", bytes.len(), sent.len());
        let (mut read_back, mut from) = (vec![7.0], BytesReader(&bytes));
        assert_eq!(read(&mut from, &mut read_back), Some(6));
        assert!(from.0.is_empty() && read_back.len() == sent.len());
        for (at, (a, b)) in sent.iter().zip(&read_back).enumerate() {
            assert!((a - b).abs() <= 0.51 / STEPS * 4.0, "{at}: {a} {b}");
        }
        assert_eq!(read_back[..6], sent[..6], "the first positions to the last bit");
    }

    #[test]
    fn no_path_is_one_of_no_numbers() {
        let mut bytes = Vec::new();
        write(&mut BytesWriter(&mut bytes), 0, &[]);
        assert_eq!(read(&mut BytesReader(&bytes), &mut Vec::new()), Some(0));
    }
}
