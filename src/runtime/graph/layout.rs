//! Which column each box of a drawing stands in: sources left, what they feed to the right of them, and as few arrows
//! back as the order of the boxes allows.

/// The column of each of `nodes` boxes under these edges. Edges that close a circle point back to the left; every other
/// one points to the right.
pub(crate) fn columns(nodes: usize, edges: &[(usize, usize)]) -> Vec<usize> {
    let mut forward: Vec<Vec<usize>> = vec![Vec::new(); nodes];
    for &(from, to) in edges {
        // An edge that closes a circle is one whose end leads back to its beginning already.
        if from != to && !leads(&forward, to, from) {
            forward[from].push(to);
        }
    }
    let mut columns = vec![0; nodes];
    // Longest paths: each round settles one column more.
    for _ in 0..nodes {
        for from in 0..nodes {
            for &to in &forward[from] {
                columns[to] = columns[to].max(columns[from] + 1);
            }
        }
    }
    columns
}

fn leads(forward: &[Vec<usize>], from: usize, to: usize) -> bool {
    let (mut seen, mut left) = (vec![false; forward.len()], vec![from]);
    while let Some(node) = left.pop() {
        if node == to {
            return true;
        }
        if !std::mem::replace(&mut seen[node], true) {
            left.extend(&forward[node]);
        }
    }
    false
}

/// Moves places apart so that each has `room` to the next, in the order of `wanted`; as near to that as it goes.
pub(crate) fn apart(wanted: &[f64], room: f64, top: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|&a, &b| wanted[a].total_cmp(&wanted[b]));
    let mut places = wanted.to_vec();
    let mut free = f64::NEG_INFINITY;
    for &index in &order {
        places[index] = places[index].max(free);
        free = places[index] + room;
    }
    // As far too low as the last was pushed, half of it for all; never above the top.
    let pushed = order.last().map_or(0.0, |&last| places[last] - wanted[last]);
    let first = order.first().map_or(0.0, |&first| places[first] - top);
    let up = (pushed / 2.0).min(first).max(0.0);
    places.iter().map(|place| place - up).collect()
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn sources_stand_left_and_only_what_closes_a_circle_points_back() {
        assert_eq!(columns(4, &[(0, 1), (1, 2), (0, 2), (2, 0)]), [0, 1, 2, 0]);
        assert_eq!(columns(3, &[(1, 0), (0, 2)]), [1, 0, 2]);
        assert_eq!(columns(2, &[(0, 0), (1, 1)]), [0, 0]);
    }

    #[test]
    fn labels_that_would_overlap_are_moved_apart_and_keep_their_order() {
        let places = apart(&[100.0, 101.0, 300.0, 99.0], 30.0, 0.0);
        let order = [places[3], places[0], places[1], places[2]];
        assert!(order.windows(2).all(|pair| pair[1] - pair[0] >= 30.0), "{places:?}");
        assert!(apart(&[5.0, 5.0], 30.0, 4.0).iter().all(|place| *place >= 4.0));
    }
}
