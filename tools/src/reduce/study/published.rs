//! The paper's Tables 1 and 2 as they were published.

/// Cells along each axis, order, time (s) and "% error" of Table 1, 2D: 20 states kept, zeta = 1.
pub(super) const TABLE1_2D: [(usize, usize, f64, f64); 5] = [
    (5, 76, 0.07, 3.89e-6),
    (10, 356, 2.93, 0.00396),
    (15, 836, 47.14, 0.0383),
    (20, 1516, 293.15, 0.201),
    (25, 2396, 1172.1, 0.307),
];

/// The same in 3D: 102 states kept.
pub(super) const TABLE1_3D: [(usize, usize, f64, f64); 4] =
    [(4, 210, 0.36, 1.08e-13), (5, 474, 7.85, 4.84e-13), (6, 894, 57.21, 1.51e-12), (7, 1506, 274.98, 2.84e-12)];

/// zeta and "% error" of Table 2: 12 x 12 cells, 20 states kept.
pub(super) const TABLE2: [(f64, f64); 9] = [
    (0.001, 51.1),
    (0.01, 38.4),
    (0.1, 13.7),
    (0.2, 4.24),
    (0.6, 0.146),
    (0.7, 0.0641),
    (1.0, 0.0195),
    (1.5, 0.00291),
    (2.0, 0.00097),
];

/// States of the paper's local models, and of its reduced ones: 4 x 2 and 4 x 4 x 2 cells.
pub(super) fn reduced_order(dimensions: usize) -> usize {
    if dimensions == 2 { 20 } else { 102 }
}
