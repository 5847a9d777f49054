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

#[cfg(test)]
mod tests {
    use palpate_model::Vec3;
    use palpate_model::mesh::TetrahedralMesh;

    use super::super::lattice::FORWARD;
    use super::super::stuff::NEAR;
    use super::*;
    use crate::support::angles;

    /// Calls `visit` with every way to choose one of `choices` for each of `places`.
    fn each_choice(places: usize, choices: usize, mut visit: impl FnMut(&[usize])) {
        for n in 0..choices.pow(places as u32) {
            let chosen: Vec<usize> = (0..places).map(|place| n / choices.pow(place as u32) % choices).collect();
            visit(&chosen);
        }
    }

    /// Check that every element of every pattern of signs is positive and of the promised angles, with the corners on the surface drawn
    /// as far as they ever are along any edge, and the cuts at either end of where they may lie.
    #[test]
    fn every_stencil_keeps_the_bounds_at_its_extremes() {
        let ways: Vec<Steps> = FORWARD.iter().flat_map(|way| [*way, way.map(|step| -step)]).collect();
        let place = |steps: Steps| Vec3::from(steps.map(f64::from));
        let near = |is_long: bool| NEAR[usize::from(!is_long)];
        let mut worst = [180.0_f64, 0.0];
        // The cells along one axis; the others follow by turning, but the parity rule has two cases.
        for at in [[[1, 1, 1], [3, 1, 1], [2, 2, 0], [2, 2, 2]], [[1, 1, 1], [3, 1, 1], [2, 0, 0], [2, 2, 0]]] {
            each_choice(4, 3, |signs| {
                let signs = [0, 1, 2, 3].map(|n| signs[n] as i8 - 1);
                let drawn: Vec<usize> = (0..4).filter(|&n| signs[n] == 0).collect();
                if drawn.len() == 4 || !signs.contains(&1) {
                    return;
                }
                let cuts =
                    signs.iter().filter(|&&sign| sign > 0).count() * signs.iter().filter(|&&sign| sign < 0).count();
                let mut mesh = TetrahedralMesh::default();
                each_choice(drawn.len(), ways.len() + 1, |way| {
                    each_choice(cuts, 2, |end| {
                        let mut corners = at.map(place);
                        for (&n, &way) in drawn.iter().zip(way).filter(|(_, way)| **way > 0) {
                            let way = ways[way - 1];
                            corners[n] += place(way) * near(way.contains(&0));
                        }
                        let cut = |a: usize, b: usize| {
                            let number = (0..4).flat_map(|a| (0..4).map(move |b| (a, b)));
                            let number = number
                                .filter(|&(a, b)| signs[a] > 0 && signs[b] < 0)
                                .position(|cut| cut == (a, b))
                                .unwrap();
                            let near = near(a ^ b == 1);
                            corners[a] + (corners[b] - corners[a]) * if end[number] == 0 { near } else { 1.0 - near }
                        };
                        fill_one(&at, signs, |element| {
                            let first = mesh.points.len() as u32;
                            mesh.points.extend(element.map(|corner| match corner {
                                Own(n) => corners[n],
                                Cut(a, b) => cut(a, b),
                            }));
                            mesh.tetrahedra.push([0, 1, 2, 3].map(|n| first + n));
                        });
                    });
                });
                let [smallest, largest] = angles(&mesh);
                worst = [worst[0].min(smallest), worst[1].max(largest)];
            });
        }
        assert!(worst[0] > 10.75 && worst[1] < 164.8, "{worst:?}");
    }
}
