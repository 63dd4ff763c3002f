//! How much pixels flicker where every frame has a seed of its own.

use serde::{Deserialize, Serialize};

/// The standard deviation over seeds of a pixel's own value (root mean square over
/// its channels), in 8-bit units, as it is distributed over a region's pixels: what a
/// viewer of a still scene sees change from frame to frame.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Temporal {
    /// Half of the pixels have no more.
    pub deviation_median: f64,
    /// 95 % of the pixels have no more.
    pub deviation_p95: f64,
    /// The most of any pixel.
    pub deviation_max: f64,
}

/// Gathers pixels' deviations: four bytes each, in single precision.
#[derive(Default)]
pub(super) struct Deviations {
    single: Vec<f32>,
    /// The deviation that many pixels share, and how many: those that no run touched.
    shared: (f32, u64),
}

impl Deviations {
    /// Adds `pixels` of one deviation. More than one can be added once.
    pub(super) fn add(&mut self, deviation: f64, pixels: u64) {
        if pixels == 1 {
            self.single.push(deviation as f32);
        } else {
            self.shared = (deviation as f32, pixels);
        }
    }

    /// The distribution; `None` without pixels.
    pub(super) fn finish(mut self) -> Option<Temporal> {
        self.single.sort_unstable_by(f32::total_cmp);
        let (shared, times) = self.shared;
        let pixels = self.single.len() as u64 + times;
        let below = self.single.partition_point(|v| *v < shared) as u64;
        // The value at a place in the order of all.
        let at = |place: u64| {
            let single = |i: u64| self.single.get(i as usize).copied();
            match place {
                _ if place < below => single(place),
                _ if place < below + times => Some(shared),
                _ => single(place - times),
            }
        };
        // The least that so many hundredths of the pixels do not exceed.
        let share = |hundredths: u64| {
            let place = (pixels * hundredths).div_ceil(100).checked_sub(1)?;
            at(place).map(f64::from)
        };
        Some(Temporal {
            deviation_median: share(50)?,
            deviation_p95: share(95)?,
            deviation_max: share(100)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_all_pixels() {
        let of = |single: std::ops::Range<u32>, shared: f64, times| {
            let mut all = Deviations::default();
            single.rev().for_each(|v| all.add(f64::from(v), 1));
            if times > 0 {
                all.add(shared, times);
            }
            all.finish().map(|t| [t.deviation_median, t.deviation_p95, t.deviation_max])
        };
        assert_eq!(of(0..0, 0.0, 0), None);
        assert_eq!(of(7..8, 0.0, 0), Some([7.0; 3]));
        assert_eq!(of(0..0, 3.0, 9), Some([3.0; 3]));
        assert_eq!(of(1..101, 0.0, 0), Some([50.0, 95.0, 100.0]));
        assert_eq!(of(1..101, 0.0, 100), Some([0.0, 90.0, 100.0]));
        assert_eq!(of(1..101, 60.5, 100), Some([60.5, 90.0, 100.0]));
        assert_eq!(of(1..101, 200.0, 900), Some([200.0; 3]));
    }
}
