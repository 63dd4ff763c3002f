//! Fragments whose coverage another rasteriser has found: depth and colour are ours.

use glam::{DVec3, DVec4};

use crate::capture::geometry::{Geometry, Primitive, Triangle};
use crate::capture::raster::{Raster, Weights};
use crate::capture::samples::Samples;
use crate::capture::setup::Pieces;
use crate::capture::setup::STEPS;
use crate::capture::shade::Shader;
use crate::capture::{Capture, order};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, SamplePattern};

/// A capture's triangles in drawing order, for another rasteriser to draw.
pub struct Drawing<'a> {
    capture: &'a Capture<'a>,
    geometry: Geometry<'a>,
    shader: Shader<'a>,
    order: Option<Vec<u32>>,
}

/// A triangle of a [`Drawing`], set up on our grid.
pub struct SetUp<'a> {
    drawing: &'a Drawing<'a>,
    triangle: Triangle,
    /// What clipping left of it.
    pieces: Pieces,
    samples: Samples,
}

impl Capture<'_> {
    /// What it draws, for another rasteriser.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a scene with splats, which are no triangles.
    pub fn drawing(&self) -> Result<Drawing<'_>> {
        if self.scene.has_splats() {
            let hint = "leave --gpu out";
            let what = "Gaussian splats are drawn by our own rasteriser alone";
            return Err(Error::unsupported(&self.scene.source, what, hint));
        }
        let geometry = Geometry::new(self.scene, &self.camera);
        let (kind, seed) = (self.options.order, self.options.order_seed);
        let order = order::drawing_order(kind, seed, &geometry, &self.camera);
        let shader = self.shader();
        Ok(Drawing { capture: self, geometry, shader, order })
    }

    /// Says that samples lie where `pattern` has them, and who found the coverage.
    pub fn drawn_by(&mut self, rasteriser: &str, pattern: SamplePattern) {
        self.header.pattern = pattern;
        self.header.source.push_str(&format!(", drawn by {rasteriser}"));
    }
}

impl Drawing<'_> {
    /// How many triangles there are.
    pub fn triangles(&self) -> usize {
        self.geometry.len() as usize
    }

    /// The number in the scene of the `i`-th triangle to be drawn.
    fn number(&self, i: usize) -> u32 {
        self.order.as_ref().map_or(i as u32, |order| order[i])
    }

    /// The corners of the `i`-th triangle in clip space, and whether it is drawn where it
    /// shows its back.
    pub fn corners(&self, i: usize) -> ([DVec4; 3], bool) {
        let triangle = self.triangle(i);
        let to_clip = self.capture.camera.to_clip;
        let corners = triangle.vertices.map(|v| to_clip * v.position.extend(1.0));
        (corners, self.capture.keeps_back(&triangle, &self.shader))
    }

    /// The `i`-th triangle on our own grid, for samples at `positions`.
    pub fn set_up(&self, i: usize, positions: &[[i8; 2]]) -> SetUp<'_> {
        let triangle = self.triangle(i);
        let pieces = self.capture.set_up(&triangle, &self.shader);
        SetUp { drawing: self, triangle, pieces, samples: Samples::new(positions) }
    }

    fn triangle(&self, i: usize) -> Triangle {
        match self.geometry.primitive(self.number(i)) {
            Primitive::Triangle(triangle) => triangle,
            Primitive::Splat(_) => unreachable!("a scene with splats has no such drawing"),
        }
    }
}

impl SetUp<'_> {
    fn rasters(&self) -> impl Iterator<Item = Raster<'_>> {
        let options = self.drawing.capture.options;
        let size = [options.width, options.height];
        self.pieces.iter().map(move |piece| Raster::new(piece, &self.samples, size))
    }

    /// Whether nothing is left of it on our grid.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether clipping has cut it.
    pub fn is_clipped(&self) -> bool {
        let corner = |w: &DVec3| w.max_element() == 1.0;
        !self.pieces.iter().all(|piece| piece.weights.iter().all(corner))
    }

    /// The fragment of pixel `[x, y]` where the triangle covers `coverage` there. `depth` is
    /// the other rasteriser's, for a triangle that has no area on our grid. `None` where
    /// shading leaves nothing.
    pub fn fragment(
        &self,
        [x, y]: [u16; 2],
        coverage: SampleMask,
        depth: DepthPlane,
    ) -> Option<Fragment> {
        let pixel = [x, y].map(i64::from);
        let centre = pixel.map(|v| v * STEPS + STEPS / 2);
        // Of a triangle that clipping has cut, the piece that is nearest: they all lie in
        // one plane.
        let rasters = self.rasters().map(|raster| (raster.outside(centre), raster));
        let nearest = rasters.min_by(|a, b| a.0.total_cmp(&b.0));
        let (depth, weights) = match nearest {
            Some((_, raster)) => {
                let hit = raster.covered(pixel, coverage);
                (hit.depth, raster.weights(hit.shade_at))
            }
            None => (depth, Weights { at: [1.0 / 3.0; 3], dx: [0.0; 3], dy: [0.0; 3] }),
        };
        let triangle = &self.triangle;
        let (primitive, object) = (triangle.primitive, triangle.object);
        let mut fragment =
            Fragment { x, y, coverage, depth, primitive, object, ..Fragment::default() };
        self.drawing.shader.shade(triangle, &weights)?.put(&mut fragment);
        Some(fragment)
    }

    /// What our own rasteriser finds: pixels, what is covered of each and the depth there.
    /// A pixel that several pieces of the triangle touch comes once for each.
    pub fn draw(&self, mut found: impl FnMut([u16; 2], SampleMask, DepthPlane)) {
        for raster in self.rasters() {
            let (first, last) = raster.rows();
            for y in first..=last {
                raster.row(y, |hit| found([hit.x, hit.y], hit.coverage, hit.depth));
            }
        }
    }

    /// How far a sample of a pixel lies from the nearest edge, in sub-pixel steps.
    pub fn distance(&self, [x, y]: [u16; 2], sample: usize) -> f64 {
        let at = |v: u16, o: i64| i64::from(v) * STEPS + STEPS / 2 + o;
        let [dx, dy] = self.samples.offsets[sample];
        let point = [at(x, dx), at(y, dy)];
        self.rasters().map(|raster| raster.distance(point)).fold(f64::INFINITY, f64::min)
    }
}
