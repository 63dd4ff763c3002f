//! The scene as a list of triangles and splats, each made when it is asked for.

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};

use crate::capture::camera::Camera;
use crate::scene::{Mesh, Particles, Scene, Shape, Splats, Strands};

/// A vertex as the rasteriser and the shader need it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// In the scene's space.
    pub position: DVec3,
    /// Not necessarily of unit length.
    pub normal: Vec3,
    /// The two sets of texture coordinates.
    pub uvs: [Vec2; 2],
    pub colour: Vec4,
}

/// One triangle of the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub vertices: [Vertex; 3],
    pub material: usize,
    pub object: u32,
    pub primitive: u32,
}

/// A splat of the scene.
#[derive(Clone, Copy)]
pub(crate) struct Splat<'a> {
    pub splats: &'a Splats,
    /// Which of them.
    pub index: usize,
    pub object: u32,
    pub primitive: u32,
}

/// What is drawn at a time.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
pub(crate) enum Primitive<'a> {
    Triangle(Triangle),
    Splat(Splat<'a>),
}

/// The scene's triangles and splats, numbered through in API order.
pub(crate) struct Geometry<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    /// The number of each object's first primitive, and at the end the total.
    starts: Vec<u32>,
    places: Vec<Placement>,
}

impl<'a> Geometry<'a> {
    pub(super) fn new(scene: &'a Scene, camera: &'a Camera) -> Self {
        let mut starts = vec![0];
        for object in &scene.objects {
            // Scenes with more than 2^32 of them are refused on loading.
            let count = scene.shapes[object.shape].primitive_count() as u32;
            starts.push(starts.last().expect("never empty") + count);
        }
        let places = scene.objects.iter().map(|o| Placement::new(o.place)).collect();
        Geometry { scene, camera, starts, places }
    }

    /// How many primitives there are.
    pub(super) fn len(&self) -> u32 {
        *self.starts.last().expect("never empty")
    }

    /// The primitives of an object.
    pub(super) fn of_object(&self, object: usize) -> std::ops::Range<u32> {
        self.starts[object]..self.starts[object + 1]
    }

    /// Primitive `primitive`.
    pub(super) fn primitive(&self, primitive: u32) -> Primitive<'a> {
        let index = self.starts.partition_point(|start| *start <= primitive) - 1;
        let object = &self.scene.objects[index];
        let local = primitive - self.starts[index];
        let shape = &self.scene.shapes[object.shape];
        let vertices = match shape {
            Shape::Mesh(mesh) => mesh_triangle(mesh, local, &self.places[index]),
            Shape::Strands(strands) => {
                strand_triangle(strands, local, &self.places[index], self.camera)
            }
            Shape::Particles(particles) => {
                particle_triangle(particles, local, &self.places[index], self.camera)
            }
            Shape::Splats(splats) => {
                let (index, object) = (local as usize, index as u32);
                return Primitive::Splat(Splat { splats, index, object, primitive });
            }
        };
        let (material, object) = (shape.material(), index as u32);
        Primitive::Triangle(Triangle { vertices, material, object, primitive })
    }

    /// The middle of a primitive.
    pub(super) fn middle(&self, primitive: u32) -> DVec3 {
        match self.primitive(primitive) {
            Primitive::Triangle(triangle) => {
                let [a, b, c] = triangle.vertices.map(|v| v.position);
                (a + b + c) / 3.0
            }
            Primitive::Splat(Splat { splats, index, object, .. }) => {
                let place = &self.scene.objects[object as usize].place;
                place.transform_point3(splats.means[index].as_dvec3())
            }
        }
    }
}

/// Where an object's mesh stands in the scene.
struct Placement {
    points: DAffine3,
    normals: DMat3,
    /// What lengths are multiplied by, on average over the directions.
    scale: f64,
    /// A mirrored mesh winds the other way round (glTF 2.0, section 3.7.4).
    mirrored: bool,
}

impl Placement {
    fn new(points: DAffine3) -> Self {
        let m = points.matrix3;
        let mirrored = m.determinant() < 0.0;
        let sign = if mirrored { -1.0 } else { 1.0 };
        // Normals turn by the inverse transpose; the cofactor matrix is that times
        // the determinant and exists for flat objects too.
        let normals = DMat3::from_cols(
            m.y_axis.cross(m.z_axis) * sign,
            m.z_axis.cross(m.x_axis) * sign,
            m.x_axis.cross(m.y_axis) * sign,
        );
        let scale = m.determinant().abs().cbrt();
        Placement { points, normals, scale, mirrored }
    }
}

fn mesh_triangle(mesh: &Mesh, local: u32, place: &Placement) -> [Vertex; 3] {
    let mut corners = mesh.triangles[local as usize].map(|i| i as usize);
    if place.mirrored {
        corners.swap(1, 2);
    }
    let positions = corners.map(|i| place.points.transform_point3(mesh.positions[i].as_dvec3()));
    let flat = || (positions[1] - positions[0]).cross(positions[2] - positions[0]).as_vec3();
    std::array::from_fn(|k| {
        let i = corners[k];
        Vertex {
            position: positions[k],
            normal: match mesh.normals.get(i) {
                Some(n) => (place.normals * n.as_dvec3()).as_vec3(),
                None => flat(),
            },
            uvs: [&mesh.uvs, &mesh.more_uvs].map(|uvs| uvs.get(i).copied().unwrap_or(Vec2::ZERO)),
            colour: mesh.colours.get(i).copied().unwrap_or(Vec4::ONE),
        }
    })
}

/// How far the normals at a ribbon's edges lean outwards: it is shaded as a thin
/// cylinder would be.
const RIBBON_ROUNDNESS: f64 = 0.9;

fn strand_triangle(
    strands: &Strands,
    local: u32,
    place: &Placement,
    camera: &Camera,
) -> [Vertex; 3] {
    // Segment `s` of curve `c` has the number starts[c] − c + s.
    let segment = local / 2;
    let curve = partition(strands.strand_count(), |c| strands.starts[c] - c as u32 <= segment) - 1;
    let (first, end) = (strands.starts[curve] as usize, strands.starts[curve + 1] as usize);
    let point = segment as usize + curve;
    let at = |i: usize| place.points.transform_point3(strands.points[i].as_dvec3());
    let scale = place.scale;
    // Curves have two points at least, so that it is clear which of both there is one for.
    let own = |i: usize| if strands.colours.len() == strands.points.len() { i } else { curve };
    // A point, which way its ribbon goes and to where it is seen from, and its width.
    let joint = |i: usize| {
        // The curve's direction at a joint: from the point before to the point after.
        let along = at((i + 1).min(end - 1)) - at(i.max(first + 1) - 1);
        let towards = camera.towards(at(i));
        let across = along.cross(towards).normalize_or(camera.right);
        (i, at(i), across, towards, f64::from(strands.radii[i]) * scale)
    };
    let vertex =
        |(i, at, across, towards, width): (usize, DVec3, DVec3, DVec3, f64), side: f64| Vertex {
            position: at + across * (side * width),
            normal: (towards + across * (side * RIBBON_ROUNDNESS)).as_vec3(),
            uvs: [Vec2::new(side as f32 * 0.5 + 0.5, (i - first) as f32 / (end - 1 - first) as f32);
                2],
            colour: strands.colours.get(own(i)).copied().unwrap_or(Vec4::ONE),
        };
    let (low, high) = (joint(point), joint(point + 1));
    if local.is_multiple_of(2) {
        [vertex(low, -1.0), vertex(low, 1.0), vertex(high, 1.0)]
    } else {
        [vertex(low, -1.0), vertex(high, 1.0), vertex(high, -1.0)]
    }
}

/// The outline of an ellipsoid with the columns of `axes` for semi-axes, on the plane
/// through its centre that faces the camera, seen from `towards`: how its longer axis
/// is turned from the camera's right, in radians, and its two semi-axes. From near by
/// the outline is no ellipse; what stands here is its affine approximation (Zwicker et
/// al. 2001, EWA volume splatting).
fn outline(axes: &DMat3, camera: &Camera, towards: DVec3) -> (f64, [f64; 2]) {
    // What lies beside the camera is nearly on edge, and out of sight.
    let ahead = towards.dot(camera.back).max(0.1);
    let seen = |axis: DVec3| axes.transpose() * (axis - camera.back * (axis.dot(towards) / ahead));
    let (right, up) = (seen(camera.right), seen(camera.up));
    // The quadratic form of the outline, and its eigenvalues.
    let [a, b, c] = [right.dot(right), right.dot(up), up.dot(up)];
    let (mean, half) = ((a + c) / 2.0, (a - c) / 2.0);
    let spread = libm::hypot(half, b);
    (libm::atan2(b, half) / 2.0, [mean + spread, (mean - spread).max(0.0)].map(f64::sqrt))
}

/// How many of 0..`count` come before the first that does not hold.
fn partition(count: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low.midpoint(high);
        if holds(middle) { low = middle + 1 } else { high = middle }
    }
    low
}

fn particle_triangle(
    particles: &Particles,
    local: u32,
    place: &Placement,
    camera: &Camera,
) -> [Vertex; 3] {
    let i = local as usize / 2;
    let centre = place.points.transform_point3(particles.centres[i].as_dvec3());
    let (angle, size) = match particles.axes.get(i) {
        Some(axes) => {
            outline(&(place.points.matrix3 * axes.as_dmat3()), camera, camera.towards(centre))
        }
        None => {
            let size = f64::from(particles.sizes[i]) * place.scale;
            (particles.angles.get(i).map_or(0.0, |a| f64::from(*a)), [size; 2])
        }
    };
    let (sin, cos) = libm::sincos(angle);
    let (x_axis, y_axis) =
        (camera.right * cos + camera.up * sin, camera.up * cos - camera.right * sin);
    let corner = |x: f64, y: f64| Vertex {
        position: centre + x_axis * (x * size[0]) + y_axis * (y * size[1]),
        // Bulging towards the camera, as a puff of smoke would.
        normal: (camera.back + (x_axis * x + y_axis * y) * 0.7).as_vec3(),
        uvs: [Vec2::new(x as f32 * 0.5 + 0.5, 0.5 - y as f32 * 0.5); 2],
        colour: particles.colours.get(i).copied().unwrap_or(Vec4::ONE),
    };
    if local.is_multiple_of(2) {
        [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)]
    } else {
        [corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partition_finds_the_boundary() {
        for boundary in 0..10 {
            assert_eq!(partition(9, |i| i < boundary), boundary.min(9));
        }
    }

    #[test]
    fn ellipsoids_are_seen_as_their_outlines() {
        // From the front, along parallel lines.
        let scene = crate::scene::load("builtin:ramps").unwrap();
        let camera =
            Camera::frame(&scene, &Default::default(), &Default::default(), [8, 8]).unwrap();
        let seen = |axes: DMat3, towards| outline(&axes, &camera, towards);
        let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12;
        let ball = DMat3::from_diagonal(DVec3::splat(2.0));
        assert!(close(seen(ball, DVec3::Z).1, [2.0, 2.0]));
        // Depth does not show, and the longer axis comes first.
        let long = DMat3::from_diagonal(DVec3::new(1.0, 3.0, 9.0));
        let (angle, axes) = seen(long, DVec3::Z);
        assert!(
            close(axes, [3.0, 1.0]) && (angle.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-4,
            "{angle}"
        );
        let (angle, axes) = seen(DMat3::from_rotation_z(0.5) * long, DVec3::Z);
        assert!(close(axes, [3.0, 1.0]));
        assert!(((angle - 0.5).abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-4, "{angle}");
        // From a third aside, what is deep reaches a third as far to the side.
        let (_, axes) = seen(
            DMat3::from_diagonal(DVec3::new(0.0, 1.0, 9.0)),
            DVec3::new(1.0, 0.0, 3.0).normalize(),
        );
        assert!(close(axes, [3.0, 1.0]));
    }

    #[test]
    fn a_mirrored_object_keeps_its_outside() {
        let place = Placement::new(DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        assert_eq!(place.normals * DVec3::X, -DVec3::X);
        assert_eq!(place.normals * DVec3::Z, DVec3::Z);
        // A triangle that faces +z, without normals of its own.
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let [a, b, c] = mesh_triangle(&mesh, 0, &place);
        assert!((b.position - a.position).cross(c.position - a.position).z > 0.0);
        assert_eq!(a.normal, Vec3::Z);
    }
}
