//! Opaque points in a surface (section 4.1).

use crate::capture::camera::Camera;
use crate::capture::geometry::Triangle;
use crate::capture::job::Tools;
use crate::capture::raster::Weights;
use crate::capture::screen_door::{pixels_per_unit, random};
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

/// Points, each opaque with probability alpha.
pub(in crate::capture) struct Points {
    pub seed: u32,
    /// How many there are in a square of the side 1, where that does not depend on the distance.
    pub per_area: Option<f64>,
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

    /// Draws the points that are opaque, each as one pixel. What is opaque itself is drawn as it is
    /// elsewhere.
    pub(super) fn draw(&self, triangle: &Triangle, tools: &Tools<'_>, to: &mut Vec<Fragment>) {
        let camera = tools.shader.camera;
        let wanted = self.count(triangle, camera);
        // As many rows and columns over the parallelogram of which the triangle is a half.
        let side = (2.0 * wanted - 1e-9).max(0.0).sqrt().ceil().max(1.0);
        let rows = side as u32;
        let candidates = u64::from(rows) * u64::from(rows - 1) / 2 + u64::from(rows.div_ceil(2));
        let chance = (wanted / candidates as f64).min(1.0);
        let [a, b, c] = triangle.vertices.map(|v| v.position);
        let coverage = SampleMask::first(tools.pixels.len() as u32);
        let size = tools.size.map(f64::from);
        for j in 0..rows {
            for i in 0..rows - j {
                // Those on the third edge are shared with the parallelogram's other half.
                if i + j == rows - 1 && i % 2 == 1 {
                    continue;
                }
                let (u, v) = ((f64::from(i) + 0.5) / side, (f64::from(j) + 0.5) / side);
                let at = [1.0 - u - v, u, v];
                let clip = camera.to_clip * (a * at[0] + b * at[1] + c * at[2]).extend(1.0);
                if clip.z.is_nan() || clip.z < 0.0 || clip.w <= 0.0 {
                    continue;
                }
                let x = ((clip.x / clip.w * 0.5 + 0.5) * size[0]).floor();
                let y = ((0.5 - clip.y / clip.w * 0.5) * size[1]).floor();
                if !(0.0..size[0]).contains(&x) || !(0.0..size[1]).contains(&y) {
                    continue;
                }
                let chosen = random([self.seed, triangle.primitive, i, j]);
                if chosen >= chance {
                    continue;
                }
                let weights = Weights { at, dx: [0.0; 3], dy: [0.0; 3] };
                let Some(mut shaded) = tools.shader.shade(triangle, &weights) else { continue };
                if shaded.alpha >= 1.0 || chosen >= chance * f64::from(shaded.alpha) {
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
}
