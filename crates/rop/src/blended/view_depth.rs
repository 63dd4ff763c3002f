//! View depth: how far a fragment lies before the camera.
//!
//! A trace holds depths as a depth buffer does, from the near plane to the far one.
//! Techniques whose formulas take the distance along the view axis are told by parameters
//! where these planes stand, in the units of their formulas; or they take it from the view
//! of the trace ([`View`]), in the units of its scene.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8, u32x16};

use crate::blended::functions::{log1p, reals};
use crate::contract::frame::Frame;
use crate::contract::words::{Constant, Declaration};
use crate::in_lanes::Wide;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Projection, Unorm32, View};

screendoor_trace::options! {
    /// How depth grows from the near plane to the far one, and where they stand.
    pub enum Lens {
        Perspective = "perspective": "as a perspective camera's depth buffer does, over near and range",
        Parallel = "parallel": "in proportion, as along parallel lines of sight, over near and range",
        Camera = "camera": "the trace's own projection: view depth from its near and far, in its scene's units",
    }
}

/// Where the near plane stands. By default the far plane stands twice as far, about as
/// in a view that frames a scene with a common field of view.
pub const NEAR: Typed<f64> = Typed::real("near", "10", (1e-3, 1e6), "view depth of the near plane");
/// How far it is from there to the far plane.
pub const RANGE: Typed<f64> =
    Typed::real("range", "10", (1e-3, 1e6), "view depth from the near plane to the far plane");
/// How depth grows between them.
pub const LENS: Typed<Lens> =
    Typed::choice("lens", "perspective", "how depth grows between the planes");

/// The nearest and the furthest plane of a trace's own projection that view depths are taken
/// of: so far squares and sixth powers stay numbers in single precision, too.
const PLANES: (f64, f64) = (1e-6, 1e6);

/// Whether a design asks for the view of its trace.
pub fn asks_for_view(values: &Values) -> bool {
    let has = values.iter().any(|(param, _)| param == LENS.param.name);
    has && values.get(LENS) == Lens::Camera
}

/// What turns a stored depth into a view depth.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ViewDepth {
    near: f64,
    range: f64,
    projection: Projection,
    /// The logarithm of the far plane's view depth, where the near one's is 1.
    log_far: f64,
}

impl ViewDepth {
    /// From a near plane at view depth `near` > 0 over a `range` > 0.
    pub fn new(near: f64, range: f64, projection: Projection) -> Self {
        ViewDepth { near, range, projection, log_far: libm::log1p(range / near) }
    }

    /// As the parameters say, for a trace of `frame`.
    ///
    /// # Errors
    /// [`Error::Config`] where they ask for the trace's own projection, and the trace has
    /// none, or one whose planes stand too near or too far.
    pub fn of(values: &Values, frame: &Frame) -> Result<Self> {
        let projection = match values.get(LENS) {
            Lens::Perspective => Projection::Perspective,
            Lens::Parallel => Projection::Orthographic,
            Lens::Camera => return Self::of_view(frame.view.as_ref()),
        };
        Ok(Self::new(values.get(NEAR), values.get(RANGE), projection))
    }

    fn of_view(view: Option<&View>) -> Result<Self> {
        let Some(view) = view else {
            return Err(Error::config(
                "lens=camera asks for the trace's own projection, which it does not say",
                "capture the trace again, let its writer state the view \
                 (docs/TRACE_FORMAT.md), or give lens=perspective or parallel with near and range",
            ));
        };
        if view.near < PLANES.0 || view.far > PLANES.1 {
            let (near, far) = (view.near, view.far);
            return Err(Error::config(
                format_args!("the trace's planes stand at view depths {near:?} and {far:?}"),
                format_args!(
                    "lens=camera takes {:?} to {:?}: change the scene's unit or where its view \
                     begins, or give lens=perspective or parallel with near and range",
                    PLANES.0, PLANES.1
                ),
            ));
        }
        Ok(Self::new(view.near, view.far - view.near, view.projection))
    }

    /// Declares what the shader's twin reads.
    pub fn declare(&self, to: &mut Declaration) {
        to.constant("VIEW_NEAR", Constant::Real(self.near as f32));
        to.constant("VIEW_RANGE", Constant::Real(self.range as f32));
        let parallel = self.projection == Projection::Orthographic;
        to.constant("VIEW_PARALLEL", Constant::Flag(parallel));
    }

    /// The view depth of `z`, between those of the two planes.
    #[inline]
    pub fn at(&self, z: Unorm32) -> f64 {
        self.near + self.beyond_near(z)
    }

    /// The logarithm of the view depth of `z`, −1 at the near plane and 1 at the far.
    #[inline]
    pub fn log_warped(&self, z: Unorm32) -> f64 {
        let log = libm::log1p(self.beyond_near(z) / self.near);
        2.0 * (log / self.log_far).clamp(0.0, 1.0) - 1.0
    }

    /// How far `z` lies beyond the near plane.
    #[inline]
    fn beyond_near(&self, z: Unorm32) -> f64 {
        let d = fraction(z);
        match self.projection {
            // d = f (z − n) / (z (f − n)), solved for z − n so that nothing cancels.
            Projection::Perspective => {
                let far = self.near + self.range;
                d * self.range * self.near / (far * (1.0 - d) + self.near * d)
            }
            Projection::Orthographic => d * self.range,
        }
    }
}

/// The same of sixteen depths.
impl ViewDepth {
    /// [`ViewDepth::at`].
    #[inline(always)]
    pub fn at_lanes<S: Simd>(&self, simd: S, z: u32x16<S>) -> Wide<S> {
        let [low, high] = self.beyond_near_lanes(simd, z);
        [low + self.near, high + self.near]
    }

    /// [`ViewDepth::log_warped`].
    #[inline(always)]
    pub fn log_warped_lanes<S: Simd>(&self, simd: S, z: u32x16<S>) -> Wide<S> {
        let number = |x: f64| f64x8::splat(simd, x);
        let mut wide = self.beyond_near_lanes(simd, z);
        for half in &mut wide {
            let share = log1p(simd, *half / self.near) / self.log_far;
            *half = number(2.0) * share.max(0.0).min(1.0) - 1.0;
        }
        wide
    }

    #[inline(always)]
    fn beyond_near_lanes<S: Simd>(&self, simd: S, z: u32x16<S>) -> Wide<S> {
        let mut wide = fraction_lanes(simd, z);
        for d in &mut wide {
            *d = match self.projection {
                Projection::Perspective => {
                    let far = self.near + self.range;
                    let within = (f64x8::splat(simd, 1.0) - *d) * far + *d * self.near;
                    *d * self.range * self.near / within
                }
                Projection::Orthographic => *d * self.range,
            };
        }
        wide
    }
}

/// [`fraction`] of sixteen.
#[inline(always)]
pub fn fraction_lanes<S: Simd>(simd: S, z: u32x16<S>) -> Wide<S> {
    let [low, high] = reals(simd, z);
    [low / f64::from(u32::MAX), high / f64::from(u32::MAX)]
}

/// A stored depth as a fraction: 0 at the near plane, 1 at the far one.
#[inline]
pub fn fraction(z: Unorm32) -> f64 {
    f64::from(z.0) / f64::from(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_planes_stand_where_they_are_said_to() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            for (near, range) in [(0.1, 499.9), (1.0, 1.0), (1e6, 1e-3), (1e-3, 1e6)] {
                let depth = ViewDepth::new(near, range, projection);
                assert_eq!(depth.at(Unorm32::NEAR), near);
                assert!((depth.at(Unorm32::FAR) / (near + range) - 1.0).abs() < 1e-9);
                assert_eq!(depth.log_warped(Unorm32::NEAR), -1.0);
                assert!((depth.log_warped(Unorm32::FAR) - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_perspective_depth_by_hand() {
        // n = 1, f = 4: z = 2 has depth 4·1/(2·3) = 2/3, and lies at ln 2/ln 4 = 1/2.
        let depth = ViewDepth::new(1.0, 3.0, Projection::Perspective);
        let z = Unorm32((f64::from(u32::MAX) * 2.0 / 3.0) as u32);
        assert!((depth.at(z) - 2.0).abs() < 1e-8);
        assert!(depth.log_warped(z).abs() < 1e-8);
    }
}
