//! What is left of one tetrahedron of the lattice once the surface has cut it (Labelle and Shewchuk 2007, figure 3).
//!
//! The paper's table of stencils follows from one rule for the diagonal of a cut face, and from how many corners are inside: with one, a
//! smaller tetrahedron; with two and one on the surface, a pyramid in two; otherwise a prism in three.

use super::lattice::Steps;

/// A corner of an element that is made: of the tetrahedron, or the cut point of the edge between two of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Corner {
    Own(usize),
    Cut(usize, usize),
}

use Corner::{Cut, Own};

/// Which corner a diagonal of the quadrilateral between the inner corners `a` and `b` and the cut points of their edges to the outer `c`
/// starts from: true for `a`. Both tetrahedra at the face must answer the same, so only the face itself may be asked.
fn diagonal_from_first(at: &[Steps; 4], a: usize, b: usize, c: usize) -> bool {
    let is_long = |from: usize, to: usize| from ^ to == 1;
    if is_long(a, b) {
        // Both cuts on short edges: the parity rule. The two differ along one axis, so exactly one of them is even.
        let greater = (0..3).filter(|&axis| at[a][axis] > at[c][axis]).count();
        return greater % 2 == 0;
    }
    is_long(b, c)
}

/// Calls `make` with each element that fills the part of a tetrahedron inside the surface, positively oriented as the tetrahedron is. Its
/// corners are at the steps `at`, 0-1 and 2-3 being the long edges; `signs` are 1 inside, 0 on the surface and -1 outside.
pub(super) fn fill_one(at: &[Steps; 4], signs: [i8; 4], mut make: impl FnMut([Corner; 4])) {
    let whole = [0, 1, 2, 3].map(Own);
    let corners = |sign: i8| (0..4).filter(move |&n| signs[n] == sign);
    let with = |changes: &[(usize, Corner)]| {
        let mut corners = whole;
        changes.iter().for_each(|&(n, corner)| corners[n] = corner);
        corners
    };
    let (inside, outside) = (corners(1).count(), corners(-1).count());
    let first = |sign: i8, skip: usize| corners(sign).nth(skip).unwrap_or_default();
    match (inside, outside) {
        (0, _) => {}
        (_, 0) => make(whole),
        (1, _) => {
            let a = first(1, 0);
            make([0, 1, 2, 3].map(|n| if signs[n] < 0 { Cut(a, n) } else { Own(n) }));
        }
        (2, 1) => {
            let (a, b, c) = (first(1, 0), first(1, 1), first(-1, 0));
            let (a, b) = if diagonal_from_first(at, a, b, c) { (a, b) } else { (b, a) };
            make(with(&[(c, Cut(b, c))]));
            make(with(&[(b, Cut(b, c)), (c, Cut(a, c))]));
        }
        (2, _) => {
            // Of the two faces with both inner corners, one has its diagonal from each: the parity of the outer corners differs, and
            // the long edges of mixed ends lie in different faces. So the prism has one way to be split, and it is no Schoenhardt's.
            let (a, b, c, d) = (first(1, 0), first(1, 1), first(-1, 0), first(-1, 1));
            let (c, d) = if diagonal_from_first(at, a, b, c) { (c, d) } else { (d, c) };
            make(with(&[(c, Cut(b, c)), (d, Cut(a, d))]));
            make(with(&[(a, Cut(a, d)), (c, Cut(b, c)), (d, Cut(b, d))]));
            make(with(&[(b, Cut(b, c)), (c, Cut(a, c)), (d, Cut(a, d))]));
        }
        _ => {
            // The diagonal of two columns of the prism starts from the inner corner of the later one. The long edge to the outer
            // corner is last or first, so the three never run round.
            let d = first(-1, 0);
            let mut column: Vec<usize> = corners(1).collect();
            column.sort_by(|&x, &y| match diagonal_from_first(at, x, y, d) {
                true => std::cmp::Ordering::Greater,
                false => std::cmp::Ordering::Less,
            });
            let [x, y, z] = [column[0], column[1], column[2]];
            make(with(&[(d, Cut(x, d))]));
            make(with(&[(x, Cut(x, d)), (d, Cut(y, d))]));
            make(with(&[(x, Cut(x, d)), (y, Cut(y, d)), (d, Cut(z, d))]));
        }
    }
}
