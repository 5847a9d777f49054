//! What must hold of a surface before it is filled.

use palpate_model::Vec3;

use super::{SurfaceMesh, Welded};
use crate::error::MeshError;

/// A record of the changes that [`SurfaceMesh::cleaned`] made to a surface, and of the parts that it found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceFindings {
    /// The parts that do not touch each other, the largest first.
    pub parts: Vec<SurfacePart>,
    /// Triangles that were turned round: those that were against their neighbours, or all of a surface that was inside out.
    pub turned_triangles: usize,
    /// Triangles without area that were left out.
    pub left_out_triangles: usize,
}

/// A connected part of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePart {
    /// Number of triangles.
    pub triangles: usize,
    /// The lowest coordinates (m).
    pub low: Vec3,
    /// The highest coordinates (m).
    pub high: Vec3,
}

/// A side of a triangle, from the lower node to the higher.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    nodes: [u32; 2],
    triangle: u32,
    /// True if the triangle passes it from the higher node to the lower.
    is_backwards: bool,
}

impl SurfaceMesh {
    /// The surface as it can be filled: nodes at one place are one, what has no area is left out, triangles that are against their
    /// neighbours and a surface that is inside out are turned round. A part within another is a cavity if it faces inwards.
    ///
    /// # Errors
    /// If a node or coordinate is impossible, there are no triangles, the surface is open, more than two triangles meet at an
    /// edge, it has one side only as a Moebius strip has, or it crosses itself; triangles that overlap in one plane are not
    /// noticed.
    pub fn cleaned(self) -> Result<(Self, SurfaceFindings), MeshError> {
        let given = self.triangles.len();
        let mut surface = self.welded()?;
        let left_out_triangles = given - surface.triangles.len();
        if surface.triangles.is_empty() {
            return Err(MeshError::new("the surface has no triangles: nothing is inside it"));
        }
        let neighbours = surface.neighbours()?;
        let (parts, mut turned_triangles) = surface.orient(&neighbours)?;
        if surface.volume() < 0.0 {
            surface.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            turned_triangles = surface.triangles.len() - turned_triangles;
        }
        surface.check_crossing()?;
        Ok((surface, SurfaceFindings { parts, turned_triangles, left_out_triangles }))
    }

    /// With the nodes that triangles use, each place once.
    fn welded(self) -> Result<Self, MeshError> {
        let mut welded = Welded::default();
        for (number, triangle) in self.triangles.iter().enumerate() {
            let corners = triangle.map(|node| self.points.get(node as usize).copied());
            let [Some(a), Some(b), Some(c)] = corners else {
                let all = self.points.len();
                let message = format!("triangle {number} of the surface has nodes {triangle:?}, there are {all}");
                return Err(MeshError::new(message));
            };
            if ![a, b, c].iter().flatten().all(|x| x.is_finite()) {
                return Err(MeshError::new(format!(
                    "triangle {number} of the surface has a corner that is not finite"
                )));
            }
            welded.add([a, b, c]);
        }
        Ok(welded.finish())
    }

    /// For each triangle its three neighbours, and whether those pass the common side as it does itself: against it.
    fn neighbours(&self) -> Result<Vec<[(u32, bool); 3]>, MeshError> {
        let sides_of = |(triangle, nodes): (usize, &[u32; 3])| {
            let [a, b, c] = *nodes;
            [[a, b], [b, c], [c, a]].map(|[from, to]| Side {
                nodes: [from.min(to), from.max(to)],
                triangle: triangle as u32,
                is_backwards: from > to,
            })
        };
        let mut sides: Vec<Side> = self.triangles.iter().enumerate().flat_map(sides_of).collect();
        sides.sort_unstable();
        let at_edge = || sides.chunk_by(|a, b| a.nodes == b.nodes);
        let place = |side: &Side| {
            let [a, b] = side.nodes.map(|node| self.points[node as usize]);
            place(&((a + b) / 2.0))
        };
        if let Some(many) = at_edge().find(|sides| sides.len() > 2) {
            let (count, at) = (many.len(), place(&many[0]));
            return Err(MeshError::new(format!("{count} triangles of the surface meet at an edge at {at}, two may")));
        }
        let mut open = at_edge().filter(|sides| sides.len() == 1);
        if let Some(first) = open.next() {
            let (count, at) = (1 + open.count(), place(&first[0]));
            let edges = if count == 1 { "edge has" } else { "edges have" };
            let message =
                format!("the surface is open: {count} {edges} one triangle only, the first at {at}; close it first");
            return Err(MeshError::new(message));
        }
        let mut neighbours = vec![[(0, false); 3]; self.triangles.len()];
        let mut filled = vec![0; self.triangles.len()];
        for pair in at_edge() {
            let is_against = pair[0].is_backwards == pair[1].is_backwards;
            for (own, other) in [(&pair[0], &pair[1]), (&pair[1], &pair[0])] {
                let own = own.triangle as usize;
                neighbours[own][filled[own]] = (other.triangle, is_against);
                filled[own] += 1;
            }
        }
        Ok(neighbours)
    }

    /// Turns triangles round so that all of a part agree; the parts and how many triangles were turned.
    fn orient(&mut self, neighbours: &[[(u32, bool); 3]]) -> Result<(Vec<SurfacePart>, usize), MeshError> {
        // Whether each triangle is to be turned, once it is known.
        let mut turn: Vec<Option<bool>> = vec![None; self.triangles.len()];
        let mut parts = Vec::new();
        for first in 0..self.triangles.len() {
            if turn[first].is_some() {
                continue;
            }
            turn[first] = Some(false);
            let mut part = vec![first as u32];
            let mut next = 0;
            while let Some(&triangle) = part.get(next) {
                next += 1;
                let own = turn[triangle as usize] == Some(true);
                for &(other, is_against) in &neighbours[triangle as usize] {
                    match turn[other as usize] {
                        None => {
                            turn[other as usize] = Some(own != is_against);
                            part.push(other);
                        }
                        Some(other) if other == (own != is_against) => {}
                        Some(_) => {
                            let at = place(&self.corners(triangle)[0]);
                            let message = format!("the surface has one side only, seen at {at}: no inside, no outside");
                            return Err(MeshError::new(message));
                        }
                    }
                }
            }
            let turned = part.iter().filter(|&&triangle| turn[triangle as usize] == Some(true)).count();
            // Which of its triangles are right the part does not say: outwards is what a part that had both is.
            let is_mixed = turned > 0;
            part.iter()
                .filter(|&&t| turn[t as usize] == Some(true))
                .for_each(|&t| self.triangles[t as usize].swap(1, 2));
            if is_mixed && self.volume_of(&part) < 0.0 {
                for &triangle in &part {
                    self.triangles[triangle as usize].swap(1, 2);
                    turn[triangle as usize] = turn[triangle as usize].map(|turned| !turned);
                }
            }
            parts.push(self.part(&part));
        }
        parts.sort_by_key(|part| std::cmp::Reverse(part.triangles));
        Ok((parts, turn.iter().filter(|turned| **turned == Some(true)).count()))
    }

    fn volume_of(&self, triangles: &[u32]) -> f64 {
        let origin = self.corners(triangles[0])[0];
        let of = |&triangle: &u32| {
            let [a, b, c] = self.corners(triangle).map(|corner| corner - origin);
            a.cross(&b).dot(&c)
        };
        triangles.iter().map(of).sum()
    }

    fn part(&self, triangles: &[u32]) -> SurfacePart {
        let corners = triangles.iter().flat_map(|&triangle| self.corners(triangle));
        let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (low, high) = corners.fold(start, |(low, high), corner| (low.inf(&corner), high.sup(&corner)));
        SurfacePart { triangles: triangles.len(), low, high }
    }
}

/// A place in metres.
pub(super) fn place(point: &Vec3) -> String {
    format!("({:.4}, {:.4}, {:.4}) m", point.x, point.y, point.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube with corners at 0 and `size`, moved by `at`, seen from outside.
    fn cube(size: f64, at: f64) -> SurfaceMesh {
        let points = (0..8u32).map(|n| Vec3::new(f64::from(n & 1), f64::from(n >> 1 & 1), f64::from(n >> 2)));
        let points = points.map(|point| point * size + Vec3::repeat(at)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        SurfaceMesh { points, triangles }
    }

    fn both(mut one: SurfaceMesh, other: SurfaceMesh) -> SurfaceMesh {
        let first = one.points.len() as u32;
        one.points.extend(other.points);
        one.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|node| node + first)));
        one
    }

    fn refusal(surface: SurfaceMesh) -> String {
        surface.cleaned().unwrap_err().to_string()
    }

    #[test]
    fn a_closed_surface_stays_and_one_that_is_inside_out_is_turned_round() {
        let (same, findings) = cube(0.1, 0.0).cleaned().unwrap();
        assert_eq!((findings.turned_triangles, findings.parts.len(), same.triangles.len()), (0, 1, 12));
        assert!((same.volume() - 0.001).abs() < 1e-15);
        let mut inside_out = cube(0.1, 0.0);
        inside_out.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        let (turned, findings) = inside_out.cleaned().unwrap();
        assert_eq!(findings.turned_triangles, 12);
        assert!((turned.volume() - 0.001).abs() < 1e-15);
    }

    #[test]
    fn triangles_against_their_neighbours_are_turned_whichever_come_first() {
        for against in [vec![7], vec![0], vec![0, 3, 4], (1..12).collect()] {
            let mut surface = cube(0.1, 0.0);
            against.iter().for_each(|&triangle: &usize| surface.triangles[triangle].swap(1, 2));
            let (turned, findings) = surface.cleaned().unwrap();
            assert_eq!(findings.turned_triangles, against.len(), "{against:?}");
            assert!((turned.volume() - 0.001).abs() < 1e-15, "{against:?}");
        }
    }

    #[test]
    fn parts_are_told_and_a_cavity_stays_one() {
        let mut cavity = cube(0.02, 0.04);
        cavity.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        let (surface, findings) = both(cube(0.1, 0.0), both(cavity, cube(0.05, 0.2))).cleaned().unwrap();
        assert!((surface.volume() - (0.001 - 8e-6 + 1.25e-4)).abs() < 1e-15);
        assert_eq!(findings.parts.len(), 3);
        let part = findings.parts.iter().find(|part| part.low.x == 0.2).unwrap();
        assert!(part.triangles == 12 && (part.high - Vec3::repeat(0.25)).norm() < 1e-12);
    }

    #[test]
    fn nodes_at_one_place_are_joined() {
        let given = cube(0.1, 0.0);
        let corners = given.triangles.iter().flatten().map(|&node| given.points[node as usize]);
        let mut soup = SurfaceMesh {
            points: corners.collect(),
            triangles: (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        };
        soup.triangles.push([0, 1, 0]);
        let (joined, findings) = soup.cleaned().unwrap();
        assert_eq!((joined.points.len(), findings.left_out_triangles), (8, 1));
    }

    #[test]
    fn what_cannot_be_filled_is_named_in_one_line() {
        let changed = |change: &dyn Fn(&mut SurfaceMesh)| {
            let mut surface = cube(0.1, 0.0);
            change(&mut surface);
            refusal(surface)
        };
        let cases = [
            (refusal(SurfaceMesh::default()), "the surface has no triangles"),
            (changed(&|s| s.triangles[2][1] = 8), "triangle 2 of the surface has nodes [4, 8, 7], there are 8"),
            (changed(&|s| s.points[4].z = f64::NAN), "triangle 2 of the surface has a corner that is not finite"),
            (
                changed(&|s| s.triangles.truncate(11)),
                "the surface is open: 3 edges have one triangle only, the first at (0.1",
            ),
            (
                changed(&|s| s.triangles.push([0, 1, 6])),
                "3 triangles of the surface meet at an edge at (0.0500, 0.0000, 0.0000) m, two may",
            ),
            (refusal(both(cube(0.1, 0.0), cube(0.1, 0.03))), "the surface crosses itself at (0."),
            (changed(&|s| s.triangles = vec![[0, 1, 2]]), "the surface is open: 3 edges"),
        ];
        for (message, start) in cases {
            assert!(message.starts_with(start) && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn a_surface_with_one_side_is_refused() {
        // The projective plane of six nodes: closed, two triangles at each edge, and no outside.
        let triangles = vec![
            [0, 1, 2],
            [0, 2, 3],
            [0, 3, 4],
            [0, 4, 5],
            [0, 5, 1],
            [1, 2, 4],
            [2, 3, 5],
            [3, 4, 1],
            [4, 5, 2],
            [5, 1, 3],
        ];
        let points = (0..6).map(|n| Vec3::new(f64::from(n), f64::from(n * n), f64::from(n * n * n))).collect();
        let message = refusal(SurfaceMesh { points, triangles });
        assert!(message.starts_with("the surface has one side only, seen at"), "{message}");
    }
}
