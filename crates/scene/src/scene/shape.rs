//! What a scene's objects show: meshes, strands, particles and splats.

use glam::{Mat3, Vec2, Vec3, Vec4};

use crate::scene::Splats;
use screendoor_trace::picture::Space;

/// Something to draw.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A triangle mesh.
    Mesh(Mesh),
    /// Thin ribbons that face the camera.
    Strands(Strands),
    /// Squares that face the camera, or the outlines of ellipsoids.
    Particles(Particles),
    /// Gaussians, each of which leaves a fragment a pixel.
    Splats(Splats),
}

impl Shape {
    /// How many triangles or splats it draws.
    pub fn primitive_count(&self) -> usize {
        match self {
            Shape::Mesh(mesh) => mesh.triangles.len(),
            Shape::Strands(strands) => strands.segment_count() * 2,
            Shape::Particles(particles) => particles.centres.len() * 2,
            Shape::Splats(splats) => splats.means.len(),
        }
    }

    /// What its colours are meant to be blended as.
    pub fn space(&self) -> Space {
        match self {
            Shape::Splats(splats) => splats.space,
            _ => Space::Linear,
        }
    }

    /// Which of [`materials`](crate::scene::Scene::materials) it is made of.
    pub fn material(&self) -> usize {
        match self {
            Shape::Mesh(mesh) => mesh.material,
            Shape::Strands(strands) => strands.material,
            Shape::Particles(particles) => particles.material,
            // They have colours of their own.
            Shape::Splats(_) => 0,
        }
    }

    /// Points that bound it, each with a radius around it.
    pub(super) fn bounding_points(&self) -> Box<dyn Iterator<Item = (Vec3, f32)> + '_> {
        match self {
            Shape::Mesh(mesh) => Box::new(
                mesh.triangles.iter().flatten().map(|i| (mesh.positions[*i as usize], 0.0)),
            ),
            Shape::Strands(s) => Box::new(s.points.iter().copied().zip(s.radii.iter().copied())),
            Shape::Particles(p) if p.axes.is_empty() => Box::new(
                // A square's corner is further from its centre than its side.
                p.centres.iter().copied().zip(p.sizes.iter().map(|s| s * std::f32::consts::SQRT_2)),
            ),
            // The corners of the boxes around the ellipsoids.
            Shape::Particles(p) => {
                let corner =
                    |i: u32| Vec3::from([0, 1, 2].map(|k| 1.0 - (i >> k & 1) as f32 * 2.0));
                let corners = move |(centre, axes): (&Vec3, &Mat3)| {
                    let (centre, axes) = (*centre, *axes);
                    (0..8).map(move |i| (centre + axes * corner(i), 0.0))
                };
                Box::new(p.centres.iter().zip(&p.axes).flat_map(corners))
            }
            Shape::Splats(splats) => Box::new(splats.bounding_points()),
        }
    }

    /// Those of its bounding points that a camera has in its frame: all but what lies far
    /// outside, which trained splats have a few of.
    pub(super) fn framed_points(&self) -> Box<dyn Iterator<Item = (Vec3, f32)> + '_> {
        match self {
            Shape::Splats(splats) => Box::new(splats.framed_points()),
            _ => self.bounding_points(),
        }
    }
}

/// A triangle mesh. The optional attributes are empty, or one for each position.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex normals; a mesh without them is shaded flat.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, (0, 0) at the texture's top left.
    pub uvs: Vec<Vec2>,
    /// A second set of texture coordinates.
    pub more_uvs: Vec<Vec2>,
    /// Linear colours and alphas, multiplied into the material's.
    pub colours: Vec<Vec4>,
    /// Vertex numbers, three a triangle, in API order.
    pub triangles: Vec<[u32; 3]>,
    /// Which of [`materials`](crate::scene::Scene::materials).
    pub material: usize,
}

impl Mesh {
    /// Gives corners whose normal is NaN that of their triangle, on vertices of their own. A
    /// mesh of no other normals has none.
    pub(super) fn fill_normals(&mut self) {
        if self.normals.iter().all(|n| n.is_nan()) {
            self.normals.clear();
            return;
        }
        for t in 0..self.triangles.len() {
            let corners = self.triangles[t].map(|i| i as usize);
            let [a, b, c] = corners.map(|i| self.positions[i]);
            let flat = (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::Z);
            for (k, i) in corners.into_iter().enumerate() {
                if self.normals[i].is_nan() {
                    self.triangles[t][k] = self.positions.len() as u32;
                    self.positions.push(self.positions[i]);
                    self.normals.push(flat);
                    if let Some(uv) = self.uvs.get(i).copied() {
                        self.uvs.push(uv);
                    }
                    if let Some(colour) = self.colours.get(i).copied() {
                        self.colours.push(colour);
                    }
                }
            }
        }
        // What is left without a normal is a vertex of no triangle.
        for normal in self.normals.iter_mut().filter(|n| n.is_nan()) {
            *normal = Vec3::Z;
        }
    }
}

/// Curves drawn as ribbons that face the camera.
#[derive(Clone, Debug, Default)]
pub struct Strands {
    /// Points along all curves, curve after curve.
    pub points: Vec<Vec3>,
    /// Half of the ribbon's width at each point.
    pub radii: Vec<f32>,
    /// Linear colours and alphas, one for each curve or one for each point, multiplied into the
    /// material's.
    pub colours: Vec<Vec4>,
    /// The first point of each curve, and at the end the number of points; each
    /// curve has at least two.
    pub starts: Vec<u32>,
    /// Which of [`materials`](crate::scene::Scene::materials).
    pub material: usize,
}

impl Strands {
    /// How many curves there are.
    pub fn strand_count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// How many straight pieces the curves have.
    pub fn segment_count(&self) -> usize {
        self.points.len() - self.strand_count()
    }
}

/// Squares that face the camera, or the rectangles around the outlines of ellipsoids.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    /// Centres.
    pub centres: Vec<Vec3>,
    /// Half of the side; of an ellipsoid the longest semi-axis.
    pub sizes: Vec<f32>,
    /// Turn around the axis towards the camera, in radians; empty for none.
    pub angles: Vec<f32>,
    /// Empty, or each particle is an ellipsoid that has the columns for semi-axes,
    /// and no angle.
    pub axes: Vec<Mat3>,
    /// Linear colours and alphas, multiplied into the material's.
    pub colours: Vec<Vec4>,
    /// Which of [`materials`](crate::scene::Scene::materials).
    pub material: usize,
}
