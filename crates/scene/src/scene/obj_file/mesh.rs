//! Meshes of what an OBJ file defines.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::geometry::{Face, Geometry};
use crate::scene::polygon::{Corner, Cutter};
use crate::scene::{Mesh, Strands, far};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::picture::srgb;

/// Makes meshes of a file's faces.
pub(super) struct Builder<'a> {
    place: &'a str,
    geometry: &'a Geometry,
    /// Linear.
    colours: Vec<Vec4>,
    /// What is subtracted from all places.
    pub origin: DVec3,
    /// Faces of smoothing groups that have no normals.
    pub flat: usize,
    cutter: Cutter,
}

impl<'a> Builder<'a> {
    /// One for the file called `place`.
    pub(super) fn new(place: &'a str, geometry: &'a Geometry) -> Self {
        let vertices = geometry.corners.iter().map(|c| c[0]).chain(geometry.along.iter().copied());
        let used = vertices.map(|vertex| geometry.positions[vertex as usize - 1]);
        let linear = |c: f32| srgb::decode(f64::from(c.clamp(0.0, 1.0))) as f32;
        let colour = |c: &Vec4| c.truncate().map(linear).extend(c.w.clamp(0.0, 1.0));
        Builder {
            place,
            geometry,
            colours: geometry.colours.iter().map(colour).collect(),
            origin: far::origin(used),
            flat: 0,
            cutter: Cutter::default(),
        }
    }

    /// The curves of the lines from `first` to before `end`, which have no width yet.
    pub(super) fn lines(&self, first: usize, end: usize) -> Strands {
        let geometry = self.geometry;
        let mut strands = Strands::default();
        let mut start = first.checked_sub(1).map_or(0, |before| geometry.lines[before].0);
        for (behind, _) in &geometry.lines[first..end] {
            let along = geometry.along[start..*behind].iter().map(|v| *v as usize - 1);
            start = *behind;
            let place = |v: usize| (geometry.positions[v] - self.origin).as_vec3();
            let points: Vec<Vec3> = along.clone().map(place).collect();
            let colours: Vec<Vec4> = along.filter_map(|v| self.colours.get(v).copied()).collect();
            strands.add_line(&points, &colours);
        }
        strands
    }

    /// The mesh of the faces from `first` to before `end`.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a polygon that is too complex.
    pub(super) fn mesh(&mut self, first: usize, end: usize) -> Result<Mesh> {
        let mut mesh = Mesh::default();
        let mut known = HashMap::new();
        let faces = &self.geometry.faces;
        let mut start = first.checked_sub(1).map_or(0, |before| faces[before].end);
        let mut points = Vec::new();
        for face in &faces[first..end] {
            let corners = &self.geometry.corners[start..face.end];
            start = face.end;
            self.flat += usize::from(face.smooth && corners.iter().any(|c| c[2] == 0));
            points.clear();
            points.extend(corners.iter().map(|c| self.geometry.positions[c[0] as usize - 1]));
            let triangles = self.cutter.triangulate(&points);
            for triangle in triangles.map_err(|_| self.too_complex(face, corners))? {
                let triangle = triangle.map(|corner| match corner {
                    Corner::Own(i) => *known
                        .entry(corners[i])
                        .or_insert_with(|| self.vertex(&mut mesh, corners[i])),
                    Corner::OnEdge(i, share) => {
                        let ends = [i, (i + 1) % corners.len()].map(|i| corners[i]);
                        self.crossing(&mut mesh, ends, share)
                    }
                });
                mesh.triangles.push(triangle);
            }
        }
        Ok(filled(mesh))
    }

    fn too_complex(&self, face: &Face, corners: &[[u32; 3]]) -> Error {
        let place = format!("{}, line {}", self.place, face.line);
        let what = format!(
            "a face of {} corners that is not convex or, with those before, takes too long to cut",
            corners.len()
        );
        Error::unsupported(place, what, "divide it into polygons of fewer corners")
    }

    /// Adds a vertex for a corner; its number. What the corner does not say is NaN.
    fn vertex(&self, mesh: &mut Mesh, [v, vt, vn]: [u32; 3]) -> u32 {
        let geometry = self.geometry;
        let [v, vt, vn] = [v, vt, vn].map(|i| (i as usize).wrapping_sub(1));
        mesh.positions.push((geometry.positions[v] - self.origin).as_vec3());
        mesh.uvs.push(geometry.uvs.get(vt).copied().unwrap_or(Vec2::NAN));
        mesh.normals.push(geometry.normals.get(vn).copied().unwrap_or(Vec3::NAN));
        mesh.colours.extend(self.colours.get(v));
        mesh.positions.len() as u32 - 1
    }

    /// Adds a vertex on the edge between two corners; its number.
    fn crossing(&self, mesh: &mut Mesh, ends: [[u32; 3]; 2], share: f64) -> u32 {
        let mut between = Mesh::default();
        for corner in ends {
            self.vertex(&mut between, corner);
        }
        let t = share as f32;
        let [a, b] = ends.map(|c| self.geometry.positions[c[0] as usize - 1]);
        mesh.positions.push((a.lerp(b, share) - self.origin).as_vec3());
        mesh.uvs.push(between.uvs[0].lerp(between.uvs[1], t));
        mesh.normals.push(between.normals[0].lerp(between.normals[1], t));
        if let [a, b] = between.colours[..] {
            mesh.colours.push(a.lerp(b, t));
        }
        mesh.positions.len() as u32 - 1
    }
}

/// The mesh with what its corners do not say filled in.
fn filled(mut mesh: Mesh) -> Mesh {
    if mesh.uvs.iter().all(|uv| uv.is_nan()) {
        mesh.uvs.clear();
    }
    for uv in &mut mesh.uvs {
        let given = if uv.is_nan() { Vec2::ZERO } else { *uv };
        // OBJ counts v upwards.
        *uv = Vec2::new(given.x, 1.0 - given.y);
    }
    mesh.fill_normals();
    mesh
}
