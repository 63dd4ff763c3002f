//! From a triangle in space to triangles on the frame's sub-pixel grid.

use arrayvec::ArrayVec;
use glam::{DVec3, DVec4};

use crate::capture::camera::Camera;
use crate::capture::geometry::Triangle;

/// Sub-pixel steps per pixel: 8 bits, as Direct3D asks.
pub(crate) const STEPS: i64 = 256;
/// A clipped corner is kept within this many pixels of the frame's centre, so
/// that products of coordinates fit into 64 bits with room to spare.
const GUARD_PIXELS: f64 = (1 << 20) as f64;

/// Corners that a triangle can have once five planes have cut it. Each adds one to a convex
/// polygon; to one that rounding has bent, at the very most, half as many as there are.
const MOST_CORNERS: usize = 19;
type Polygon = ArrayVec<Corner, MOST_CORNERS>;

/// A corner of a clipped triangle.
#[derive(Clone, Copy, Debug)]
struct Corner {
    clip: DVec4,
    /// Its weights in the triangle it was clipped from.
    weights: DVec3,
}

/// A triangle on the sub-pixel grid, its corners in the order that makes its
/// area positive with y downwards.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenTriangle {
    /// Corners in sub-pixel steps from the frame's top left.
    pub corners: [[i64; 2]; 3],
    /// Twice the area in steps²; positive.
    pub area: i64,
    /// Depth of each corner in units of the unorm32 range, 0 to 2^32 − 1.
    pub depth: [f64; 3],
    /// Reciprocal of each corner's clip-space w.
    pub inverse_w: [f64; 3],
    /// Each corner's weights in the original triangle.
    pub weights: [DVec3; 3],
}

/// What clipping leaves of a triangle: mostly one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    first: Option<ScreenTriangle>,
    more: Vec<ScreenTriangle>,
}

impl Pieces {
    fn push(&mut self, piece: ScreenTriangle) {
        match self.first {
            None => self.first = Some(piece),
            Some(_) => self.more.push(piece),
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.first.is_none()
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &ScreenTriangle> {
        self.first.iter().chain(&self.more)
    }

    /// Piece `i`.
    pub(super) fn get(&self, i: usize) -> &ScreenTriangle {
        match (i, &self.first) {
            (0, Some(first)) => first,
            _ => &self.more[i - 1],
        }
    }
}

/// Clips `triangle` against the near plane and the guard band, projects it and
/// snaps it to the sub-pixel grid; `keep_back` says whether a triangle that shows
/// its back is drawn. Adds what is left to `out`.
pub(crate) fn set_up(triangle: &Triangle, camera: &Camera, keep_back: bool, out: &mut Pieces) {
    let mut polygon = Polygon::new();
    for (i, vertex) in triangle.vertices.iter().enumerate() {
        let clip = camera.to_clip * vertex.position.extend(1.0);
        polygon.push(Corner { clip, weights: DVec3::from_array(unit(i)) });
    }
    // Near plane: clip z ≥ 0. The far plane holds the whole scene by construction.
    clip(&mut polygon, |c| c.z);
    let reach = [GUARD_PIXELS / (camera.size[0] * 0.5), GUARD_PIXELS / (camera.size[1] * 0.5)];
    let inside =
        |c: &Corner| c.clip.x.abs() <= reach[0] * c.clip.w && c.clip.y.abs() <= reach[1] * c.clip.w;
    if !polygon.iter().all(inside) {
        clip(&mut polygon, |c| reach[0] * c.w - c.x);
        clip(&mut polygon, |c| reach[0] * c.w + c.x);
        clip(&mut polygon, |c| reach[1] * c.w - c.y);
        clip(&mut polygon, |c| reach[1] * c.w + c.y);
    }
    if polygon.len() < 3 {
        return;
    }
    let snapped: ArrayVec<[i64; 2], MOST_CORNERS> =
        polygon.iter().map(|c| snap(c.clip, camera.size)).collect();
    let (apex, whole) = apex(&snapped);
    // Counter-clockwise with y upwards is the front: that is a negative area with
    // y downwards.
    if whole > 0 && !keep_back {
        return;
    }
    for i in 1..polygon.len() - 1 {
        let mut order = piece(apex, i, polygon.len());
        if whole < 0 {
            order.swap(1, 2);
        }
        let [a, b, c] = order.map(|k| snapped[k]);
        let area = cross(a, b, c);
        if area <= 0 {
            continue;
        }
        let pick = order.map(|k| polygon[k]);
        out.push(ScreenTriangle {
            corners: order.map(|k| snapped[k]),
            area,
            depth: pick.map(|c| (c.clip.z / c.clip.w).clamp(0.0, 1.0) * f64::from(u32::MAX)),
            inverse_w: pick.map(|c| 1.0 / c.clip.w),
            weights: pick.map(|c| c.weights),
        });
    }
}

/// The corner around which a polygon is cut into triangles, and twice the
/// polygon's area. Snapping can bend a clipped polygon inwards, by less than a
/// step: the corner is one from which no piece folds back, where there is one.
fn apex(polygon: &[[i64; 2]]) -> (usize, i64) {
    let pieces = 1..polygon.len() - 1;
    let area = |apex: usize, i: usize| {
        let [a, b, c] = piece(apex, i, polygon.len()).map(|k| polygon[k]);
        cross(a, b, c)
    };
    let whole: i64 = pieces.clone().map(|i| area(0, i)).sum();
    let folds = |apex: usize| pieces.clone().any(|i| area(apex, i) * whole.signum() < 0);
    ((0..polygon.len()).find(|apex| !folds(*apex)).unwrap_or(0), whole)
}

/// The corners of the `i`-th triangle around corner `apex` of a polygon of `n`.
fn piece(apex: usize, i: usize, n: usize) -> [usize; 3] {
    [apex, (apex + i) % n, (apex + i + 1) % n]
}

fn unit(i: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 })
}

/// Twice the signed area of a triangle.
pub(crate) fn cross(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Cuts off the part of a convex polygon where `distance` is negative.
///
/// A crossing is always computed from its inner end to its outer one, so that two
/// triangles that share an edge share its crossing to the last bit.
fn clip(polygon: &mut Polygon, distance: impl Fn(DVec4) -> f64) {
    if polygon.iter().all(|c| distance(c.clip) >= 0.0) {
        return;
    }
    let mut kept = Polygon::new();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (da, db) = (distance(a.clip), distance(b.clip));
        if da >= 0.0 {
            kept.push(*a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            let (inner, outer, d) = if da >= 0.0 { (a, b, (da, db)) } else { (b, a, (db, da)) };
            let t = d.0 / (d.0 - d.1);
            kept.push(Corner {
                clip: inner.clip + (outer.clip - inner.clip) * t,
                weights: inner.weights + (outer.weights - inner.weights) * t,
            });
        }
    }
    *polygon = kept;
}

/// The nearest sub-pixel step of a projected corner.
fn snap(clip: DVec4, size: [f64; 2]) -> [i64; 2] {
    let round =
        |ndc: f64, pixels: f64| ((ndc * 0.5 + 0.5) * pixels * STEPS as f64 + 0.5).floor() as i64;
    [round(clip.x / clip.w, size[0]), round(-clip.y / clip.w, size[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_that_is_bent_inwards_is_cut_from_the_bend() {
        let polygon = [[0, 0], [10, 1], [20, 0], [20, 20], [0, 20]];
        let (from, whole) = apex(&polygon);
        assert_eq!((from, whole), (1, 780));
        let areas = (1..4).map(|i| {
            let [a, b, c] = piece(from, i, 5).map(|k| polygon[k]);
            cross(a, b, c)
        });
        assert!(areas.clone().all(|a| a > 0) && areas.sum::<i64>() == whole);
        assert_eq!(apex(&[[0, 0], [0, 8], [8, 8]]), (0, -64));
    }
}
