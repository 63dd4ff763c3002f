//! What a pixel's fragments come to: composited sample by sample in double precision, with
//! nothing in common with the designs.

use crate::study::stress::case::Case;
use screendoor_trace::trace::Fragment;

/// The truth about a pixel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Truth {
    /// Its linear colour.
    pub colour: [f64; 3],
    /// What its contributions come to without their signs, the largest channel: what
    /// rounding is in proportion to. Not below the case's own least.
    pub scale: f64,
    /// At which place from the front its contributions come in the mean: how often what is
    /// in front has been multiplied by.
    pub place: f64,
    /// The largest channel of any contribution before it is weighed.
    pub range: f64,
}

/// A sum that keeps what rounding takes (Neumaier's).
#[derive(Clone, Copy, Default)]
struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        self.lost += if self.sum.abs() >= value.abs() {
            (self.sum - sum) + value
        } else {
            (value - sum) + self.sum
        };
        self.sum = sum;
    }

    fn value(self) -> f64 {
        self.sum + self.lost
    }
}

/// The truth about the pixels of a kind, whose samples lie at `positions`.
///
/// Fragments at equal depths: the later one lies before the earlier (less-or-equal). A
/// transmittance below the smallest double-precision number is taken for 0: nothing finite
/// behind it could be told from nothing.
pub(super) fn truth(case: &Case, kind: &[Fragment], positions: &[[i8; 2]]) -> Truth {
    let (mut colour, mut scale) = ([Sum::default(); 3], [Sum::default(); 3]);
    let mut places = [Sum::default(); 3];
    let share = 1.0 / positions.len() as f64;
    for (sample, position) in positions.iter().enumerate() {
        let covering = kind.iter().filter(|f| f.coverage.contains(sample));
        let mut order: Vec<_> = covering.map(|f| (f.depth.at(*position), f)).collect();
        // From the nearest on, and of equals from the last on.
        order.reverse();
        order.sort_by_key(|(depth, _)| *depth);
        let mut through = share;
        let mut add = |place: usize, weight: f64, of: &[f32; 3]| {
            for c in 0..3 {
                let contribution = weight * f64::from(of[c]);
                colour[c].add(contribution);
                scale[c].add(contribution.abs());
                places[c].add(contribution.abs() * place as f64);
            }
        };
        let behind_all = order.len();
        for (place, (_, f)) in order.into_iter().enumerate() {
            let alpha = f64::from(f.alpha);
            add(place, through * alpha, &f.colour);
            through *= 1.0 - alpha;
        }
        add(behind_all, through, &case.background);
    }
    let scale = scale.map(Sum::value).into_iter().fold(case.floor, f64::max);
    let contributions = kind.iter().map(|f| f.colour).chain([case.background]);
    Truth {
        colour: colour.map(Sum::value),
        scale,
        place: places.map(Sum::value).into_iter().fold(0.0, f64::max) / scale,
        range: contributions.flatten().fold(0.0, |most, c| f64::from(c.abs()).max(most)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::stress::case::{Group, at_depth, layer, over};

    #[test]
    fn over_and_ties_and_samples_by_hand() {
        let positions = [[-4, 0], [4, 0]];
        let case = Case { background: [1.0, 0.0, 0.0], ..Case::new(Group::Depth, "", "") };
        let (red, green) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        // Both at one depth: the later one is in front. The first covers sample 0 alone.
        let kind = [over(1, at_depth(7, layer(0, red, 0.5))), at_depth(7, layer(1, green, 0.25))];
        let found = truth(&case, &kind, &positions);
        let expected = [(0.375 + 0.75) / 2.0, 0.375 / 2.0, 0.25];
        // The background lies third at one sample and second at the other.
        let place = 0.75 / expected[0];
        assert_eq!(found, Truth { colour: expected, scale: expected[0], place, range: 1.0 });
        // Negative colours cancel, and their scale does not.
        let kind = [layer(0, [-1.0, 0.0, 0.0], 0.5)];
        let found = truth(&case, &kind, &positions);
        assert_eq!((found.colour[0], found.scale), (0.0, 1.0));
    }

    #[test]
    fn a_sum_keeps_what_is_small() {
        let mut sum = Sum::default();
        [1e100, 1.0, -1e100].into_iter().for_each(|v| sum.add(v));
        assert_eq!(sum.value(), 1.0);
    }
}
