//! Polygons of any shape, cut into triangles that cover each point once.
//!
//! A polygon is filled by the even-odd rule, as OpenGL's tessellators do: what an odd number
//! of its edges encloses is inside. So concave ones, holes that a bridge joins to the outline
//! and outlines that cross themselves are drawn in one layer. One that is not plane is cut as
//! its projection on the plane that suits it best (Newell's normal), and its corners stay
//! where they are.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use i_triangle::i_overlay::core::fill_rule::FillRule;
use i_triangle::i_overlay::core::overlay::IntOverlayOptions;
use i_triangle::i_overlay::i_float::int::point::IntPoint;
use i_triangle::int::custom::IntCustomTriangulatable;
use i_triangle::int::validation::Validation;

use screendoor_trace::random::Stream;

/// Polygons of more corners are cut only where a fan of triangles covers them.
const MAX_CORNERS: usize = 1 << 16;
/// Crossings of edges times corners, of all polygons of a scene: what finding the edges takes.
const MAX_WORK: f64 = (1_u64 << 26) as f64;
/// Pairs of edges for each corner that are looked at to estimate how many cross.
const PAIRS: usize = 64;
/// An edge that the sweep over a polygon keeps beside a corner takes as long as so many of these,
/// at the worst.
const KEPT_EDGE: f64 = 4.0;
/// Where a sweep along x keeps more, it is looked at whether one along y keeps fewer.
const MANY_KEPT: f64 = (1_u64 << 20) as f64;
/// Steps of the lattice on which polygons are cut, along the longer side of their box.
const STEPS: f64 = (1_u64 << 40) as f64;
/// A part of a polygon's area that may be covered twice.
const NO_AREA: f64 = 1e-9;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Corner {
    /// The polygon's corner of that number.
    Own(usize),
    /// Where edges cross: on the edge from that corner to the next, at a share of its length.
    OnEdge(usize, f64),
}

/// The polygon has too many corners or crossings to be cut.
#[derive(Debug, PartialEq)]
pub(super) struct TooComplex;

/// Cuts the polygons of a scene.
pub(super) struct Cutter {
    /// How much more crossings and sweeps may take.
    left: f64,
}

impl Default for Cutter {
    fn default() -> Self {
        Cutter { left: MAX_WORK }
    }
}

impl Cutter {
    /// The triangles of the polygon with these corners; they turn as it does. A polygon without
    /// area gives triangles without area.
    ///
    /// # Errors
    /// [`TooComplex`] where it has more than 65536 corners, or it and the polygons before it too
    /// many crossings or too many edges side by side, and is not covered by a fan from its first
    /// corner.
    pub(super) fn triangulate(&mut self, points: &[DVec3]) -> Result<Vec<[Corner; 3]>, TooComplex> {
        let fan = || (1..points.len().max(2) - 1).map(|i| [0, i, i + 1].map(Corner::Own)).collect();
        if points.len() <= 3 {
            return Ok(fan());
        }
        let Some(mut flat) = flattened(points) else { return Ok(fan()) };
        if is_fan(&flat) {
            return Ok(fan());
        }
        if flat.len() > MAX_CORNERS {
            return Err(TooComplex);
        }
        let mut kept = kept(&flat);
        if kept > MANY_KEPT {
            let turned: Vec<DVec2> = flat.iter().map(|p| DVec2::new(p.y, -p.x)).collect();
            let other = self::kept(&turned);
            if other < kept {
                (flat, kept) = (turned, other);
            }
        }
        self.left -= crossings(&flat) * (flat.len() + PAIRS) as f64 + kept * KEPT_EDGE;
        if self.left < 0.0 { Err(TooComplex) } else { Ok(cut(&flat)) }
    }
}

/// The polygon in its best plane, seen so that it turns counter-clockwise; `None` where it has
/// no area.
fn flattened(points: &[DVec3]) -> Option<Vec<DVec2>> {
    let origin = points[0];
    let at = |i: usize| points[i % points.len()] - origin;
    let spans = (0..points.len()).map(|i| at(i).cross(at(i + 1)));
    let (mut newell, mut widest) = (DVec3::ZERO, DVec3::ZERO);
    for span in spans {
        newell += span;
        if span.length_squared() > widest.length_squared() {
            widest = span;
        }
    }
    // An outline like an 8 may enclose as much to the left as to the right.
    let balanced = newell.length_squared() <= 1e-12 * widest.length_squared();
    let normal = (if balanced { widest } else { newell }).try_normalize()?;
    let axes = axes(normal);
    Some(points.iter().map(|p| DVec2::from(axes.map(|axis| axis.dot(*p - origin)))).collect())
}

/// Two unit vectors that turn counter-clockwise as seen against `normal`: axes of the
/// coordinates where it is one, so that nothing is rounded.
fn axes(normal: DVec3) -> [DVec3; 2] {
    let all = [DVec3::X, DVec3::Y, DVec3::Z];
    for (i, axis) in all.into_iter().enumerate() {
        let along = axis.dot(normal);
        if along.abs() > 1.0 - 1e-12 {
            let (u, v) = (all[(i + 1) % 3], all[(i + 2) % 3]);
            return if along > 0.0 { [u, v] } else { [v, u] };
        }
    }
    let u = normal.any_orthonormal_vector();
    [u, normal.cross(u)]
}

/// Whether the triangles from the first corner to all edges cover the polygon once.
fn is_fan(flat: &[DVec2]) -> bool {
    let spokes: Vec<DVec2> = flat[1..].iter().map(|p| *p - flat[0]).collect();
    let areas = spokes.windows(2).map(|w| w[0].perp_dot(w[1]));
    let least = -NO_AREA * areas.clone().map(f64::abs).sum::<f64>();
    if areas.clone().any(|area| area < least) {
        return false;
    }
    let mut turned = 0.0;
    for w in spokes.windows(2) {
        let (sine, cosine) = (w[0].perp_dot(w[1]), w[0].dot(w[1]));
        // Through the first corner itself, there is no saying how far it turns.
        if sine.abs() <= -least && cosine <= 0.0 {
            return false;
        }
        turned += libm::atan2(sine, cosine);
    }
    turned <= std::f64::consts::TAU * (1.0 + NO_AREA)
}

/// About how often edges cross each other; exactly where there are few.
fn crossings(flat: &[DVec2]) -> f64 {
    let count = flat.len();
    let edge = |i: usize| (flat[i], flat[(i + 1) % count]);
    let cross = |i: usize, j: usize| {
        let (a, b) = (edge(i), edge(j));
        let side = |(p, q): (DVec2, DVec2), r: DVec2| (q - p).perp_dot(r - p);
        side(a, b.0) * side(a, b.1) < 0.0 && side(b, a.0) * side(b, a.1) < 0.0
    };
    let pairs = count * count / 2;
    if pairs <= PAIRS * count {
        let all = (0..count).flat_map(|i| (0..i).map(move |j| (i, j)));
        return all.filter(|(i, j)| cross(*i, *j)).count() as f64;
    }
    let mut random = Stream::new([0x901, count as u32]);
    let mut any = || random.below(count as u32) as usize;
    let found = (0..PAIRS * count).filter(|_| cross(any(), any())).count();
    found as f64 / (PAIRS * count) as f64 * pairs as f64
}

/// How many edges a sweep along x keeps, at all corners together: for each edge, the corners
/// between its ends.
fn kept(flat: &[DVec2]) -> f64 {
    let mut all: Vec<f64> = flat.iter().map(|p| p.x).collect();
    all.sort_unstable_by(f64::total_cmp);
    let before = |x: f64| all.partition_point(|other| *other < x);
    let edges = (0..flat.len()).map(|i| [before(flat[i].x), before(flat[(i + 1) % flat.len()].x)]);
    edges.map(|[a, b]| a.abs_diff(b) as f64).sum()
}

/// Cuts any polygon, by the even-odd rule.
fn cut(flat: &[DVec2]) -> Vec<[Corner; 3]> {
    let (low, high) = flat.iter().fold((flat[0], flat[0]), |(l, h), p| (l.min(*p), h.max(*p)));
    let scale = STEPS / (high - low).max_element();
    let lattice = |p: DVec2| ((p - low) * scale).round();
    let contour: Vec<IntPoint<i64>> = flat
        .iter()
        .map(|p| {
            let at = lattice(*p);
            IntPoint::new(at.x as i64, at.y as i64)
        })
        .collect();
    let mut own = HashMap::new();
    for (i, p) in contour.iter().enumerate() {
        own.entry((p.x, p.y)).or_insert(i);
    }
    let options = IntOverlayOptions {
        preserve_input_collinear: true,
        ..IntOverlayOptions::keep_output_points()
    };
    let by = |fill_rule| contour.custom_triangulate(Validation { fill_rule, options });
    let mut cut = by(FillRule::EvenOdd);
    if cut.points().is_empty() {
        // An outline that runs round twice encloses nothing an odd number of times.
        cut = by(FillRule::NonZero);
    }
    let corners: Vec<Corner> = cut
        .points()
        .iter()
        .map(|p| match own.get(&(p.x, p.y)) {
            Some(i) => Corner::Own(*i),
            None => on_edge(&contour, DVec2::new(p.x as f64, p.y as f64)),
        })
        .collect();
    let indices = cut.triangle_indices::<u32>();
    indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| corners[i as usize])).collect()
}

/// The place on the edge that is nearest to `at`.
fn on_edge(contour: &[IntPoint<i64>], at: DVec2) -> Corner {
    let point = |i: usize| {
        let p = contour[i % contour.len()];
        DVec2::new(p.x as f64, p.y as f64)
    };
    let mut best = (f64::INFINITY, Corner::Own(0));
    for i in 0..contour.len() {
        let (start, along) = (point(i), point(i + 1) - point(i));
        let length = along.length_squared();
        let share =
            if length > 0.0 { ((at - start).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        let distance = (start + along * share).distance_squared(at);
        if distance < best.0 {
            best = (distance, Corner::OnEdge(i, share));
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangulate(points: &[DVec3]) -> Result<Vec<[Corner; 3]>, TooComplex> {
        Cutter::default().triangulate(points)
    }

    fn polygon(corners: &[[f64; 2]]) -> Vec<DVec3> {
        corners.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect()
    }

    fn place(points: &[DVec3], corner: Corner) -> DVec3 {
        match corner {
            Corner::Own(i) => points[i],
            Corner::OnEdge(i, t) => points[i].lerp(points[(i + 1) % points.len()], t),
        }
    }

    /// How many triangles cover a point, and whether it is inside by the even-odd rule.
    fn covered(points: &[DVec3], triangles: &[[Corner; 3]], at: DVec2) -> (usize, bool) {
        let inside = |ring: &[DVec2]| {
            let edges = (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()]));
            let crossed = edges.filter(|(a, b)| {
                (a.y > at.y) != (b.y > at.y)
                    && at.x < (b.x - a.x) * (at.y - a.y) / (b.y - a.y) + a.x
            });
            crossed.count() % 2 == 1
        };
        let flat: Vec<DVec2> = points.iter().map(|p| p.truncate()).collect();
        let layers = triangles.iter().filter(|t| {
            let ring = t.map(|corner| place(points, corner).truncate());
            inside(&ring)
        });
        (layers.count(), inside(&flat))
    }

    fn once_inside(points: &[DVec3]) {
        let triangles = triangulate(points).unwrap();
        let mut random = Stream::new([7, points.len() as u32]);
        for _ in 0..2000 {
            let at = DVec2::new(random.range(-3.0, 3.0).into(), random.range(-3.0, 3.0).into());
            let (layers, inside) = covered(points, &triangles, at);
            assert_eq!(layers, usize::from(inside), "{at} of {points:?}");
        }
    }

    const SHAPES: [&[[f64; 2]]; 9] = [
        // A dart, its dent at each of its corners.
        &[[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.6, 1.0]],
        &[[0.6, 1.0], [0.0, 0.0], [2.0, 1.0], [0.0, 2.0]],
        // An L.
        &[[2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0]],
        // A square with a hole that a bridge joins to its outline.
        &[
            [-2.0, -2.0],
            [2.0, -2.0],
            [2.0, 2.0],
            [-2.0, 2.0],
            [-2.0, -2.0],
            [-1.0, -1.0],
            [-1.0, 1.0],
            [1.0, 1.0],
            [1.0, -1.0],
            [-1.0, -1.0],
        ],
        // The same, with the hole turning as the outline does.
        &[
            [-2.0, -2.0],
            [2.0, -2.0],
            [2.0, 2.0],
            [-2.0, 2.0],
            [-2.0, -2.0],
            [-1.0, -1.0],
            [1.0, -1.0],
            [1.0, 1.0],
            [-1.0, 1.0],
            [-1.0, -1.0],
        ],
        // A bow tie, and one of unequal halves.
        &[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]],
        &[[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [0.0, 2.5]],
        // A star of five strokes.
        &[[0.0, 2.0], [-1.2, -1.6], [1.9, 0.6], [-1.9, 0.6], [1.2, -1.6]],
        // A comb with corners on its edges and one twice.
        &[
            [-2.0, 0.0],
            [-1.0, 0.0],
            [0.0, 0.0],
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 2.0],
            [1.5, 0.5],
            [1.0, 2.0],
            [0.5, 0.5],
            [0.0, 2.0],
            [-0.5, 0.5],
            [-1.0, 2.0],
            [-1.5, 0.5],
            [-2.0, 2.0],
        ],
    ];

    #[test]
    fn every_point_inside_is_covered_once() {
        for shape in SHAPES {
            for first in 0..shape.len() {
                let mut turned = shape.to_vec();
                turned.rotate_left(first);
                once_inside(&polygon(&turned));
                turned.reverse();
                once_inside(&polygon(&turned));
            }
        }
        // Anything at all.
        let mut random = Stream::new([0x90, 1]);
        for corners in 4..24 {
            let mut side = || f64::from(random.range(-2.5, 2.5));
            let points: Vec<[f64; 2]> = (0..corners).map(|_| [side(), side()]).collect();
            once_inside(&polygon(&points));
        }
    }

    #[test]
    fn convex_polygons_are_fans() {
        let square = polygon(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        let own = |t: [usize; 3]| t.map(Corner::Own);
        assert_eq!(triangulate(&square), Ok(vec![own([0, 1, 2]), own([0, 2, 3])]));
        // A quad that is bent, in any plane, keeps its corners.
        let bent = [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 2.5, 2.0), DVec3::X];
        assert_eq!(triangulate(&bent), Ok(vec![own([0, 1, 2]), own([0, 2, 3])]));
        // Without area, and of too few corners.
        let line = polygon(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]);
        assert_eq!(triangulate(&line).unwrap().len(), 2);
        assert_eq!(triangulate(&line[..3]).unwrap().len(), 1);
        assert!(triangulate(&line[..2]).unwrap().is_empty());
    }

    #[test]
    fn the_best_plane_is_that_of_the_polygon() {
        // A dart in a steep plane, far from the origin: two triangles of its area.
        let turn = glam::DQuat::from_rotation_x(1.2) * glam::DQuat::from_rotation_z(0.4);
        let dart = polygon(SHAPES[0]);
        let there: Vec<DVec3> = dart.iter().map(|p| turn * *p + DVec3::splat(5e6)).collect();
        let area = |points: &[DVec3]| {
            let triangles = triangulate(points).unwrap();
            assert_eq!(triangles.len(), 2);
            let of = |t: &[Corner; 3]| {
                let [a, b, c] = t.map(|corner| place(points, corner));
                (b - a).cross(c - a)
            };
            triangles.iter().map(of).map(|n| n.length()).sum::<f64>()
        };
        assert!((area(&there) - area(&dart)).abs() < 1e-6);
        // It turns as it did.
        let [a, b, c] = triangulate(&there).unwrap()[0].map(|corner| place(&there, corner));
        assert!((b - a).cross(c - a).dot(turn * DVec3::Z) > 0.0);
    }

    #[test]
    fn what_takes_too_long_is_not_begun() {
        let mut random = Stream::new([3, 3]);
        let mut side = || f64::from(random.range(0.0, 1.0));
        let wild: Vec<[f64; 2]> = (0..20_000).map(|_| [side(), side()]).collect();
        assert_eq!(triangulate(&polygon(&wild)), Err(TooComplex));
        // Nor what takes too long together.
        let mut cutter = Cutter::default();
        let some = polygon(&wild[..200]);
        let done = (0..1000).take_while(|_| cutter.triangulate(&some).is_ok()).count();
        assert!((1..1000).contains(&done), "{done}");
        // Nor many edges side by side, though they do not cross, that run along neither axis.
        let teeth = |count: u32, turn: f64| -> Vec<DVec3> {
            let side = f64::from(count);
            let tooth = |i: u32| [f64::from(i % 2) * side, f64::from(i)];
            let mut ring: Vec<[f64; 2]> = (0..count).map(tooth).collect();
            ring.extend([[3.0 * side, side], [3.0 * side, -1.0]]);
            let turn = glam::DQuat::from_rotation_z(turn);
            polygon(&ring).into_iter().map(|p| turn * p).collect()
        };
        assert_eq!(triangulate(&teeth(20_000, 0.7)), Err(TooComplex));
        let (mut cutter, few) = (Cutter::default(), teeth(2000, 0.7));
        let done = (0..100).take_while(|_| cutter.triangulate(&few).is_ok()).count();
        assert!((1..100).contains(&done), "{done}");
        // Along an axis there is a way to sweep that keeps few.
        for turn in [0.0, std::f64::consts::FRAC_PI_2] {
            for upside_down in [false, true] {
                let mut teeth = teeth(20_000, turn);
                if upside_down {
                    teeth.reverse();
                }
                assert_eq!(triangulate(&teeth).unwrap().len(), teeth.len() - 2);
            }
        }
        // As many corners that do not cross are cut.
        let comb: Vec<[f64; 2]> = (0..20_000_u32)
            .map(|i| {
                if i < 2 {
                    [f64::from(1 - i) * 3e4, -1.0]
                } else {
                    [f64::from(i), f64::from(i % 2)]
                }
            })
            .collect();
        assert_eq!(triangulate(&polygon(&comb)).unwrap().len(), comb.len() - 2);
    }
}
