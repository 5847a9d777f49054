//! Vectors as records hold them: three numbers.

/// The length of a vector, in its own unit.
pub fn magnitude([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}
