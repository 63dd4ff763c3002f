//! Wavefront OBJ with MTL.

mod clean;
mod lines;
mod mtl;

use std::io::BufReader;
use std::path::Path;

use glam::{Vec2, Vec3};

use self::clean::Cleaner;
use crate::error::{Error, Result};
use crate::scene::{Material, Mesh, Scene, Shape, file_name};

/// Loads the OBJ file at `path`; materials and textures that are missing become
/// warnings.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let files = vec![path.to_path_buf()];
    let mut scene = Scene { source: file_name(path), files, ..Scene::default() };
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let mut cleaner = Cleaner::open(path, &mut scene)?;
    // The cleaner hands no `mtllib` on.
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let loaded = tobj::load_obj_buf(&mut BufReader::new(&mut cleaner), &options, no_materials);
    let models = match loaded {
        Ok((models, _)) => models,
        Err(e) => {
            let other = || Error::invalid(path.display(), e, "export the file again");
            return Err(cleaner.failed.or(cleaner.beyond).unwrap_or_else(other));
        }
    };
    cleaner.warn();
    let segments = cleaner.segments;

    let fallback = scene.materials.len();
    scene.materials.push(Material::default());
    for model in models.into_iter().filter(|model| !model.mesh.indices.is_empty()) {
        let Some(segment) = model.name.parse().ok().and_then(|i: usize| segments.get(i)) else {
            continue;
        };
        let material = segment.material.unwrap_or(fallback);
        scene.add(segment.name.clone(), Shape::Mesh(mesh(&model.mesh, material)));
    }
    Ok(scene)
}

/// The mesh with what its corners do not say filled in.
fn mesh(read: &tobj::Mesh, material: usize) -> Mesh {
    let triples = |v: &[f32]| v.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
    let mut mesh = Mesh {
        more_uvs: Vec::new(),
        positions: triples(&read.positions),
        normals: triples(&read.normals),
        uvs: read.texcoords.chunks_exact(2).map(Vec2::from_slice).collect(),
        colours: triples(&read.vertex_color).into_iter().map(|c| c.extend(1.0)).collect(),
        triangles: read.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        material,
    };
    if mesh.uvs.iter().all(|uv| uv.is_nan()) {
        mesh.uvs.clear();
    }
    for uv in &mut mesh.uvs {
        let given = if uv.is_nan() { Vec2::ZERO } else { *uv };
        // OBJ counts v upwards.
        *uv = Vec2::new(given.x, 1.0 - given.y);
    }
    if mesh.normals.iter().all(|n| n.is_nan()) {
        mesh.normals.clear();
    } else {
        fill_normals(&mut mesh);
    }
    mesh
}

/// Gives corners without normals that of their triangle, on vertices of their own.
fn fill_normals(mesh: &mut Mesh) {
    for t in 0..mesh.triangles.len() {
        let corners = mesh.triangles[t].map(|i| i as usize);
        let [a, b, c] = corners.map(|i| mesh.positions[i]);
        let flat = (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::Z);
        for (k, i) in corners.into_iter().enumerate() {
            if mesh.normals[i].is_nan() {
                mesh.triangles[t][k] = mesh.positions.len() as u32;
                mesh.positions.push(mesh.positions[i]);
                mesh.normals.push(flat);
                if let Some(uv) = mesh.uvs.get(i).copied() {
                    mesh.uvs.push(uv);
                }
                if let Some(colour) = mesh.colours.get(i).copied() {
                    mesh.colours.push(colour);
                }
            }
        }
    }
    // What is left without a normal is a vertex of no triangle.
    for normal in mesh.normals.iter_mut().filter(|n| n.is_nan()) {
        *normal = Vec3::Z;
    }
}
