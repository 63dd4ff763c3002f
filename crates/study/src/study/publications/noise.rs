//! The noise that LK's figures 1, 3 and 6 show, in numbers. No study: it is of details of
//! pictures, and of single rows of them.

use serde::Serialize;

use crate::metrics::{Estimate, PixelClasses, Region, UNIT, rmse};
use crate::study::measure::averaged;
use crate::study::publications::pictures;
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::Trace;

/// Sides of the square blocks of [`Noise::rmse`].
pub const BLOCKS: [u32; 4] = [1, 2, 4, 8];

/// Seeds of figure 3: what is common to a frame needs many frames, which are small.
pub const CORRELATION_SEEDS: u32 = 32;

/// The noise of the figures that LK print as pictures.
#[derive(Clone, Debug, Serialize)]
pub struct FigureNoise {
    /// Figure 1, left of each pair: the ramps, `enderton` and `lk`.
    pub dithering: Vec<Noise>,
    /// Its lower part, drawn as five quads: the same designs where the quads meet.
    pub edges: Vec<EdgeNoise>,
    /// Figure 1, right of each pair: a detail of the cloth, the same designs.
    pub cloth: Vec<Noise>,
    /// Figure 3: eight layers under several reference values.
    pub correlation: Vec<Noise>,
    /// Figure 6: a detail of the cloth without and with the sort.
    pub sorting: Vec<Noise>,
}

/// What is left of a design's error when pixels are averaged over square blocks: noise
/// that does not know of its neighbours halves as a block's side doubles, dithered noise
/// falls faster, and what pixels have in common stays.
#[derive(Clone, Debug, Serialize)]
pub struct Noise {
    /// The design.
    pub design: &'static str,
    /// Samples per pixel.
    pub samples: u32,
    /// RMSE over blocks of [`BLOCKS`] pixels a side.
    pub rmse: [Estimate; 4],
}

impl Noise {
    /// By how much the RMSE falls from single pixels to the largest blocks.
    pub fn fall(&self) -> Estimate {
        let [single, .., largest] = self.rmse;
        single.ratio(largest)
    }
}

/// A design's error where primitives of one even surface meet, and beside.
#[derive(Clone, Debug, Serialize)]
pub struct EdgeNoise {
    /// The design.
    pub design: &'static str,
    /// RMSE over the pixels that primitives share.
    pub edges: Estimate,
    /// RMSE over the pixels that one primitive has to itself.
    pub inside: Estimate,
}

/// The noise of `pictures`, one for each seed.
pub(super) fn noise(
    design: &'static str,
    samples: u32,
    pictures: &[Picture],
    exact: &Picture,
) -> Noise {
    let over_blocks = BLOCKS.map(|side| {
        let exact = averaged(exact, side);
        let frame = Region::frame(exact.grid());
        let square = |p: &Picture| rmse(&averaged(p, side), &exact, &frame).powi(2);
        Estimate::of(&pictures.iter().map(square).collect::<Vec<_>>()).sqrt()
    });
    Noise { design, samples, rmse: over_blocks }
}

/// The noise in the lower third of the ramps.
pub(super) fn edge_noise(
    design: &'static str,
    ramps: &Trace,
    samples: u32,
    exact: &Picture,
    seeds: u32,
) -> Result<EdgeNoise> {
    // The alpha of the quads, and so what a pixel shows that lies wholly within them.
    const ALPHA: f64 = 0.75;
    let classes = PixelClasses::of(ramps, samples)?;
    let (width, height) = (exact.width(), exact.height());
    let within: Vec<(u32, u32)> = (height * 2 / 3..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .filter(|(x, y)| (exact.get(*x, *y)[0] - ALPHA).abs() < 1e-6)
        .collect();
    let shared = |(x, y): &(u32, u32)| {
        let (x, y) = (*x as u16, *y as u16);
        classes.edges.holds(exact.grid().tile(x, y), TileGrid::within(x, y))
    };
    let (edges, inside): (Vec<_>, Vec<_>) = within.into_iter().partition(shared);
    let (mut at_edges, mut beside) = (Vec::new(), Vec::new());
    for picture in pictures(design, ramps, samples, seeds)? {
        let picture = picture?;
        let mean_square = |pixels: &[(u32, u32)]| {
            let square = |(x, y): &(u32, u32)| (picture.get(*x, *y)[0] - ALPHA).powi(2);
            pixels.iter().map(square).sum::<f64>() / pixels.len().max(1) as f64 / (UNIT * UNIT)
        };
        at_edges.push(mean_square(&edges));
        beside.push(mean_square(&inside));
    }
    let root = |squares: &[f64]| Estimate::of(squares).sqrt();
    Ok(EdgeNoise { design, edges: root(&at_edges), inside: root(&beside) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_average_out_and_a_common_error_does_not() {
        let grid = TileGrid::new(32, 32);
        let exact = Picture::new(grid, [0.5; 3]);
        let checks = |by: f64| {
            Picture::from_fn(grid, move |x, y| {
                [0.5 + if (x + y) % 2 == 0 { 0.1 + by } else { by - 0.1 }; 3]
            })
        };
        let [single, others @ ..] = noise("lk", 4, &[checks(0.0), checks(0.0)], &exact).rmse;
        assert!((single.value - 25.5).abs() < 1e-9 && single.half_width() < 1e-9, "{single:?}");
        assert!(others.iter().all(|e| e.value < 1e-9), "{others:?}");
        let shifted = noise("lk", 4, &[checks(0.2)], &exact);
        assert!(shifted.rmse[1..].iter().all(|e| (e.value - 51.0).abs() < 1e-9), "{shifted:?}");
        assert!((shifted.fall().value - (25.5_f64.hypot(51.0) / 51.0)).abs() < 1e-9);
    }
}
