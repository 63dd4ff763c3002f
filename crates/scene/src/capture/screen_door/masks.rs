//! Random masks in a surface (section 4.2), and patterns in the frame.

use glam::DVec2;

use crate::capture::camera::Camera;
use crate::capture::geometry::Triangle;
use crate::capture::raster::{Raster, Weights};
use crate::capture::screen_door::{pixels_per_unit, random};
use crate::capture::setup::STEPS;
use screendoor_trace::random::hash;
use screendoor_trace::trace::Fragment;

/// Texels along a side of a mask.
const TEXELS: i64 = 128;
/// Alphas that have a mask of their own, but for 0.
const LEVELS: f32 = 255.0;
/// Texels along a side of a pixel that are looked at, at most.
const MOST_TEXELS: i64 = 64;

/// A random mask for each alpha.
pub(in crate::capture) struct Mask {
    pub seed: u32,
    /// Whether a pixel is opaque where any texel in it is.
    pub max: bool,
}

/// The masks on a triangle.
pub(super) struct Mapped<'a> {
    mask: &'a Mask,
    /// Texture coordinates in texels of the second and the third vertex; the first has 0.
    corners: [DVec2; 2],
}

impl Mask {
    /// The mapping of section 4.2.1: edges in pixels, as if they were parallel to the frame, at the
    /// distance of the triangle's middle.
    pub(super) fn on(&self, triangle: &Triangle, camera: &Camera) -> Mapped<'_> {
        let [a, b, c] = triangle.vertices.map(|v| v.position);
        let scale = pixels_per_unit(triangle, camera);
        let (u, v) = ((b - a) * scale, (c - a) * scale);
        let length = u.length();
        let along = if length > 0.0 { u.dot(v) / length } else { 0.0 };
        let across = (v.length_squared() - along * along).max(0.0).sqrt();
        Mapped { mask: self, corners: [DVec2::new(length, 0.0), DVec2::new(along, across)] }
    }

    fn texel(&self, level: u32, x: i64, y: i64) -> bool {
        let place = y.rem_euclid(TEXELS) * TEXELS + x.rem_euclid(TEXELS);
        random([self.seed, level, place as u32]) < f64::from(level) / f64::from(LEVELS)
    }
}

impl Mapped<'_> {
    /// Whether a fragment of the triangle is opaque.
    pub(super) fn is_opaque(&self, fragment: &Fragment, raster: &Raster<'_>) -> bool {
        let level = (fragment.alpha * LEVELS).round() as u32;
        let centre = [fragment.x, fragment.y].map(|c| i64::from(c) * STEPS + STEPS / 2);
        let Weights { at, dx, dy } = raster.weights(centre);
        let turned = |w: &[f64; 3]| self.corners[0] * w[1] + self.corners[1] * w[2];
        let (here, right, down) = (turned(&at), turned(&dx), turned(&dy));
        let (x, y) = (here.x.floor() as i64, here.y.floor() as i64);
        if self.mask.texel(level, x, y) {
            return true;
        }
        let area = right.perp_dot(down);
        if !self.mask.max || area == 0.0 || !area.is_finite() {
            return false;
        }
        // Texels whose middles lie within the pixel, as the surface has it.
        let reach = (right.abs() + down.abs()) * 0.5;
        let around = |reach: f64| (reach.ceil() as i64).min(MOST_TEXELS / 2);
        let (columns, rows) = (around(reach.x), around(reach.y));
        (-rows..=rows).any(|dy| {
            (-columns..=columns).any(|dx| {
                let middle = DVec2::new((x + dx) as f64 + 0.5, (y + dy) as f64 + 0.5) - here;
                let [s, t] = [middle.perp_dot(down) / area, right.perp_dot(middle) / area];
                let within = |share: f64| (-0.5..0.5).contains(&share);
                within(s) && within(t) && self.mask.texel(level, x + dx, y + dy)
            })
        })
    }
}

/// Pixels along a side of a pattern.
const PATTERN: usize = 32;

/// Patterns in the frame, of which each polygon has one.
pub(in crate::capture) struct Stipple {
    seed: u32,
    /// Of each pattern the place of every pixel in the order in which alphas fill it.
    patterns: Vec<[u16; PATTERN * PATTERN]>,
}

impl Stipple {
    pub(super) fn new(seed: u32, patterns: u32) -> Self {
        let pattern = |number: u32| {
            let mut order: Vec<u16> = (0..(PATTERN * PATTERN) as u16).collect();
            order.sort_by_key(|place| hash([seed, number, u32::from(*place)]));
            let mut ranks = [0; PATTERN * PATTERN];
            for (rank, place) in order.into_iter().enumerate() {
                ranks[usize::from(place)] = rank as u16;
            }
            ranks
        };
        Stipple { seed, patterns: (0..patterns).map(pattern).collect() }
    }

    /// Whether a fragment is opaque.
    pub(super) fn is_opaque(&self, fragment: &Fragment) -> bool {
        let number = match self.patterns.len() {
            1 => 0,
            several => hash([self.seed, fragment.primitive]) as usize % several,
        };
        let place = |c: u16| usize::from(c) % PATTERN;
        let rank = self.patterns[number][place(fragment.y) * PATTERN + place(fragment.x)];
        let filled = (fragment.alpha * (PATTERN * PATTERN) as f32).round();
        f32::from(rank) < filled
    }
}
