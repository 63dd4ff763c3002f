//! How two rasterisers differ.

use serde::Serialize;

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
}
