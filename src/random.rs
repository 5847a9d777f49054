//! Random numbers that depend on a seed and a place only: what is repeated meets the same ones.

/// A number in [0, 1) for this place, such as a time: splitmix64 (Steele, Lea and Flood 2014) of seed and place.
pub fn uniform(seed: u64, place: u64) -> f64 {
    let mut z = seed.wrapping_add(place.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    // 53 bits are what a double holds.
    (z >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fill_their_range_evenly_and_differ_by_seed() {
        let numbers: Vec<f64> = (0..10_000).map(|tick| uniform(7, tick * 1_000_000)).collect();
        assert!(numbers.iter().all(|number| (0.0..1.0).contains(number)));
        let mut tenths = [0; 10];
        numbers.iter().for_each(|number| tenths[(number * 10.0) as usize] += 1);
        // Five standard deviations of a binomial count.
        assert!(tenths.iter().all(|&count: &i32| (count - 1000).abs() < 150), "{tenths:?}");
        assert_ne!(uniform(7, 5), uniform(8, 5));
    }
}
