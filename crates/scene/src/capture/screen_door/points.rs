//! Opaque points in a surface (section 4.1).

use crate::capture::camera::Camera;
use crate::capture::geometry::Triangle;
use crate::capture::job::Tools;
use crate::capture::raster::Weights;
use crate::capture::screen_door::{pixels_per_unit, random};
use crate::capture::setup::Pieces;
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

/// Points that a triangle may have at most.
pub(super) const MOST_POINTS: f64 = (1 << 24) as f64;

/// Points, each opaque with probability alpha.
pub(in crate::capture) struct Points {
    pub seed: u32,
    /// How many there are in a square of the side 1, where that does not depend on the distance.
    pub per_area: Option<f64>,
}

/// Where points may lie: the middles of even cells over the parallelogram of which a triangle is the
/// half before its third edge.
struct Grid {
    /// The vertex that is the origin, the first edge's end, and the second's.
    order: [usize; 3],
    columns: u64,
    rows: u64,
}

impl Grid {
    /// One of at least `count` cells on the triangle, about as wide as they are high. The origin is
    /// opposite to the longest edge, where the two others are nearest to a right angle.
    fn new(triangle: &Triangle, count: f64) -> Self {
        let at = triangle.vertices.map(|v| v.position);
        let opposite = |i: usize| at[(i + 1) % 3].distance(at[(i + 2) % 3]);
        let first = (1..3).fold(0, |best, i| if opposite(i) > opposite(best) { i } else { best });
        let order = [first, (first + 1) % 3, (first + 2) % 3];
        let ratio = opposite(order[2]) / opposite(order[1]);
        // Edges of no length, and slivers thinner than any number, have no ratio.
        let ratio = if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 };
        let cells = |ratio: f64| {
            let wanted = (2.0 * count * ratio).sqrt();
            (wanted - 1e-9).ceil().clamp(1.0, MOST_POINTS) as u64
        };
        Grid { order, columns: cells(ratio), rows: cells(1.0 / ratio) }
    }

    /// The columns of row `j` whose middles are on the triangle. Of those on the third edge, which it
    /// shares with the parallelogram's other half, it has every other one.
    fn row(&self, j: u64) -> std::ops::Range<u64> {
        // Column i is there where (2i + 1)·rows is at most this.
        let reach = self.columns * (2 * (self.rows - j) - 1);
        let steps = reach / self.rows;
        let end = steps.div_ceil(2);
        let on_edge = reach.is_multiple_of(self.rows) && !steps.is_multiple_of(2);
        0..if on_edge && end.is_multiple_of(2) { end - 1 } else { end }
    }

    fn len(&self) -> u64 {
        (0..self.rows).map(|j| self.row(j).end).sum()
    }

    /// The weights of the triangle's vertices in the middle of a cell.
    fn weights(&self, i: u64, j: u64) -> [f64; 3] {
        let middle = |place: u64, of: u64| (place as f64 + 0.5) / of as f64;
        let (u, v) = (middle(i, self.columns), middle(j, self.rows));
        let mut weights = [0.0; 3];
        for (vertex, weight) in self.order.into_iter().zip([1.0 - u - v, u, v]) {
            weights[vertex] = weight;
        }
        weights
    }
}

impl Points {
    /// n: how many points a triangle has (section 4.1.1). The distance is that of its middle along
    /// the view axis, so that a triangle that is turned to be parallel to the frame has a point a pixel.
    pub(super) fn count(&self, triangle: &Triangle, camera: &Camera) -> f64 {
        let [a, b, c] = triangle.vertices.map(|v| v.position);
        let area = (b - a).cross(c - a).length() / 2.0;
        let per_area = self.per_area.unwrap_or_else(|| pixels_per_unit(triangle, camera).powi(2));
        let count = area * per_area;
        // What has no area has no points, however near.
        if count.is_nan() { 0.0 } else { count }
    }

    /// Draws the points of a triangle that are opaque, each as one pixel.
    pub(super) fn draw(
        &self,
        triangle: &Triangle,
        pieces: &Pieces,
        tools: &Tools<'_>,
        to: &mut Vec<Fragment>,
    ) {
        if !tools.shader.may_let_through(triangle.material) {
            return;
        }
        let camera = tools.shader.camera;
        let wanted = self.count(triangle, camera);
        let grid = Grid::new(triangle, wanted);
        let chance = (wanted / grid.len() as f64).min(1.0);
        let [a, b, c] = triangle.vertices.map(|v| v.position);
        let coverage = SampleMask::first(tools.pixels.len() as u32);
        let size = tools.size.map(f64::from);
        for (j, i) in (0..grid.rows).flat_map(|j| grid.row(j).map(move |i| (j, i))) {
            let chosen = random([self.seed, triangle.primitive, i as u32, j as u32]);
            if chosen >= chance {
                continue;
            }
            let at = grid.weights(i, j);
            let clip = camera.to_clip * (a * at[0] + b * at[1] + c * at[2]).extend(1.0);
            if clip.z.is_nan() || clip.z < 0.0 || clip.w <= 0.0 {
                continue;
            }
            let x = ((clip.x / clip.w * 0.5 + 0.5) * size[0]).floor();
            let y = ((0.5 - clip.y / clip.w * 0.5) * size[1]).floor();
            if !(0.0..size[0]).contains(&x) || !(0.0..size[1]).contains(&y) {
                continue;
            }
            let weights = Weights { at, dx: [0.0; 3], dy: [0.0; 3] };
            let Some(mut shaded) = tools.shader.shade(triangle, &weights) else { continue };
            if chosen >= chance * f64::from(shaded.alpha) {
                continue;
            }
            // What is opaque has been drawn, unless its pixel as a whole is not.
            if shaded.alpha >= 1.0 && !is_cut(triangle, pieces, tools, [x as i64, y as i64]) {
                continue;
            }
            shaded.alpha = 1.0;
            let z = (clip.z / clip.w).clamp(0.0, 1.0) * f64::from(u32::MAX);
            let mut fragment = Fragment {
                x: x as u16,
                y: y as u16,
                coverage,
                depth: DepthPlane { z: Unorm32(z.round() as u32), dzdx: 0, dzdy: 0 },
                primitive: triangle.primitive,
                object: triangle.object,
                ..Fragment::default()
            };
            shaded.put(&mut fragment);
            to.push(fragment);
        }
    }
}

/// Whether a triangle's fragment in a pixel lets light through, so that points are drawn in its place.
fn is_cut(triangle: &Triangle, pieces: &Pieces, tools: &Tools<'_>, pixel: [i64; 2]) -> bool {
    pieces.iter().any(|piece| {
        let raster = tools.raster(piece);
        let hit = raster.touched(pixel);
        let shaded = hit.map(|hit| tools.shader.shade(triangle, &raster.weights(hit.shade_at)));
        shaded.is_some_and(|shaded| shaded.is_none_or(|shaded| shaded.alpha < 1.0))
    })
}
