//! Printed sheets draped one over another.

mod drape;
mod fabric;

use std::sync::{Arc, Mutex, PoisonError};

use glam::{Affine2, Vec2, Vec3};
use rayon::prelude::*;

use crate::scene::builtin::{Builtin, SEED, seed};
use crate::scene::{Material, Mesh, Scene, Shape, TextureUse, View};
use screendoor_trace::param::{Typed, Values};

const SHEETS: Typed<i64> = Typed::integer("sheets", "5", (1, 8), "how many sheets");
const CELLS: Typed<i64> = Typed::integer("cells", "72", (8, 96), "cells along a sheet's side");

pub(super) const SCENE: Builtin = Builtin {
    name: "cloth",
    summary: "draped sheets with printed and woven patterns, alpha 0.4",
    params: &[SHEETS.param, CELLS.param, SEED.param],
    build,
};

fn build(values: &Values) -> Scene {
    let mut scene = Scene {
        view: View { yaw: 30.0, pitch: 24.0, background: [0.06, 0.065, 0.075], ..View::default() },
        ..Scene::default()
    };
    let cells = values.get(CELLS) as usize / 2 * 2;
    let sheets = values.get(SHEETS) as u32;
    let draped = draped(sheets, cells, seed(values));
    for (i, sheet) in draped.iter().enumerate() {
        let (texture, repeats) = fabric::fabric(i);
        scene.textures.push(texture);
        scene.materials.push(Material {
            base_texture: Some(TextureUse {
                transform: Affine2::from_scale(Vec2::splat(repeats)),
                ..TextureUse::plain(i)
            }),
            ..Material::diffuse("fabric", [1.0; 3], 0.4)
        });
        scene.add(format!("sheet {}", i + 1), Shape::Mesh(mesh(sheet, i)));
    }
    scene
}

/// What [`draped`] depends on, and what it gives.
type Draped = ((u32, usize, u32), Arc<[drape::Sheet]>);

/// The sheets at rest. A process that draws the scene again, larger or seen from elsewhere as a
/// study does, finds the last ones here: they take nearly a second.
fn draped(sheets: u32, cells: usize, seed: u32) -> Arc<[drape::Sheet]> {
    static LAST: Mutex<Option<Draped>> = Mutex::new(None);
    let last = || LAST.lock().unwrap_or_else(PoisonError::into_inner);
    let wanted = (sheets, cells, seed);
    if let Some((_, found)) = last().as_ref().filter(|(of, _)| *of == wanted) {
        return found.clone();
    }
    let fall = |i| drape::drape(i, sheets, cells, seed);
    let found: Vec<drape::Sheet> = (0..sheets).into_par_iter().map(fall).collect();
    let found: Arc<[drape::Sheet]> = found.into();
    *last() = Some((wanted, found.clone()));
    found
}

/// A sheet's mesh, smooth, with its sides running over the texture once.
fn mesh(sheet: &drape::Sheet, material: usize) -> Mesh {
    let n = sheet.cells;
    let mut mesh = Mesh { material, positions: sheet.points.clone(), ..Mesh::default() };
    for j in 0..=n {
        for i in 0..=n {
            mesh.uvs.push(Vec2::new(i as f32, j as f32) / n as f32);
            mesh.normals.push(normal(sheet, i, j));
            if i < n && j < n {
                let at = |i: usize, j: usize| sheet.at(i, j) as u32;
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                // The diagonals alternate so that folds have no preferred side.
                let pair =
                    if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                mesh.triangles.extend(pair);
            }
        }
    }
    mesh
}

fn normal(sheet: &drape::Sheet, i: usize, j: usize) -> Vec3 {
    let n = sheet.cells;
    let point = |i: usize, j: usize| sheet.points[sheet.at(i, j)];
    let along = point((i + 1).min(n), j) - point(i.saturating_sub(1), j);
    let across = point(i, (j + 1).min(n)) - point(i, j.saturating_sub(1));
    across.cross(along).normalize_or(Vec3::Y)
}
