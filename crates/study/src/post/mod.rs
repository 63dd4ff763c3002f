//! Filters of finished pictures against the noise that is left in them.
//!
//! Enderton et al. 2011, section 6: a bilateral filter keeps edges, but those of a noisy picture are
//! noisy; one that is guided by what is known without noise, the total alpha, keeps the edges
//! of all visible layers, and blurs what these show within.

mod guides;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

pub use guides::{Guide, Guides};

use screendoor_scene::capture::Model;
use screendoor_trace::error::Result;
use screendoor_trace::param::Typed;
use screendoor_trace::picture::Picture;

const SIGMA: Typed<f64> =
    Typed::real("sigma", "1.5", (0.1, 16.0), "standard deviation of the Gaussian, in pixels");
const OF_COLOUR: Typed<f64> = Typed::real(
    "range",
    "0.1",
    (0.001, 100.0),
    "deviation of colours, root mean square over the channels, that counts little",
);
const OF_ALPHA: Typed<f64> =
    Typed::real("range", "0.05", (0.001, 1.0), "deviation of total alpha that counts little");
const OF_DEPTH: Typed<f64> = Typed::real(
    "range",
    "0.05",
    (0.001, 1.0),
    "deviation of mean depth that counts little, as a share of its range in the frame",
);

/// The filters that there are.
pub const POST_FILTERS: [Model; 4] = [
    Model { name: "gaussian", help: "a Gaussian over the picture", params: &[SIGMA.param] },
    Model {
        name: "bilateral",
        help: "the same where colours are alike",
        params: &[SIGMA.param, OF_COLOUR.param],
    },
    Model {
        name: "alpha",
        help: "the same where total alpha is alike (Enderton et al. 2011, section 6)",
        params: &[SIGMA.param, OF_ALPHA.param],
    },
    Model {
        name: "depth",
        help: "the same where total alpha and mean depth are alike",
        params: &[SIGMA.param, OF_DEPTH.param],
    },
];

/// What tells a pixel's likes.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Gaussian,
    /// Deviations of what guides it.
    Bilateral(f64),
    Alpha(f64),
    Depth(f64),
}

/// A filter of pictures.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PostFilter {
    kind: Kind,
    sigma: f64,
}

/// Standard deviations beyond which the Gaussian is cut off.
const REACH: f64 = 3.0;

impl PostFilter {
    /// Reads `NAME` or `NAME:parameter=value,…`.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Config`] for an unknown filter or parameter, naming the nearest.
    pub fn parse(spec: &str) -> Result<Self> {
        let (place, values) = Model::read("filter", &POST_FILTERS, spec)?;
        let kind = match place {
            0 => Kind::Gaussian,
            1 => Kind::Bilateral(values.get(OF_COLOUR)),
            2 => Kind::Alpha(values.get(OF_ALPHA)),
            _ => Kind::Depth(values.get(OF_DEPTH)),
        };
        Ok(PostFilter { kind, sigma: values.get(SIGMA) })
    }

    /// The filtered picture. Pixels in which nothing lets light through stay as they are; of the
    /// others each becomes the mean of those within three standard deviations, by their distance and
    /// by how much they are alike. What lies outside the frame has no weight.
    ///
    /// # Panics
    /// Where the guides are of another frame.
    pub fn apply(&self, picture: &Picture, guides: &Guides) -> Picture {
        assert_eq!(picture.grid(), guides.grid(), "guides of the picture's frame");
        let [width, height] = [picture.width(), picture.height()];
        let reach = libm::ceil(REACH * self.sigma) as i64;
        let pixels: Vec<Pixel> = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| Pixel { colour: picture.get(x, y), guide: guides.get(x, y) })
            .collect();
        let gauss = |square: f64| libm::exp(-square / (2.0 * self.sigma * self.sigma));
        let taps: Vec<(i64, i64, f64)> = (-reach..=reach)
            .flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)))
            .map(|(dx, dy)| (dx, dy, gauss((dx * dx + dy * dy) as f64)))
            .collect();
        let at = |x: i64, y: i64| {
            let inside = (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
            inside.then(|| &pixels[(y * i64::from(width) + x) as usize])
        };
        let filtered = |place: usize, own: &Pixel| {
            if !own.guide.noisy {
                return own.colour;
            }
            let (x, y) = ((place as u32 % width) as i64, (place as u32 / width) as i64);
            let (mut sum, mut weights) = ([0.0; 3], 0.0);
            for (dx, dy, near) in &taps {
                let Some(other) = at(x + dx, y + dy) else { continue };
                let weight = near * self.alike(own, other);
                weights += weight;
                sum.iter_mut().zip(other.colour).for_each(|(s, c)| *s += weight * c);
            }
            // A pixel is like itself.
            sum.map(|s| s / weights)
        };
        let done: Vec<[f64; 3]> =
            pixels.par_iter().enumerate().map(|(place, own)| filtered(place, own)).collect();
        Picture::from_fn(picture.grid(), |x, y| done[(y * width + x) as usize])
            .in_space(picture.space())
    }

    /// How much two pixels are alike, 0 to 1.
    fn alike(&self, a: &Pixel, b: &Pixel) -> f64 {
        let gauss = |square: f64, range: f64| libm::exp(-square / (2.0 * range * range));
        let alpha = |range| gauss((a.guide.alpha - b.guide.alpha).powi(2), range);
        match self.kind {
            Kind::Gaussian => 1.0,
            Kind::Bilateral(range) => {
                let squares = a.colour.iter().zip(&b.colour).map(|(a, b)| (a - b) * (a - b));
                gauss(squares.sum::<f64>() / 3.0, range)
            }
            Kind::Alpha(range) => alpha(range),
            Kind::Depth(range) => {
                alpha(range) * gauss((a.guide.depth - b.guide.depth).powi(2), range)
            }
        }
    }
}

/// What is known of a pixel.
struct Pixel {
    colour: [f64; 3],
    guide: Guide,
}
