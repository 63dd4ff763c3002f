//! FLIP's error maps and what is told of them.

use serde::{Deserialize, Serialize};

use super::filter::Size;

/// FLIP's error of each pixel: 0 where no difference is seen, 1 at most.
#[derive(Clone, PartialEq, Debug)]
pub struct FlipMap {
    size: Size,
    values: Vec<f32>,
}

/// A map in a few numbers, all in [0, 1].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct FlipFigures {
    /// The mean over all pixels, the papers' single number.
    pub mean: f64,
    /// Weighted first quartile, median and third quartile: errors up to these make up
    /// 1/4, 1/2 and 3/4 of the sum of all (the paper's weighted histogram).
    pub quartiles: [f64; 3],
}

impl FlipMap {
    pub(super) fn new(size: Size, values: Vec<f32>) -> Self {
        FlipMap { size, values }
    }

    /// Width of the frame in pixels.
    pub fn width(&self) -> u32 {
        self.size.width as u32
    }

    /// Height of the frame in pixels.
    pub fn height(&self) -> u32 {
        self.size.height as u32
    }

    /// The errors, row by row from the top left.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The mean and the weighted quartiles; all 0 for an empty frame.
    pub fn figures(&self) -> FlipFigures {
        let mut sorted = self.values.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let sum: f64 = sorted.iter().map(|v| f64::from(*v)).sum();
        let mut quartiles = [0.0; 3];
        let (mut below, mut next) = (0.0, 0);
        for value in sorted.iter().map(|v| f64::from(*v)) {
            below += value;
            // One error can be more than a quarter of all.
            while next < 3 && below >= sum * 0.25 * (next + 1) as f64 {
                quartiles[next] = value;
                next += 1;
            }
        }
        FlipFigures { mean: sum / sorted.len().max(1) as f64, quartiles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_weigh_errors_by_themselves() {
        let map = |values: &[f32]| {
            let size = Size { width: values.len(), height: 1 };
            FlipMap::new(size, values.to_vec()).figures()
        };
        // Of a sum of 1 the first two make 3/8.
        let f = map(&[0.5, 0.125, 0.25, 0.125]);
        assert_eq!(f, FlipFigures { mean: 0.25, quartiles: [0.125, 0.25, 0.5] });
        assert_eq!(map(&[1.0, 0.0, 0.0]).quartiles, [1.0; 3]);
        assert_eq!(map(&[0.0; 4]), FlipFigures { mean: 0.0, quartiles: [0.0; 3] });
        assert_eq!(map(&[]), FlipFigures { mean: 0.0, quartiles: [0.0; 3] });
    }
}
