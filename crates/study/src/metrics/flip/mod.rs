//! FLIP: how different two pictures look to a viewer who flips between them.
//!
//! The low dynamic range metric is that of Andersson, Nilsson, Akenine-Möller,
//! Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating
//! Images" (HPG 2020); the high dynamic range one that of Andersson, Nilsson,
//! Shirley and Akenine-Möller, "Visualizing and Communicating Errors in Rendered
//! Images" (Ray Tracing Gems II, 2021, chapter 19). Section numbers below are those
//! of the first. Computed in single precision, as the published evaluator does; the
//! two differ by rounding.

mod colour;
mod exposure;
mod features;
mod filter;
mod map;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::sync::OnceLock;

pub use map::{FlipFigures, FlipMap};

use colour::Contrast;
use exposure::Exposure;
use features::Features;
use filter::Size;
use screendoor_trace::picture::Picture;
use screendoor_trace::tile::TileGrid;

/// Pixels in a degree of the viewer's field: 0.7 m before a screen that is 0.7 m and
/// 3840 pixels wide, the default of both papers.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * (3840.0 / 0.7) * std::f64::consts::PI / 180.0;

/// Values of high dynamic range above this are taken for it.
pub const BRIGHTEST: f32 = 1e12;

/// What a reference's exposures may take of memory, in bytes; with more they are made
/// again for each picture.
const KEPT: usize = 1 << 28;

/// Three planes of a frame, row by row: red, green, blue or what they became.
type Planes = [Vec<f32>; 3];

/// A reference to which many pictures are compared. What it alone decides is worked
/// out once, when it is first needed.
///
/// Both metrics take linear RGB values with the primaries and the white of sRGB.
/// NaN and negative values count as 0; values above 1 count as 1 in
/// [`ldr`](Flip::ldr), those above [`BRIGHTEST`] as that in [`hdr`](Flip::hdr).
#[derive(Debug)]
pub struct Flip {
    grid: TileGrid,
    size: Size,
    contrast: Contrast,
    features: Features,
    /// Linear, in [0, `BRIGHTEST`].
    reference: Planes,
    exposures: Vec<Exposure>,
    ldr: OnceLock<Seen>,
    hdr: OnceLock<Vec<Seen>>,
}

/// A picture as the metric sees it.
#[derive(Clone, Debug)]
struct Seen {
    /// Hunt-adjusted CIELAB of what the eye resolves.
    lab: Planes,
    /// Strength of edges and of points, from 0.
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Flip {
    /// Prepares the comparison to `reference` at [`PIXELS_PER_DEGREE`].
    pub fn new(reference: &Picture) -> Self {
        let size = Size { width: reference.width() as usize, height: reference.height() as usize };
        let planes = planes(reference, BRIGHTEST);
        Flip {
            grid: reference.grid(),
            size,
            contrast: Contrast::new(PIXELS_PER_DEGREE),
            features: Features::new(PIXELS_PER_DEGREE),
            exposures: exposure::exposures(&planes),
            reference: planes,
            ldr: OnceLock::new(),
            hdr: OnceLock::new(),
        }
    }

    /// How many exposures [`hdr`](Flip::hdr) compares; its time is proportional to
    /// them. A reference of which more than half is black has some 25.
    pub fn exposures(&self) -> usize {
        self.exposures.len()
    }

    /// The map of LDR-FLIP: both pictures as a display shows them.
    ///
    /// # Panics
    /// Where its frame differs from the reference's.
    pub fn ldr(&self, picture: &Picture) -> FlipMap {
        assert_eq!(picture.grid(), self.grid);
        let reference = self.ldr.get_or_init(|| {
            self.see(self.reference.each_ref().map(|p| p.iter().map(|v| v.min(1.0)).collect()))
        });
        FlipMap::new(self.size, self.difference(reference, &self.see(planes(picture, 1.0))))
    }

    /// The map of HDR-FLIP: the largest of LDR-FLIP over the reference's exposures,
    /// each tone mapped by Narkowicz' fit to ACES.
    ///
    /// A black reference suggests no exposure and both pictures are taken as they
    /// are (the published evaluator refuses it).
    ///
    /// # Panics
    /// Where its frame differs from the reference's.
    pub fn hdr(&self, picture: &Picture) -> FlipMap {
        assert_eq!(picture.grid(), self.grid);
        let picture = planes(picture, BRIGHTEST);
        let seen_reference = |e: &Exposure| self.see(e.show(&self.reference));
        let bytes = self.size.pixels() * 5 * size_of::<f32>() * self.exposures.len();
        let kept = (bytes <= KEPT)
            .then(|| self.hdr.get_or_init(|| self.exposures.iter().map(seen_reference).collect()));
        let mut largest = vec![0.0_f32; self.size.pixels()];
        for (i, exposure) in self.exposures.iter().enumerate() {
            let reference = kept
                .and_then(|k| k.get(i))
                .map_or_else(|| Cow::Owned(seen_reference(exposure)), Cow::Borrowed);
            let map = self.difference(&reference, &self.see(exposure.show(&picture)));
            for (largest, value) in largest.iter_mut().zip(map) {
                *largest = largest.max(value);
            }
        }
        FlipMap::new(self.size, largest)
    }

    /// What is seen of linear RGB in [0, 1].
    fn see(&self, rgb: Planes) -> Seen {
        let opponent = colour::opponent(rgb);
        let (edge, point) = self.features.of(&opponent[0], self.size);
        Seen { lab: self.contrast.filtered_lab(opponent, self.size), edge, point }
    }

    /// The two pipelines joined (section 4.3): differences of features raise those of
    /// colour.
    fn difference(&self, a: &Seen, b: &Seen) -> Vec<f32> {
        let lab = |seen: &Seen, i: usize| [seen.lab[0][i], seen.lab[1][i], seen.lab[2][i]];
        let pixel = |i: usize| {
            let colour = self.contrast.difference(lab(a, i), lab(b, i));
            if colour == 0.0 {
                return 0.0;
            }
            let edge = (a.edge[i] - b.edge[i]).abs();
            let point = (a.point[i] - b.point[i]).abs();
            colour::power(colour, 1.0 - features::difference(edge, point))
        };
        (0..self.size.pixels()).map(pixel).collect()
    }
}

/// A picture's channels in [0, `most`]. `max` takes NaN for 0.
fn planes(picture: &Picture, most: f32) -> Planes {
    let pixels = picture.width() as usize * picture.height() as usize;
    let mut planes = [(); 3].map(|()| Vec::with_capacity(pixels));
    for y in 0..picture.height() {
        for x in 0..picture.width() {
            for (plane, value) in planes.iter_mut().zip(picture.get(x, y)) {
                let linear = picture.space().to_linear(value) as f32;
                plane.push(linear.max(0.0).min(most));
            }
        }
    }
    planes
}
