//! Long series as few points: the smallest and the largest value of every column of pixels.

/// At most two points for each of `columns` equal parts of the range of x; extremes are kept. `points` rise in x.
pub(crate) fn thinned(points: impl Iterator<Item = (f64, f64)>, range: [f64; 2], columns: usize) -> Vec<(f64, f64)> {
    let [from, to] = range;
    let column = |x: f64| ((x - from) / (to - from) * columns as f64) as usize;
    let mut thin: Vec<(f64, f64)> = Vec::new();
    let mut group: Option<Group> = None;
    for point in points.filter(|(x, y)| (from..=to).contains(x) && y.is_finite()) {
        let at = column(point.0);
        match &mut group {
            Some(group) if group.column == at => group.add(point),
            _ => {
                thin.extend(group.iter().flat_map(Group::extremes));
                group = Some(Group { column: at, low: point, high: point });
            }
        }
    }
    thin.extend(group.iter().flat_map(Group::extremes));
    thin
}

struct Group {
    column: usize,
    low: (f64, f64),
    high: (f64, f64),
}

impl Group {
    fn add(&mut self, point: (f64, f64)) {
        if point.1 < self.low.1 {
            self.low = point;
        }
        if point.1 > self.high.1 {
            self.high = point;
        }
    }

    /// In the order of x; one point if they are the same.
    fn extremes(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        let (first, second) = if self.low.0 <= self.high.0 { (self.low, self.high) } else { (self.high, self.low) };
        [Some(first), (first != second).then_some(second)].into_iter().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_survives_and_the_number_of_points_is_bounded() {
        let spiky = |i: u32| (f64::from(i), if i == 7777 { 50.0 } else { f64::from(i % 10) });
        let thin = thinned((0..10_000).map(spiky), [0.0, 10_000.0], 100);
        assert!(thin.contains(&(7777.0, 50.0)) && (100..=202).contains(&thin.len()), "{}", thin.len());
        assert!(thin.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(thin.iter().map(|point| point.1).fold(f64::MAX, f64::min), 0.0);
    }

    #[test]
    fn few_points_stay_and_what_is_outside_or_not_finite_does_not() {
        let points = [(-1.0, 0.0), (0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (9.0, 0.0)];
        assert_eq!(thinned(points.into_iter(), [0.0, 3.0], 600), [(0.0, 1.0), (2.0, 3.0)]);
    }
}
