//! Scenes that lie far from the origin, as surveyed ones do: single precision would show.

use glam::DVec3;

/// A scene further from the origin than this many times its size is moved there before its
/// places are rounded to single precision.
const FAR: f64 = 16.0;

/// Where a scene of these points is moved from: the middle of them, where they are so far away
/// that single precision would show; else the origin.
pub(super) fn origin(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let (low, high) =
        points.fold((DVec3::MAX, DVec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let furthest = low.abs().max(high.abs()).max_element();
    let is_far = furthest > FAR * (high - low).max_element();
    if is_far && furthest.is_finite() { (low + high) / 2.0 } else { DVec3::ZERO }
}
