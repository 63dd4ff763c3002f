//! View depth: how far a fragment lies before the camera.
//!
//! A trace holds depths as a depth buffer does, from the near plane to the far one,
//! and does not say where these planes stand. Techniques whose formulas take the
//! distance along the view axis are told so by parameters, in the units of their
//! formulas.

use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::Unorm32;

screendoor_trace::options! {
    /// How depth grows from the near plane to the far one.
    pub enum Lens {
        Perspective = "perspective": "as a perspective camera's depth buffer does",
        Parallel = "parallel": "in proportion, as along parallel lines of sight",
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

/// What turns a stored depth into a view depth.
#[derive(Clone, Copy, Debug)]
pub struct ViewDepth {
    near: f64,
    range: f64,
    lens: Lens,
}

impl ViewDepth {
    /// From a near plane at view depth `near` > 0 over a `range` > 0.
    pub fn new(near: f64, range: f64, lens: Lens) -> Self {
        ViewDepth { near, range, lens }
    }

    /// As the parameters say.
    pub fn of(values: &Values) -> Self {
        Self::new(values.get(NEAR), values.get(RANGE), values.get(LENS))
    }

    /// The view depth of `z`, between those of the two planes.
    #[inline]
    pub fn at(&self, z: Unorm32) -> f64 {
        self.near + self.beyond_near(z)
    }

    /// The logarithm of the view depth of `z`, −1 at the near plane and 1 at the far.
    #[inline]
    pub fn log_warped(&self, z: Unorm32) -> f64 {
        let log = |beyond: f64| libm::log1p(beyond / self.near);
        2.0 * (log(self.beyond_near(z)) / log(self.range)).clamp(0.0, 1.0) - 1.0
    }

    /// How far `z` lies beyond the near plane.
    #[inline]
    fn beyond_near(&self, z: Unorm32) -> f64 {
        let d = fraction(z);
        match self.lens {
            // d = f (z − n) / (z (f − n)), solved for z − n so that nothing cancels.
            Lens::Perspective => {
                let far = self.near + self.range;
                d * self.range * self.near / (far * (1.0 - d) + self.near * d)
            }
            Lens::Parallel => d * self.range,
        }
    }
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
        for lens in [Lens::Perspective, Lens::Parallel] {
            for (near, range) in [(0.1, 499.9), (1.0, 1.0), (1e6, 1e-3), (1e-3, 1e6)] {
                let depth = ViewDepth::new(near, range, lens);
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
        let depth = ViewDepth::new(1.0, 3.0, Lens::Perspective);
        let z = Unorm32((f64::from(u32::MAX) * 2.0 / 3.0) as u32);
        assert!((depth.at(z) - 2.0).abs() < 1e-8);
        assert!(depth.log_warped(z).abs() < 1e-8);
    }
}
