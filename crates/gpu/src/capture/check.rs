//! Our rasteriser held against an adapter's, sample by sample.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::capture::fragments::RawFragment;
use screendoor_scene::capture::SetUp;
use screendoor_trace::trace::{DepthPlane, SampleMask};

/// Why a sample is covered for one rasteriser and not for the other, as far as its place
/// tells. Corners are snapped to a grid of 1/256 pixel; where ours and the adapter's lie a
/// step apart, along both axes at most, edges move by √2 steps at most.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct Difference {
    /// It lies on an edge of the triangle, as we have it: the rule for edges that triangles
    /// share decides, and a corner that is snapped elsewhere changes what it decides on.
    pub on_an_edge: u64,
    /// It lies within √2 steps of an edge: a corner was snapped to another step.
    pub beside_an_edge: u64,
    /// It lies within 8 steps of an edge of a triangle that clipping has cut: its new
    /// corners are computed, and single precision moves them further where they lie close
    /// to the camera.
    pub clipped: u64,
    /// The triangle has no area on our grid, or shows its back there.
    pub no_area: u64,
    /// None of these: a difference that nothing explains.
    pub unexplained: u64,
}

impl Difference {
    /// All of them.
    pub fn all(&self) -> u64 {
        self.on_an_edge + self.beside_an_edge + self.clipped + self.no_area + self.unexplained
    }
}

/// What came of holding our rasteriser against an adapter's.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct CrossCheck {
    /// Triangles drawn.
    pub triangles: u64,
    /// Fragments that both have.
    pub both: u64,
    /// Fragments that only our rasteriser has.
    pub only_ours: u64,
    /// Fragments that only the adapter has.
    pub only_adapter: u64,
    /// Samples that are covered for either, summed over all triangles.
    pub samples: u64,
    /// Samples that are covered for one and not for the other.
    pub differing: Difference,
    /// How far the furthest of them lies from an edge, in steps of 1/256 pixel.
    pub furthest: f64,
    /// The largest difference of depth at the centre of a pixel that both cover wholly, as a
    /// share of the depth range.
    pub depth: f64,
}

/// How far an edge moves where its corners move by a step along both axes: √2.
const REACH: f64 = std::f64::consts::SQRT_2;
/// The same where clipping has made corners.
const CLIPPED_REACH: f64 = 8.0;

impl CrossCheck {
    /// It in words and numbers, for a table.
    pub fn rows(&self) -> [(&'static str, String); 13] {
        let differing = &self.differing;
        let counts = [
            ("triangles", self.triangles),
            ("fragments of both", self.both),
            ("fragments of ours alone", self.only_ours),
            ("fragments of the GPU's alone", self.only_adapter),
            ("samples covered for either", self.samples),
            ("samples that differ", differing.all()),
            ("  on an edge", differing.on_an_edge),
            ("  beside an edge", differing.beside_an_edge),
            ("  of clipped triangles", differing.clipped),
            ("  of triangles without area on our grid", differing.no_area),
            ("  unexplained", differing.unexplained),
        ];
        std::array::from_fn(|i| match counts.get(i) {
            Some((what, count)) => (*what, count.to_string()),
            None if i == counts.len() => {
                ("furthest from an edge, in 1/256 pixel", format!("{:.2}", self.furthest))
            }
            None => ("largest difference of depth, of its range", format!("{:.1e}", self.depth)),
        })
    }

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
