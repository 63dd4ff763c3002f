//! Whether a scene can be drawn.

use glam::{DVec3, Vec3};

use crate::scene::{Mesh, Scene, Shape};
use screendoor_trace::error::{Error, Result};

impl Scene {
    /// Checks that the scene can be drawn: indices in range, numbers finite,
    /// something there at all.
    pub(super) fn check(&mut self) -> Result<()> {
        let source = &self.source;
        // First, since a small file can name a shape very often.
        if u32::try_from(self.primitive_count()).is_err() {
            let hint = "split the scene";
            return Err(Error::unsupported(
                source,
                "it has more than 2^32 triangles and splats",
                hint,
            ));
        }
        let mut checked = vec![false; self.shapes.len()];
        for object in &self.objects {
            let place = format!("{source}, object '{}'", object.name);
            if !object.place.is_finite() {
                let hint = "correct its transformation";
                return Err(Error::invalid(place, "it stands at no finite place", hint));
            }
            // A shape that several objects show is looked at once.
            if std::mem::replace(&mut checked[object.shape], true) {
                continue;
            }
            match &self.shapes[object.shape] {
                Shape::Mesh(mesh) => check_mesh(mesh, &place)?,
                Shape::Strands(s) => check_points(&s.points, &place)?,
                Shape::Particles(p) => check_points(&p.centres, &place)?,
                Shape::Splats(splats) => check_points(&splats.means, &place)?,
            }
        }
        if self.primitive_count() == 0 {
            let hint = "give a scene with at least one triangle";
            // What was left out may be all there is.
            let what = match &self.warnings[..] {
                [] => "the scene has no triangles".to_string(),
                all => {
                    let few = all[..all.len().min(3)].join("; ");
                    format!("the scene has no triangles ({few})")
                }
            };
            return Err(Error::invalid(source, what, hint));
        }
        if self.bounding_points().next().is_none() {
            let what = "all of its splats are broken or have an opacity of 0";
            return Err(Error::invalid(source, what, "give a scene with something to see"));
        }
        let flat = self.flat_triangles();
        if flat == self.primitive_count() {
            let what = format_args!("all of its {flat} triangles have no area").to_string();
            return Err(Error::invalid(source, what, "give a scene with something to see"));
        }
        if flat > 0 {
            let warning = format!("{source}: {flat} triangles have no area and draw nothing");
            self.warnings.push(warning);
        }
        Ok(())
    }

    /// How many triangles of meshes have no area.
    fn flat_triangles(&self) -> usize {
        let of_shape = |shape: &Shape| match shape {
            Shape::Mesh(mesh) => mesh
                .triangles
                .iter()
                .filter(|t| {
                    let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
                    (b - a).cross(c - a) == DVec3::ZERO
                })
                .count(),
            Shape::Strands(_) | Shape::Particles(_) | Shape::Splats(_) => 0,
        };
        let by_shape: Vec<usize> = self.shapes.iter().map(of_shape).collect();
        self.objects.iter().map(|o| by_shape[o.shape]).sum()
    }
}

fn check_points(points: &[Vec3], place: &str) -> Result<()> {
    match points.iter().position(|p| !p.is_finite()) {
        None => Ok(()),
        Some(i) => Err(Error::invalid(
            place,
            format_args!("vertex {i} is {}, which is no finite place", points[i]),
            "correct the vertex",
        )),
    }
}

fn check_mesh(mesh: &Mesh, place: &str) -> Result<()> {
    check_points(&mesh.positions, place)?;
    let count = mesh.positions.len();
    let bad = mesh.triangles.iter().position(|t| t.iter().any(|i| *i as usize >= count));
    if let Some(triangle) = bad {
        return Err(Error::invalid(
            place,
            format_args!(
                "triangle {triangle} names vertices {:?} of only {count}",
                mesh.triangles[triangle]
            ),
            "correct the indices",
        ));
    }
    for (name, length) in [
        ("normals", mesh.normals.len()),
        ("texture coordinates", mesh.uvs.len()),
        ("second texture coordinates", mesh.more_uvs.len()),
        ("colours", mesh.colours.len()),
    ] {
        if length != 0 && length != count {
            return Err(Error::invalid(
                place,
                format_args!("it has {count} vertices and {length} {name}"),
                "give one for each vertex, or none",
            ));
        }
    }
    let finite = mesh.uvs.iter().chain(&mesh.more_uvs).all(|v| v.is_finite())
        && mesh.normals.iter().all(|v| v.is_finite())
        && mesh.colours.iter().all(|v| v.is_finite());
    if !finite {
        let what = "a normal, texture coordinate or colour is not finite";
        return Err(Error::invalid(place, what, "correct the vertex"));
    }
    Ok(())
}
