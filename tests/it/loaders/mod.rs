//! What scene files of other programs say, and what is read from them.

pub mod damage;
mod gltf;
mod hair;
mod inputs;
mod lines;
mod obj;
mod outside;
mod pictures;
mod splats;
mod table;
mod tfx;
mod vdb;

use std::fs;
use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat};
use screendoor::error::Error;
use screendoor::scene::{Mesh, Particles, Scene, Shape, load};
use tempfile::TempDir;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A folder with files in it.
fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn load_in(folder: &Path, name: &str) -> Result<Scene, Error> {
    load(&folder.join(name).display().to_string())
}

fn mesh(scene: &Scene, i: usize) -> &Mesh {
    match &scene.shapes[scene.objects[i].shape] {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn particles(scene: &Scene) -> &Particles {
    match &scene.shapes[0] {
        Shape::Particles(particles) => particles,
        other => panic!("{other:?}"),
    }
}

fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
    let mut bytes = Vec::new();
    image.into().write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
    bytes
}

#[track_caller]
fn warned(scene: &Scene, count: usize, parts: &[&str]) {
    assert_eq!(scene.warnings.len(), count, "{:?}", scene.warnings);
    let all = |w: &&String| parts.iter().all(|part| w.contains(part));
    assert!(scene.warnings.iter().any(|w| all(&w)), "{parts:?}: {:?}", scene.warnings);
}
