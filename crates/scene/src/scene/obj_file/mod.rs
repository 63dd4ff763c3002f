//! Wavefront OBJ with MTL.

mod geometry;
mod lines;
mod map;
mod mesh;
mod mtl;
mod unread;

use std::collections::HashMap;
use std::path::Path;

use glam::DAffine3;

use self::geometry::Reader;
use self::lines::Lines;
use self::mesh::Builder;
use crate::scene::folder::Folder;
use crate::scene::{AlphaMode, Material, Scene, Shape, file, file_name};
use screendoor_trace::error::Result;

/// Loads the OBJ file at `path`; materials and textures that are missing become
/// warnings.
pub(super) fn load(path: &Path, folder: &Folder) -> Result<Scene> {
    let files = vec![path.to_path_buf()];
    let mut scene = Scene { source: file_name(path), files, ..Scene::default() };
    let lines = Lines::of(file::open(path)?.0, path)?;
    let mut reader = Reader::new(path, folder, &mut scene);
    reader.read(lines)?;
    let (geometry, library) = reader.finish();

    let fallback = scene.materials.len();
    scene.materials.push(Material::default());
    let place = path.display().to_string();
    let mut builder = Builder::new(&place, &geometry);
    let mut see_through = HashMap::new();
    for (i, segment) in geometry.segments.iter().enumerate() {
        let all = [geometry.faces.len(), geometry.lines.len()];
        let end = geometry.segments.get(i + 1).map_or(all, |next| next.first);
        let mut shapes = Vec::new();
        if end[0] > segment.first[0] {
            shapes.push(Shape::Mesh(builder.mesh(segment.first[0], end[0])?));
        }
        if end[1] > segment.first[1] {
            shapes.push(Shape::Strands(builder.lines(segment.first[1], end[1])));
        }
        for mut shape in shapes {
            let (material, colours) = match &mut shape {
                Shape::Mesh(mesh) => (&mut mesh.material, &mesh.colours),
                Shape::Strands(strands) => (&mut strands.material, &strands.colours),
                _ => continue,
            };
            *material = segment.material.unwrap_or(fallback);
            if colours.iter().any(|c| c.w < 1.0) {
                *material = *see_through
                    .entry(*material)
                    .or_insert_with(|| with_alpha(&mut scene, *material));
            }
            scene.add(segment.name.clone(), shape);
            if let Some(object) = scene.objects.last_mut() {
                object.place = DAffine3::from_translation(builder.origin);
            }
        }
    }
    if builder.flat > 0 {
        let (source, flat) = (&scene.source, builder.flat);
        let what = format!("{source}: {flat} faces of smoothing groups lack normals and are flat");
        scene.warnings.push(what);
    }
    library.warn_of_clear(&mut scene);
    Ok(scene)
}

/// The material of that number, for vertices with alphas: itself, or one like it that shows
/// them.
fn with_alpha(scene: &mut Scene, material: usize) -> usize {
    let own = &scene.materials[material];
    if own.alpha_mode != AlphaMode::Opaque {
        return material;
    }
    let blended = Material { alpha_mode: AlphaMode::Blend, ..own.clone() };
    scene.materials.push(blended);
    scene.materials.len() - 1
}
