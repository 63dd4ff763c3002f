//! Our rasteriser held against an adapter's, sample by sample.

use std::collections::BTreeMap;

use crate::capture::fragments::RawFragment;
use crate::differences::{CrossCheck, Difference};
use screendoor_scene::capture::SetUp;
use screendoor_trace::trace::{DepthPlane, SampleMask};

/// How far an edge moves where its corners move by a step along both axes: √2.
const REACH: f64 = std::f64::consts::SQRT_2;
/// The same where clipping has made corners.
const CLIPPED_REACH: f64 = 8.0;

impl CrossCheck {
    /// Compares a triangle on our grid with what the adapter leaves of it.
    pub(super) fn of(ours: &SetUp<'_>, theirs: &[RawFragment]) -> Self {
        let mut check = CrossCheck { triangles: 1, ..CrossCheck::default() };
        // Row by row; what several pieces leave in a pixel is put together.
        let mut pixels: BTreeMap<u32, (SampleMask, DepthPlane, Option<&RawFragment>)> =
            BTreeMap::new();
        ours.draw(|[x, y], coverage, depth| {
            let pixel = u32::from(x) | u32::from(y) << 16;
            pixels.entry(pixel).or_insert((SampleMask::NONE, depth, None)).0 |= coverage;
        });
        for raw in theirs {
            let none = (SampleMask::NONE, raw.depth(), None);
            pixels.entry(raw.pixel).or_insert(none).2 = Some(raw);
        }
        for (pixel, (our_mask, depth, raw)) in pixels {
            let their_mask = SampleMask(raw.map_or(0, |raw| raw.coverage.into()));
            match (our_mask.is_empty(), their_mask.is_empty()) {
                (false, false) => check.both += 1,
                (false, true) => check.only_ours += 1,
                _ => check.only_adapter += 1,
            }
            check.samples += u64::from((our_mask | their_mask).count());
            let [x, y] = [pixel as u16, (pixel >> 16) as u16];
            for sample in SampleMask(our_mask.0 ^ their_mask.0).iter() {
                let distance = ours.distance([x, y], sample);
                if !ours.is_empty() {
                    check.furthest = check.furthest.max(distance);
                }
                let differing = &mut check.differing;
                *match distance {
                    _ if ours.is_empty() => &mut differing.no_area,
                    0.0 => &mut differing.on_an_edge,
                    d if d <= REACH => &mut differing.beside_an_edge,
                    d if d <= CLIPPED_REACH && ours.is_clipped() => &mut differing.clipped,
                    _ => &mut differing.unexplained,
                } += 1;
            }
            let whole = SampleMask::first(super::rasteriser::SAMPLES);
            if let Some(raw) = raw.filter(|_| our_mask == whole && their_mask == whole) {
                let range = f64::from(u32::MAX);
                let apart = f64::from(raw.z) - f64::from(depth.z.0) / range;
                check.depth = check.depth.max(apart.abs());
            }
        }
        check
    }

    /// Both together.
    pub(super) fn and(self, other: Self) -> Self {
        let (a, b) = (self.differing, other.differing);
        CrossCheck {
            triangles: self.triangles + other.triangles,
            both: self.both + other.both,
            only_ours: self.only_ours + other.only_ours,
            only_adapter: self.only_adapter + other.only_adapter,
            samples: self.samples + other.samples,
            differing: Difference {
                on_an_edge: a.on_an_edge + b.on_an_edge,
                beside_an_edge: a.beside_an_edge + b.beside_an_edge,
                clipped: a.clipped + b.clipped,
                no_area: a.no_area + b.no_area,
                unexplained: a.unexplained + b.unexplained,
            },
            furthest: self.furthest.max(other.furthest),
            depth: self.depth.max(other.depth),
        }
    }
}
