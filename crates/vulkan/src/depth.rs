//! Depth: the program's own tests, sample by sample, and planes as a trace has them.

use ash::vk;
use screendoor_trace::trace::{DepthPlane, Unorm32};
use screendoor_vulkan_layer::log::{Record, State};

use crate::format::stored_depth;
use crate::samples::{Area, Samples};

screendoor_trace::options! {
    /// What the depths of a trace are.
    #[derive(Default)]
    pub enum DepthRule {
        #[default]
        Auto = "auto": "'order' where nothing that is drawn tests depth, else 'program'",
        Program = "program": "the program's own",
        Order = "order": "the order of drawing, of what passes the program's own tests",
    }
}

/// Whether an operation lets pass what is further away than what is there.
pub(crate) fn is_reversed(op: i32) -> Option<bool> {
    match vk::CompareOp::from_raw(op) {
        vk::CompareOp::LESS | vk::CompareOp::LESS_OR_EQUAL => Some(false),
        vk::CompareOp::GREATER | vk::CompareOp::GREATER_OR_EQUAL => Some(true),
        _ => None,
    }
}

/// The depth of a record at an offset from its pixel's centre in 1/16 pixel.
fn at(record: &Record, [x, y]: [i8; 2]) -> f32 {
    let share = |v: i8| f32::from(v) / 16.0;
    record.z + record.dzdx * share(x) + record.dzdy * share(y)
}

/// What a depth image holds.
pub(crate) struct DepthImage {
    format: i32,
    positions: Vec<[i8; 2]>,
    held: Samples<f32>,
    /// Whether what it holds can be equal to what is drawn: since it was cleared all that was drawn
    /// into it is known, or has been found out.
    pub(crate) is_known: bool,
}

impl DepthImage {
    pub(crate) fn new(size: [u32; 2], format: i32, positions: &[[i8; 2]], cleared: f32) -> Self {
        let held = Samples::new(size, positions.len(), Box::new(move |_, _| cleared));
        DepthImage { format, positions: positions.to_vec(), held, is_known: false }
    }

    /// Clears an area.
    pub(crate) fn clear(&mut self, area: Area, value: f32) {
        self.held.clear(area, stored_depth(self.format, value));
    }

    /// Of the samples of `coverage` those that pass the test of `state`; their depths are written
    /// where it writes any. What lies beside the image passes none.
    pub(crate) fn test(&mut self, record: &Record, coverage: u64, state: &State) -> u64 {
        if !state.depth_test {
            return coverage;
        }
        let mut passed = 0;
        self.each_sample(record, coverage, |s, held, depth| {
            let passes = match vk::CompareOp::from_raw(state.depth_op) {
                vk::CompareOp::NEVER => false,
                vk::CompareOp::LESS => depth < *held,
                vk::CompareOp::EQUAL => depth == *held,
                vk::CompareOp::LESS_OR_EQUAL => depth <= *held,
                vk::CompareOp::GREATER => depth > *held,
                vk::CompareOp::NOT_EQUAL => depth != *held,
                vk::CompareOp::GREATER_OR_EQUAL => depth >= *held,
                _ => true,
            };
            if passes {
                passed |= 1 << s;
                if state.depth_write {
                    *held = depth;
                }
            }
        });
        passed
    }

    /// Brings samples nearer that a record covers, where it is nearer than what they hold.
    pub(crate) fn bring_nearer(&mut self, record: &Record, coverage: u64, reversed: bool) {
        self.each_sample(record, coverage, |_, held, depth| {
            *held = if reversed { held.max(depth) } else { held.min(depth) };
        });
    }

    /// Calls `each` with the samples of `coverage`: number, what it holds, the record's depth.
    fn each_sample(
        &mut self,
        record: &Record,
        coverage: u64,
        mut each: impl FnMut(usize, &mut f32, f32),
    ) {
        let DepthImage { format, positions, held, .. } = self;
        let [width, height] = held.size();
        if record.x() >= width || record.y() >= height {
            return;
        }
        let held = held.at(record.x() as u16, record.y() as u16);
        for (s, (held, position)) in held.iter_mut().zip(positions).enumerate() {
            if coverage >> s & 1 == 1 {
                each(s, held, stored_depth(*format, at(record, *position)));
            }
        }
    }
}

/// The depth plane of a record as a trace has it, and whether its slopes were too steep, or it
/// leaves the range at the centre, so that it is flat.
pub(crate) fn plane(record: &Record, reversed: bool) -> (DepthPlane, bool) {
    let [z, dx, dy] = [record.z, record.dzdx, record.dzdy].map(f64::from);
    let [z, dx, dy] = if reversed { [1.0 - z, -dx, -dy] } else { [z, dx, dy] };
    let whole = |v: f64| (v * f64::from(u32::MAX)).round();
    let fits = |slope: f64| whole(slope).abs() <= f64::from(i32::MAX);
    let inside = (0.0..=1.0).contains(&z) && fits(dx) && fits(dy);
    let is_flat = !inside && (dx, dy) != (0.0, 0.0) || z.is_nan();
    let [dx, dy] = if inside { [dx, dy].map(|v| whole(v) as i32) } else { [0, 0] };
    // What is no number becomes 0.
    let z = Unorm32(whole(z.clamp(0.0, 1.0)) as u32);
    (DepthPlane { z, dzdx: dx, dzdy: dy }, is_flat)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(z: f32, slopes: [f32; 2]) -> Record {
        Record { z, dzdx: slopes[0], dzdy: slopes[1], ..Record::default() }
    }

    fn test(op: vk::CompareOp, write: bool) -> State {
        State { depth_test: true, depth_write: write, depth_op: op.as_raw(), ..State::default() }
    }

    #[test]
    fn planes_are_integers_and_reversed_ranges_are_flipped() {
        let (p, flat) = plane(&record(0.25, [0.25, -0.25]), false);
        assert_eq!((p.z.0, p.dzdx, p.dzdy, flat), (0x4000_0000, 1 << 30, -(1 << 30), false));
        let (p, flat) = plane(&record(0.25, [0.25, -0.25]), true);
        assert_eq!((p.z.0, p.dzdx, p.dzdy, flat), (0xbfff_ffff, -(1 << 30), 1 << 30, false));
        for (z, slopes) in [(0.5, [0.6, 0.0]), (1.5, [0.1, 0.0]), (f32::NAN, [0.0; 2])] {
            let (p, flat) = plane(&record(z, slopes), false);
            assert!(flat && p.dzdx == 0 && p.dzdy == 0, "{z}");
        }
        // As a depth image clamps it.
        let (p, flat) = plane(&record(1.5, [0.0; 2]), false);
        assert_eq!((p.z, flat), (Unorm32::FAR, false));
    }

    #[test]
    fn samples_are_tested_where_they_lie() {
        let positions = [[-4, -4], [4, 4]];
        let mut image = DepthImage::new([64, 64], vk::Format::D32_SFLOAT.as_raw(), &positions, 1.0);
        let less = test(vk::CompareOp::LESS, true);
        assert_eq!(image.test(&record(0.5, [0.0; 2]), 3, &less), 3);
        // 0.45 on the left, 0.55 on the right.
        assert_eq!(image.test(&record(0.5, [0.2, 0.0]), 3, &less), 1);
        assert_eq!(image.test(&record(0.47, [0.0; 2]), 3, &less), 2);
        let peek = test(vk::CompareOp::LESS, false);
        assert_eq!(image.test(&record(0.46, [0.0; 2]), 3, &peek), 2);
        assert_eq!(image.test(&record(0.46, [0.0; 2]), 3, &peek), 2, "nothing was written");
        let greater = test(vk::CompareOp::GREATER, true);
        assert_eq!(image.test(&record(0.9, [0.0; 2]), 1, &greater), 1);
        assert_eq!(image.test(&record(0.9, [0.0; 2]), 1, &State::default()), 1);
        assert_eq!(image.test(&record(0.9, [0.0; 2]), 3, &test(vk::CompareOp::NEVER, true)), 0);
        let equal = test(vk::CompareOp::EQUAL, false);
        assert_eq!(image.test(&record(0.9, [0.0; 2]), 3, &equal), 1);
        image.bring_nearer(&record(0.8, [0.0; 2]), 3, false);
        assert_eq!(image.test(&record(0.8, [0.0; 2]), 3, &equal), 1);
        image.bring_nearer(&record(0.85, [0.0; 2]), 3, true);
        assert_eq!(image.test(&record(0.85, [0.0; 2]), 3, &equal), 3);
    }
}
