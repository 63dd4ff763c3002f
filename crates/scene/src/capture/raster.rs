//! Coverage and depth: fixed-point edge functions by the rules of Direct3D and
//! Vulkan.

use crate::capture::samples::Samples;
use crate::capture::setup::{STEPS, ScreenTriangle};
use screendoor_trace::trace::{DepthPlane, SampleMask, Unorm32};

/// One of a triangle's edges as a function that is not negative where a point
/// belongs to the triangle: `a·x + b·y + c` in sub-pixel steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub a: i64,
    pub b: i64,
    c: i64,
    /// By how much it is lowered, so that a point on it is outside: 0 or 1.
    pub lowered: i64,
    /// What it changes by at least and at most from a pixel's centre to one of its samples.
    pub spread: [i64; 2],
}

impl Edge {
    #[inline(always)]
    fn new(from: [i64; 2], to: [i64; 2], samples: &Samples) -> Self {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let (a, b) = (-dy, dx);
        // A point on the edge belongs to the triangle if the edge is a top or a
        // left one; the others are moved inwards by the least step there is.
        let top_left = dy < 0 || (dy == 0 && dx > 0);
        let lowered = i64::from(!top_left);
        let c = dy * from[0] - dx * from[1] - lowered;
        // Of the box around the samples: the corner in either direction of the slope.
        let ends = |slope: i64, [low, high]: [i64; 2]| {
            if slope < 0 { [slope * high, slope * low] } else { [slope * low, slope * high] }
        };
        let (x, y) = (ends(a, samples.reach[0]), ends(b, samples.reach[1]));
        Edge { a, b, c, lowered, spread: [x[0] + y[0], x[1] + y[1]] }
    }

    #[inline(always)]
    pub(super) fn at(&self, [x, y]: [i64; 2]) -> i64 {
        self.a * x + self.b * y + self.c
    }

    /// Narrows a row's span of pixels to those with a sample that may be inside;
    /// `y` is the row's centre.
    pub(super) fn narrow(&self, span: &mut (i64, i64), y: i64) {
        // A pixel x has its centre at x·STEPS + STEPS/2; inside means
        // slope·x + rest ≥ 0.
        let slope = self.a * STEPS;
        let rest = self.at([STEPS / 2, y]) + self.spread[1];
        if slope > 0 {
            span.0 = span.0.max(-rest.div_euclid(slope));
        } else if slope < 0 {
            span.1 = span.1.min(rest.div_euclid(-slope));
        } else if rest < 0 {
            span.1 = i64::MIN;
        }
    }
}

/// A triangle ready to be drawn, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Raster<'a> {
    pub(super) triangle: &'a ScreenTriangle,
    pub(super) samples: &'a Samples,
    /// Edges opposite to corners 0, 1 and 2.
    pub(super) edges: [Edge; 3],
    /// How the depth changes per sub-pixel step to the right and downwards.
    pub(super) depth_slopes: [f64; 2],
    pub(super) bounds: Bounds,
}

/// The pixels that a triangle may touch: the first and the last column and row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub columns: (i64, i64),
    rows: (i64, i64),
}

impl Bounds {
    /// Those whose area the triangle's bounding box touches.
    #[inline(always)]
    pub(super) fn new(triangle: &ScreenTriangle, size: [u32; 2]) -> Self {
        let range = |axis: usize, limit: u32| {
            let [a, b, c] = triangle.corners.map(|p| p[axis]);
            let low = a.min(b).min(c).div_euclid(STEPS);
            let high = a.max(b).max(c).div_euclid(STEPS);
            (low.max(0), high.min(i64::from(limit) - 1))
        };
        Bounds { columns: range(0, size[0]), rows: range(1, size[1]) }
    }

    /// The first and the last row; empty where they cross.
    pub(super) fn rows(&self) -> (i64, i64) {
        if self.columns.0 > self.columns.1 { (0, -1) } else { self.rows }
    }

    /// How many pixels there are within a row.
    pub(super) fn width(&self) -> i64 {
        self.columns.1 - self.columns.0 + 1
    }
}

/// What a triangle leaves in a pixel, before shading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub x: u16,
    pub y: u16,
    pub coverage: SampleMask,
    pub depth: DepthPlane,
    /// Where to shade, in sub-pixel steps: the pixel's centre, or the covered
    /// sample nearest to it where the triangle does not hold the centre.
    pub shade_at: [i64; 2],
}

impl<'a> Raster<'a> {
    #[inline(always)]
    pub(super) fn new(triangle: &'a ScreenTriangle, samples: &'a Samples, size: [u32; 2]) -> Self {
        let [p0, p1, p2] = triangle.corners;
        let edge = |from, to| Edge::new(from, to, samples);
        Raster {
            triangle,
            samples,
            edges: [edge(p1, p2), edge(p2, p0), edge(p0, p1)],
            depth_slopes: depth_slopes(triangle),
            bounds: Bounds::new(triangle, size),
        }
    }

    /// The first and the last row that it may touch; empty where they cross.
    pub(super) fn rows(&self) -> (i64, i64) {
        self.bounds.rows()
    }

    /// Finds the pixels of row `y` that have a covered sample, from the left. The plain text
    /// of what [`Scan`](crate::capture::scan::Scan) does in vectors.
    pub(super) fn row(&self, y: i64, mut found: impl FnMut(Hit)) {
        let centre_y = y * STEPS + STEPS / 2;
        let mut span = self.bounds.columns;
        for edge in &self.edges {
            edge.narrow(&mut span, centre_y);
        }
        for x in span.0..=span.1 {
            let centre = [x * STEPS + STEPS / 2, centre_y];
            let values = self.edges.map(|e| e.at(centre));
            let all_inside =
                self.edges.iter().zip(values).all(|(e, value)| value + e.spread[0] >= 0);
            let coverage = if all_inside { self.samples.all() } else { self.coverage(values) };
            if coverage.is_empty() {
                continue;
            }
            found(self.hit([x, y], values, coverage));
        }
    }

    /// What it leaves in pixel `[x, y]` where it covers `coverage` there, whatever its own
    /// edges say.
    pub(super) fn covered(&self, [x, y]: [i64; 2], coverage: SampleMask) -> Hit {
        let centre = [x, y].map(|v| v * STEPS + STEPS / 2);
        self.hit([x, y], self.edges.map(|e| e.at(centre)), coverage)
    }

    /// What it leaves in pixel `[x, y]`, if anything.
    pub(super) fn touched(&self, pixel: [i64; 2]) -> Option<Hit> {
        let centre = pixel.map(|v| v * STEPS + STEPS / 2);
        let values = self.edges.map(|e| e.at(centre));
        let coverage = self.coverage(values);
        (!coverage.is_empty()).then(|| self.hit(pixel, values, coverage))
    }

    /// `values` are the edges' at the pixel's centre.
    fn hit(&self, pixel: [i64; 2], values: [i64; 3], coverage: SampleMask) -> Hit {
        let centre = pixel.map(|v| v * STEPS + STEPS / 2);
        let shade_at = if values.iter().all(|v| *v >= 0) {
            centre
        } else {
            let [x, y] = self.samples.nearest(coverage);
            [centre[0] + x, centre[1] + y]
        };
        let [x, y] = pixel.map(|v| v as u16);
        Hit { x, y, coverage, depth: self.depth_plane(centre, shade_at), shade_at }
    }

    /// How far a point lies outside, in sub-pixel steps; 0 inside.
    pub(super) fn outside(&self, point: [i64; 2]) -> f64 {
        if self.edges.iter().all(|e| e.at(point) >= 0) { 0.0 } else { self.distance(point) }
    }

    /// How far a point lies from the nearest of its edges, in sub-pixel steps.
    pub(super) fn distance(&self, point: [i64; 2]) -> f64 {
        let corners = self.triangle.corners;
        let edge = |i: usize| {
            let [from, to] = [corners[i], corners[(i + 1) % 3]].map(|p| p.map(|v| v as f64));
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let (px, py) = (point[0] as f64 - from[0], point[1] as f64 - from[1]);
            let along = ((px * dx + py * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
            libm::hypot(px - along * dx, py - along * dy)
        };
        edge(0).min(edge(1)).min(edge(2))
    }

    /// The samples of a pixel for whose centre the edges have these values.
    pub(super) fn coverage(&self, values: [i64; 3]) -> SampleMask {
        let mut mask = 0;
        for (s, [x, y]) in self.samples.offsets.iter().enumerate() {
            let signs = self
                .edges
                .iter()
                .zip(values)
                .fold(0, |signs, (edge, value)| signs | (value + edge.a * x + edge.b * y));
            mask |= u64::from(signs >= 0) << s;
        }
        SampleMask(mask)
    }

    /// The triangle's depth at a point of its plane, in units of the depth range.
    fn depth_at(&self, [x, y]: [i64; 2]) -> f64 {
        let [per_x, per_y] = self.depth_slopes;
        // From a corner on: the steep planes of slivers lose too many digits over
        // the whole frame.
        let [x0, y0] = self.triangle.corners[0];
        self.triangle.depth[0] + per_x * (x - x0) as f64 + per_y * (y - y0) as f64
    }

    /// The depth's change per pixel to the right and downwards, where it can be recorded.
    #[inline(always)]
    pub(super) fn recorded_slopes(&self) -> Option<[i32; 2]> {
        let slopes = self.depth_slopes.map(|slope| (slope * STEPS as f64).round());
        let fits = slopes.iter().all(|s| s.abs() <= f64::from(i32::MAX));
        fits.then(|| slopes.map(|s| s as i32))
    }

    /// The depth over the pixel at `centre`, of which the triangle holds `inside`.
    pub(super) fn depth_plane(&self, centre: [i64; 2], inside: [i64; 2]) -> DepthPlane {
        let z = self.depth_at(centre).round();
        if let Some([dzdx, dzdy]) = self.recorded_slopes()
            && (0.0..=f64::from(u32::MAX)).contains(&z)
        {
            return DepthPlane { z: Unorm32(z as u32), dzdx, dzdy };
        }
        // A sliver's plane can leave the depth range between a covered sample and
        // the pixel's centre. Then the pixel has one depth, the triangle's own at a
        // point that it holds.
        let [z0, z1, z2] = self.triangle.depth;
        let z = self.depth_at(inside).clamp(z0.min(z1).min(z2), z0.max(z1).max(z2));
        DepthPlane { z: Unorm32(z.round() as u32), dzdx: 0, dzdy: 0 }
    }

    /// The weights of the three corners at a point, in perspective; and how they
    /// change per pixel to the right and downwards.
    pub(super) fn weights(&self, point: [i64; 2]) -> Weights {
        let t = self.triangle;
        let area = t.area as f64;
        let [p0, p1, p2] = t.corners;
        // Linear in screen space, without the tie-breaking of the coverage.
        let linear = [(p1, p2), (p2, p0), (p0, p1)].map(|(from, to)| {
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let value = dx * (point[1] - from[1]) - dy * (point[0] - from[0]);
            let step = STEPS as f64 / area;
            [value as f64 / area, -dy as f64 * step, dx as f64 * step]
        });
        let scaled: [[f64; 3]; 3] = std::array::from_fn(|i| linear[i].map(|v| v * t.inverse_w[i]));
        let sum: [f64; 3] = std::array::from_fn(|k| scaled[0][k] + scaled[1][k] + scaled[2][k]);
        let mut weights = Weights { at: [0.0; 3], dx: [0.0; 3], dy: [0.0; 3] };
        for (scaled, corner) in scaled.iter().zip(&t.weights) {
            let value = scaled[0] / sum[0];
            // The quotient rule.
            let dx = (scaled[1] - value * sum[1]) / sum[0];
            let dy = (scaled[2] - value * sum[2]) / sum[0];
            for (k, w) in corner.to_array().into_iter().enumerate() {
                weights.at[k] += value * w;
                weights.dx[k] += dx * w;
                weights.dy[k] += dy * w;
            }
        }
        weights
    }
}

/// The weights of a triangle's three vertices at a point of the frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    pub at: [f64; 3],
    /// Their change over one pixel to the right.
    pub dx: [f64; 3],
    /// Their change over one pixel downwards.
    pub dy: [f64; 3],
}

/// How a triangle's depth changes per step along x and y.
fn depth_slopes(t: &ScreenTriangle) -> [f64; 2] {
    let [p0, p1, p2] = t.corners.map(|p| p.map(|v| v as f64));
    let [z0, z1, z2] = t.depth;
    let area = t.area as f64;
    let per_x = ((z1 - z0) * (p2[1] - p0[1]) - (z2 - z0) * (p1[1] - p0[1])) / area;
    let per_y = ((z2 - z0) * (p1[0] - p0[0]) - (z1 - z0) * (p2[0] - p0[0])) / area;
    [per_x, per_y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::pattern::{PatternKind, pattern};
    use crate::capture::setup::cross;
    use glam::DVec3;
    use screendoor_trace::random::Stream;

    fn samples(count: u32) -> Samples {
        Samples::new(&pattern(PatternKind::Auto, count).unwrap().positions)
    }

    fn triangle(corners: [[i64; 2]; 3], depth: [f64; 3]) -> Option<ScreenTriangle> {
        let (mut corners, mut depth) = (corners, depth);
        let mut area = cross(corners[0], corners[1], corners[2]);
        if area < 0 {
            corners.swap(1, 2);
            depth.swap(1, 2);
            area = -area;
        }
        let weights = [DVec3::X, DVec3::Y, DVec3::Z];
        (area > 0).then_some(ScreenTriangle { corners, area, depth, inverse_w: [1.0; 3], weights })
    }

    /// How often each sample of a 16 × 16 frame is covered.
    fn count(triangles: &[[[i64; 2]; 3]], samples: &Samples) -> Vec<u32> {
        let mut counts = vec![0; 256 * samples.offsets.len()];
        for corners in triangles {
            let Some(t) = triangle(*corners, [0.0; 3]) else { continue };
            let raster = Raster::new(&t, samples, [16, 16]);
            for y in raster.rows().0..=raster.rows().1 {
                raster.row(y, |hit| {
                    let pixel = usize::from(hit.y) * 16 + usize::from(hit.x);
                    for s in hit.coverage.iter() {
                        counts[pixel * samples.offsets.len() + s] += 1;
                    }
                });
            }
        }
        counts
    }

    #[test]
    fn a_fan_around_any_point_covers_every_sample_exactly_once() {
        // A square larger than the frame, cut into triangles around a centre that
        // often lies on samples, edges and corners.
        let mut random = Stream::new([1]);
        for round in 0..300 {
            let samples = samples(1 << (round % 7));
            let grain = [1, 16, 128, 256][round % 4];
            let mut step = |low, high| i64::from(random.below((high - low) as u32)) + low;
            let centre = [step(0, 4096) / grain * grain, step(0, 4096) / grain * grain];
            let ring: Vec<[i64; 2]> = {
                let mut ring = Vec::new();
                for side in 0..4 {
                    for i in 0..4 {
                        let along = -512 + (5120 / 4) * i + step(0, 1200) / grain * grain;
                        ring.push(match side {
                            0 => [along, -512],
                            1 => [4608, along],
                            2 => [4096 - along, 4608],
                            _ => [-512, 4096 - along],
                        });
                    }
                }
                ring
            };
            let mut around = ring.clone();
            around.extend([[-512, -512], [4608, -512], [4608, 4608], [-512, 4608]]);
            around.sort_by(|a, b| {
                let angle =
                    |p: &[i64; 2]| f64::atan2((p[1] - centre[1]) as f64, (p[0] - centre[0]) as f64);
                angle(a).total_cmp(&angle(b))
            });
            let fan: Vec<_> = (0..around.len())
                .map(|i| [centre, around[i], around[(i + 1) % around.len()]])
                .collect();
            let counts = count(&fan, &samples);
            assert!(counts.iter().all(|n| *n == 1), "round {round}");
        }
    }

    #[test]
    fn coverage_is_the_definition_sample_by_sample() {
        let mut random = Stream::new([2]);
        for round in 0..2000 {
            let samples = samples(1 << (round % 7));
            let grain = [1, 128][round % 2];
            let mut point = || {
                let mut axis = || i64::from(random.below(6000)) / grain * grain - 1000;
                [axis(), axis()]
            };
            let corners = [point(), point(), point()];
            let counts = count(&[corners], &samples);
            for (i, n) in counts.iter().enumerate() {
                let (pixel, s) = (i / samples.offsets.len(), i % samples.offsets.len());
                let (x, y) = ((pixel % 16) as i64, (pixel / 16) as i64);
                let p = [
                    x * STEPS + STEPS / 2 + samples.offsets[s][0],
                    y * STEPS + STEPS / 2 + samples.offsets[s][1],
                ];
                assert_eq!(*n, u32::from(inside(corners, p)), "round {round}, {corners:?}, {p:?}");
            }
        }
    }

    /// The top-left rule, straight from its definition.
    fn inside(corners: [[i64; 2]; 3], p: [i64; 2]) -> bool {
        let Some(t) = triangle(corners, [0.0; 3]) else { return false };
        (0..3).all(|i| {
            let (from, to) = (t.corners[i], t.corners[(i + 1) % 3]);
            let value = cross(from, to, p);
            let horizontal = from[1] == to[1];
            // With y downwards and a positive area, edges run clockwise: a top edge
            // runs right, a left edge runs up.
            let top = horizontal && to[0] > from[0];
            let left = to[1] < from[1];
            value > 0 || (value == 0 && (top || left))
        })
    }

    #[test]
    fn depth_is_the_plane_through_the_corners() {
        let samples = samples(16);
        let mut random = Stream::new([3]);
        for _ in 0..200 {
            let corners = std::array::from_fn(|_| {
                [i64::from(random.below(4096)), i64::from(random.below(4096))]
            });
            let depth = std::array::from_fn(|_| f64::from(random.word() >> 1));
            let Some(t) = triangle(corners, depth).filter(|t| t.area > 1 << 20) else { continue };
            let raster = Raster::new(&t, &samples, [16, 16]);
            for y in 0..16 {
                raster.row(y, |hit| {
                    let centre = [i64::from(hit.x) * STEPS + 128, i64::from(hit.y) * STEPS + 128];
                    let w = raster.weights(centre).at;
                    let exact: f64 = (0..3).map(|i| w[i] * t.depth[i]).sum();
                    if (0.0..4e9).contains(&exact) {
                        let error = f64::from(hit.depth.z.0) - exact;
                        assert!(error.abs() < 1.0, "{error}");
                        // Samples follow the plane to within the slopes' rounding.
                        for s in hit.coverage.iter() {
                            let o = samples.offsets[s];
                            let at = raster.weights([centre[0] + o[0], centre[1] + o[1]]).at;
                            let exact: f64 = (0..3).map(|i| at[i] * t.depth[i]).sum();
                            let sixteenths = o.map(|v| (v * 16 / STEPS) as i8);
                            let error = f64::from(hit.depth.at(sixteenths).0) - exact;
                            assert!(error.abs() < 2.5, "{error}");
                        }
                    }
                });
            }
        }
    }

    #[test]
    fn slivers_stay_within_their_depths() {
        let samples = samples(16);
        let mut random = Stream::new([4]);
        let (mut flat, mut all) = (0, 0);
        for _ in 0..4000 {
            // Long and thin, over a small range of depths.
            let start = [i64::from(random.below(4096)), i64::from(random.below(4096))];
            let mut near = |reach: u32| {
                start.map(|v| v + i64::from(random.below(2 * reach)) - i64::from(reach))
            };
            let corners = [start, near(2000), near(12)];
            let nearest = f64::from(random.word());
            let depth = std::array::from_fn(|_| {
                (nearest + f64::from(random.below(1 << 26))).min(f64::from(u32::MAX))
            });
            let Some(t) = triangle(corners, depth) else { continue };
            let raster = Raster::new(&t, &samples, [16, 16]);
            let range = |pick: fn(f64, f64) -> f64| t.depth.into_iter().reduce(pick).unwrap();
            let (low, high) = (range(f64::min), range(f64::max));
            for y in raster.rows().0..=raster.rows().1 {
                raster.row(y, |hit| {
                    all += 1;
                    flat += u32::from((hit.depth.dzdx, hit.depth.dzdy) == (0, 0));
                    for s in hit.coverage.iter() {
                        let at = hit.depth.at(samples.offsets[s].map(|v| (v * 16 / STEPS) as i8));
                        let at = f64::from(at.0);
                        assert!(at > low - 2.0 && at < high + 2.0, "{at} of {low} to {high}");
                    }
                });
            }
        }
        assert!(flat > 100 && all > 4 * flat, "{flat} of {all} are flat");
    }
}
