//! PLY files: Gaussian splats as they are trained or as PlayCanvas compresses them, or a mesh.

mod content;
mod elements;
mod mesh;

use std::path::Path;

use self::content::File;
pub(super) use self::elements::{Element, Place};
use crate::scene::bytes::Bytes;
use crate::scene::{Axes, Scene, file, splat_file};
use screendoor_trace::error::Result;

/// Loads the PLY file at `path`.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    let file = File::read(&place, &content)?;
    let splats = match splat_file::compressed(&place, &file.elements)? {
        None => splat_file::trained(&place, &file.elements)?,
        packed => packed,
    };
    if let Some(mut cloud) = splats {
        let faces = file.elements.iter().find(|e| e.name == "face").map_or(0, |e| e.count);
        if faces > 0 {
            cloud.tell(&format!("its {faces} faces are not drawn beside its splats"));
        }
        return cloud.scene(path, Axes::YDown);
    }
    if let Some(scene) = mesh::scene(path, &file)? {
        return Ok(scene);
    }
    Err(Bytes::new(&place, &content).unsupported(
        "it holds neither Gaussian splats nor faces of a mesh",
        "give splats with f_dc_0, scale_0 and rot_0 or packed as PlayCanvas does, or a mesh with faces",
    ))
}
