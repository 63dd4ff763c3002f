//! Splats on the frame: by elliptical weighted averages (Zwicker et al. 2001), as Kerbl et al.
//! (2023) draw them. In view space, x to the right, y down and z along the view axis, a splat
//! of the covariance Σ has on the frame the covariance `J Σ Jᵀ`, J the slope of the projection
//! at its mean; its alpha at a point is its opacity times `exp(-q/2)`, q the square of the
//! distance from its mean in that measure.

mod harmonics;
mod rules;

use glam::{DAffine3, DMat2, DMat3, DVec2, DVec3};

use self::rules::{Alphas, Depth, Distance, Factor};
pub use self::rules::{PARAMS, RULE_SETS, RuleSet, SplatRules};
use crate::capture::camera::Camera;
use crate::capture::lanes::LANES;
use crate::elementary::{self, LEAST_EXPONENT};
use crate::scene::Splats;
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

/// Scales below this share of a splat's greatest have no normal of their own.
const THINNEST: f64 = 1e-6;

/// What a capture draws splats with.
pub(crate) struct Painter<'a> {
    camera: &'a Camera,
    rules: &'a SplatRules,
    /// Which space the trace's colours are in.
    space: Space,
    /// Multiplied into opacities.
    alpha: f32,
}

/// A splat on the frame.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct OnFrame {
    /// Its mean, in pixels from the frame's top left.
    pub centre: DVec2,
    /// Its covariance there, in pixels squared, dilated: xx, xy and yy.
    pub covariance: [f64; 3],
    /// The covariance's inverse.
    conic: [f64; 3],
    /// Its opacity at its mean, by the rules that lower it.
    pub opacity: f64,
    /// Its colour from where it is seen.
    pub colour: [f32; 3],
    /// Distance along the view axis.
    pub distance: f64,
    /// The greatest q at which it is drawn.
    reach: f64,
    /// Depth at its mean, as a share of the depth range, and its change per pixel.
    depth: f64,
    slopes: [f64; 2],
    columns: (i64, i64),
    rows: (i64, i64),
}

/// Why a splat leaves nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Nothing {
    /// It lies behind the camera or too near to it.
    Behind,
    /// No alpha of it is drawn.
    Transparent,
    /// It has no size.
    NoArea,
}

/// An object's splats in view space.
pub(crate) struct Placed {
    /// From the splats' own space to right, down and forward, without the way there.
    turn: DMat3,
    place: DAffine3,
    /// The eye in the splats' own space; where lines of sight are parallel, their direction.
    eye: Option<DVec3>,
    along: DVec3,
}

impl<'a> Painter<'a> {
    pub(super) fn new(
        camera: &'a Camera,
        rules: &'a SplatRules,
        space: Space,
        alpha: Option<f32>,
    ) -> Self {
        Painter { camera, rules, space, alpha: alpha.unwrap_or(1.0) }
    }

    /// What all splats of an object that stands at `place` have in common.
    pub(super) fn placed(&self, place: DAffine3) -> Placed {
        let own = place.inverse();
        Placed {
            turn: self.camera.to_axes() * place.matrix3,
            place,
            eye: self.camera.eye.map(|eye| own.transform_point3(eye)),
            along: (own.matrix3 * -self.camera.back).normalize_or(DVec3::Z),
        }
    }

    /// Splat `i` on the frame.
    pub(super) fn project(
        &self,
        splats: &Splats,
        i: usize,
        placed: &Placed,
    ) -> Result<OnFrame, Nothing> {
        let (camera, rules) = (self.camera, self.rules);
        let mean = splats.means[i].as_dvec3();
        let seen = camera.seen(placed.place.transform_point3(mean));
        let distance = match rules.distance {
            Distance::Eye if camera.eye.is_some() => seen.length(),
            _ => seen.z,
        };
        let depth = camera.depth(distance);
        if seen.z <= rules.near && camera.eye.is_some() || depth.is_nan() || depth < 0.0 {
            return Err(Nothing::Behind);
        }
        // The columns are the splat's own axes in view space, a standard deviation long.
        let scales = splats.scales[i].as_dvec3();
        let turn = placed.turn * DMat3::from_quat(splats.rotations[i].as_dquat());
        let axes = turn * DMat3::from_diagonal(scales);
        let [x, y] = self.on_frame(seen, &axes);
        let (xx, yy) = (x.dot(x), y.dot(y));
        // xx·yy − xy² of thin splats would be what rounding leaves.
        let undilated = x.cross(y).length_squared();
        let more = rules.dilation;
        let whole = undilated + more * (xx + yy) + more * more;
        if !(whole.is_finite() && whole > 0.0) {
            return Err(Nothing::NoArea);
        }
        let lowered = match rules.factor {
            Factor::Always => true,
            Factor::Auto => splats.antialiased,
            Factor::Never => false,
        };
        let factor = if lowered { (undilated / whole).sqrt() } else { 1.0 };
        let (covariance, whole) = self.limited([xx + more, x.dot(y), yy + more], whole);
        let opacity = f64::from(splats.opacities[i]) * factor * f64::from(self.alpha);
        let reach = rules.reach(opacity).ok_or(Nothing::Transparent)?;
        let [xx, xy, yy] = covariance;
        let centre = self.pixel(seen);
        // Where a sample may see it: half a pixel around its box.
        let room = if rules.alphas == Alphas::Sample { 0.5 } else { 0.0 };
        let range = |axis: usize, variance: f64| {
            let half = (reach * variance).sqrt() + room;
            let last = camera.size[axis] as i64 - 1;
            // Pixel x has its centre at x + 1/2. Beyond 64 bits `as` saturates.
            let low = (centre[axis] - half - 0.5).ceil() as i64;
            let high = (centre[axis] + half - 0.5).floor() as i64;
            (low.max(0), high.min(last))
        };
        Ok(OnFrame {
            centre,
            covariance,
            conic: [yy / whole, -xy / whole, xx / whole],
            opacity,
            colour: self.colour(splats, i, mean, placed),
            distance,
            reach,
            depth,
            slopes: self.slopes(seen, turn, scales),
            columns: range(0, xx),
            rows: range(1, yy),
        })
    }

    fn pixel(&self, seen: DVec3) -> DVec2 {
        let Camera { focal, principal, eye, .. } = self.camera;
        let w = if eye.is_some() { seen.z } else { 1.0 };
        DVec2::new(focal[0] * seen.x / w + principal[0], focal[1] * seen.y / w + principal[1])
    }

    /// How far what has these standard deviations in view space reaches along x and y on the
    /// frame, by its own axes.
    fn on_frame(&self, seen: DVec3, axes: &DMat3) -> [DVec3; 2] {
        let Camera { focal, principal, size, eye, .. } = self.camera;
        let mut slope = [DVec3::X * focal[0], DVec3::Y * focal[1]];
        if eye.is_some() {
            for axis in 0..2 {
                // Far outside of the frame the slope grows without bound.
                let half = size[axis] / 2.0 / focal[axis];
                let low = -principal[axis] / focal[axis] - self.rules.lean * half;
                let high = (size[axis] - principal[axis]) / focal[axis] + self.rules.lean * half;
                let lean = (seen[axis] / seen.z).clamp(low, high);
                slope[axis] = (slope[axis] - DVec3::Z * (focal[axis] * lean)) / seen.z;
            }
        }
        slope.map(|row| axes.transpose() * row)
    }

    /// A covariance whose axes are no longer than the rules allow, and its determinant.
    fn limited(&self, [xx, xy, yy]: [f64; 3], whole: f64) -> ([f64; 3], f64) {
        if self.rules.largest == 0.0 {
            return ([xx, xy, yy], whole);
        }
        let side = self.rules.largest.min(self.camera.size[0]).min(self.camera.size[1]);
        let most = side * side / 2.0;
        let (mid, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
        let spread = libm::hypot(half, xy);
        if mid + spread <= most {
            return ([xx, xy, yy], whole);
        }
        // By its eigenvalues and the direction of the longer axis.
        let (sin, cos) = libm::sincos(libm::atan2(xy, half) / 2.0);
        let turn = DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos));
        // The lesser as what the greater leaves of the determinant: their difference would cancel.
        let values = DVec2::new(most, (whole / (mid + spread)).min(most));
        let limited = turn * DMat2::from_diagonal(values) * turn.transpose();
        ([limited.x_axis.x, limited.x_axis.y, limited.y_axis.y], values.x * values.y)
    }

    /// How the depth changes per pixel: on the plane of the points where lines of sight come
    /// nearest to the mean, in the splat's own measure. Its normal is Σ⁻¹ times the mean.
    fn slopes(&self, seen: DVec3, turn: DMat3, scales: DVec3) -> [f64; 2] {
        if self.rules.depth == Depth::Flat {
            return [0.0; 2];
        }
        let Camera { focal, eye, .. } = self.camera;
        let scales = scales.max(DVec3::splat(THINNEST * scales.max_element()));
        let towards = if eye.is_some() { seen } else { DVec3::Z };
        let own = turn.inverse() * towards / (scales * scales);
        let normal = turn.inverse().transpose() * own;
        let across = if eye.is_some() { normal.dot(towards) } else { -normal.z };
        let slope = self.camera.depth_slope();
        // In perspective 1/z is linear on the frame, and so is depth.
        let slopes = [0, 1].map(|axis| slope * normal[axis] / (focal[axis] * across));
        if slopes.iter().all(|s| s.is_finite()) { slopes } else { [0.0; 2] }
    }

    fn colour(&self, splats: &Splats, i: usize, mean: DVec3, placed: &Placed) -> [f32; 3] {
        let along = placed.eye.map_or(placed.along, |eye| (mean - eye).normalize_or(placed.along));
        let count = splats.coefficients();
        let coefficients = &splats.harmonics[i * count..(i + 1) * count];
        let own = harmonics::colour(coefficients, &harmonics::basis(splats.degree, along));
        own.map(|c| {
            let c = match splats.space {
                own if own == self.space => c,
                // A display shows no more than 1.
                Space::Encoded => self.space.of_linear(Space::Encoded.to_linear(c.min(1.0))),
                own => self.space.of_linear(own.to_linear(c)),
            };
            // Beyond half precision there is no need to go.
            c.min(65504.0) as f32
        })
    }
}

impl OnFrame {
    /// The first and the last row that it may touch; empty where they cross.
    pub(super) fn rows(&self) -> (i64, i64) {
        if self.columns.0 > self.columns.1 { (0, -1) } else { self.rows }
    }

    /// How many pixels its box holds within a row.
    pub(super) fn columns(&self) -> i64 {
        self.columns.1 - self.columns.0 + 1
    }

    #[inline(always)]
    fn q(&self, dx: f64, dy: f64) -> f64 {
        let [a, b, c] = self.conic;
        a * dx * dx + 2.0 * b * dx * dy + c * dy * dy
    }

    /// The alpha at an offset from its centre, where it is drawn. The plain text of
    /// [`OnFrame::alphas`].
    fn alpha(&self, rules: &SplatRules, dx: f64, dy: f64) -> Option<f32> {
        let q = self.q(dx, dy);
        // Rounding may take it below 0; beyond its reach there may be more of the kernel.
        if q > self.reach {
            return None;
        }
        let alpha = self.opacity * rules.kernel(q.max(0.0));
        (alpha >= rules.least()).then(|| alpha.min(rules.cap) as f32)
    }

    /// The pixels of row `y` between which it lies, if anywhere.
    fn span(&self, y: i64, room: f64) -> (i64, i64) {
        let [a, b, c] = self.conic;
        let middle = y as f64 + 0.5 - self.centre.y;
        // The row's y that is nearest to the centre reaches furthest, or all of the box where
        // samples lie around the pixel's centre.
        if room > 0.0 {
            return self.columns;
        }
        let square = (b * b - a * c) * middle * middle + a * self.reach;
        if square < 0.0 {
            return (0, -1);
        }
        let (at, half) = (self.centre.x - b * middle / a, square.sqrt() / a);
        // A pixel more at either end: what rounding may hide is tried.
        let low = (at - half - 1.5).ceil() as i64;
        let high = (at + half + 0.5).floor() as i64;
        (low.max(self.columns.0), high.min(self.columns.1))
    }

    /// The depth at its mean, for everywhere.
    fn flat_depth(&self) -> DepthPlane {
        let z = (self.depth.min(1.0) * f64::from(u32::MAX)).round() as u32;
        DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 }
    }

    fn depth_plane(&self, x: i64, y: i64) -> DepthPlane {
        let range = f64::from(u32::MAX);
        let flat = self.flat_depth();
        if self.slopes == [0.0; 2] {
            return flat;
        }
        let away = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - self.centre;
        let z = (self.depth + self.slopes[0] * away.x + self.slopes[1] * away.y) * range;
        let slopes = self.slopes.map(|s| (s * range).round());
        let fits = slopes.iter().all(|s| s.abs() <= f64::from(i32::MAX));
        if !fits || !(0.0..=range).contains(&z) {
            return flat;
        }
        let [dzdx, dzdy] = slopes.map(|s| s as i32);
        DepthPlane { z: Unorm32(z.round() as u32), dzdx, dzdy }
    }

    /// [`OnFrame::alpha`] at several offsets: the alphas, and a bit for each that is drawn.
    #[inline(always)]
    fn alphas(
        &self,
        rules: &SplatRules,
        dx: &[f64; LANES],
        dy: &[f64; LANES],
    ) -> ([f32; LANES], u64) {
        let (mut alphas, mut drawn) = ([0.0; LANES], 0);
        if self.reach > -2.0 * LEAST_EXPONENT {
            for i in 0..LANES {
                let alpha = self.alpha(rules, dx[i], dy[i]);
                alphas[i] = alpha.unwrap_or(0.0);
                drawn |= u64::from(alpha.is_some()) << i;
            }
            return (alphas, drawn);
        }
        let mut values = [0.0; LANES];
        let mut within = [false; LANES];
        for i in 0..LANES {
            let q = self.q(dx[i], dy[i]);
            within[i] = q <= self.reach || q.is_nan();
            // What is beyond its reach is not used.
            values[i] = elementary::exp((-q.max(0.0) / 2.0).max(LEAST_EXPONENT));
        }
        let (least, cap) = (rules.least(), rules.cap);
        let values = rules.shares(values);
        for i in 0..LANES {
            let alpha = self.opacity * values[i];
            alphas[i] = alpha.min(cap) as f32;
            drawn |= u64::from(within[i] & (alpha >= least)) << i;
        }
        (alphas, drawn)
    }

    /// Adds its fragments in row `y`, from the left; each is otherwise like `of`. Samples lie at
    /// `offsets` in pixels from the pixel's centre.
    #[inline(always)]
    pub(super) fn row(
        &self,
        y: i64,
        rules: &SplatRules,
        offsets: &[[f64; 2]],
        of: Fragment,
        fragments: &mut Vec<Fragment>,
    ) {
        let of = Fragment { y: y as u16, colour: self.colour, depth: self.flat_depth(), ..of };
        let deep = self.slopes != [0.0; 2];
        let depth = |x: i64| if deep { self.depth_plane(x, y) } else { of.depth };
        let away = |x: i64| DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - self.centre;
        let sampled = rules.alphas == Alphas::Sample;
        let (low, high) = self.span(y, if sampled { 0.5 } else { 0.0 });
        if sampled {
            for x in low..=high {
                let (away, depth) = (away(x), depth(x));
                for (k, group) in offsets.chunks(LANES).enumerate() {
                    let (mut dx, mut dy) = ([away.x; LANES], [away.y; LANES]);
                    for (i, offset) in group.iter().enumerate() {
                        dx[i] += offset[0];
                        dy[i] += offset[1];
                    }
                    let (alphas, drawn) = self.alphas(rules, &dx, &dy);
                    for i in SampleMask(drawn & (u64::MAX >> (64 - group.len()))).iter() {
                        let coverage = [k * LANES + i].into_iter().collect();
                        let (x, alpha) = (x as u16, alphas[i]);
                        fragments.push(Fragment { x, coverage, depth, alpha, ..of });
                    }
                }
            }
            return;
        }
        let coverage = SampleMask::first(offsets.len() as u32);
        let mut first = low;
        while first <= high {
            let (mut dx, mut dy) = ([0.0; LANES], [0.0; LANES]);
            for i in 0..LANES {
                let away = away(first + i as i64);
                (dx[i], dy[i]) = (away.x, away.y);
            }
            let count = (high - first + 1).min(LANES as i64);
            let (alphas, drawn) = self.alphas(rules, &dx, &dy);
            for i in SampleMask(drawn & (u64::MAX >> (64 - count))).iter() {
                let x = first + i as i64;
                let (depth, alpha) = (depth(x), alphas[i]);
                fragments.push(Fragment { x: x as u16, coverage, depth, alpha, ..of });
            }
            first += count;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::lanes::levels;
    use fearless_simd::dispatch;
    use screendoor_trace::random::Stream;

    #[test]
    fn several_alphas_are_those_of_each() {
        let mut random = Stream::new([0x5b1a7]);
        let mut real = |low: f64, high: f64| low + f64::from(random.word()) / 4.3e9 * (high - low);
        for set in RULE_SETS {
            let rules = SplatRules::parse(set.name).unwrap();
            for _ in 0..200 {
                let (xx, yy) = (real(0.3, 40.0), real(0.3, 40.0));
                let xy = real(-0.99, 0.99) * (xx * yy).sqrt();
                let (whole, opacity) = (xx * yy - xy * xy, real(0.01, 1.0));
                let Some(reach) = rules.reach(opacity) else { continue };
                let splat = OnFrame {
                    centre: DVec2::ZERO,
                    covariance: [xx, xy, yy],
                    conic: [yy / whole, -xy / whole, xx / whole],
                    opacity,
                    colour: [0.5; 3],
                    distance: 1.0,
                    // Beyond what vectors are for, too.
                    reach: if real(0.0, 1.0) < 0.1 { 5000.0 } else { reach },
                    depth: 0.5,
                    slopes: [0.0; 2],
                    columns: (0, 9),
                    rows: (0, 9),
                };
                let far = real(0.1, 60.0);
                let mut offset = || std::array::from_fn(|_| real(-far, far));
                let (dx, dy): ([f64; LANES], [f64; LANES]) = (offset(), offset());
                for level in levels() {
                    let (alphas, drawn) = dispatch!(level, _ => splat.alphas(&rules, &dx, &dy));
                    for i in 0..LANES {
                        let found = (drawn >> i & 1 == 1).then_some(alphas[i]);
                        assert_eq!(found, splat.alpha(&rules, dx[i], dy[i]), "{}", set.name);
                    }
                }
            }
        }
    }
}
