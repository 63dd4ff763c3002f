//! OpenVDB: a grid of densities as a cloud of billboards.
//!
//! Every active voxel of at least 3 % of the greatest density becomes a soft round
//! billboard that faces the camera, 2.5 voxels wide, so that it overlaps its
//! neighbours: hundreds of layers in a cloud of a hundred voxels. All have the same alpha (0.05 where no other is asked for) times that of their
//! texture, as the smoke of Laine and Karras 2011, figure 8: the density decides
//! which voxels are drawn and how much light reaches them, not how opaque they are.
//! Up is the file's y; programs with another notion of up write it into the grid's
//! transformation, or not at all.
//!
//! The reader is our own: the crates that there are panic on damaged files,
//! allocate what a file claims, or hand it to C unchecked.

mod archive;
mod light;
mod packed;
mod tree;

use std::path::Path;

use glam::{Vec3, Vec4};

use self::tree::Voxel;
use crate::scene::bytes::Bytes;
use crate::scene::{
    AlphaMode, Material, Particles, Scene, Shape, TextureUse, View, file, file_name, sprite,
};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::random::Stream;

/// A billboard's alpha, where its texture has 1.
const ALPHA: f32 = 0.05;
/// Half of a billboard's side, in voxels.
const SIZE: f32 = 1.25;
/// Voxels below this share of the greatest density are not drawn.
const LEAST_SHARE: f32 = 0.03;

/// Loads the VDB file at `path`: of its grids that of the name `wanted`, or else that of
/// the name `density`, the first fog volume, or the first of real numbers. Level sets are passed
/// over, whether they say that they are some or only hold distances.
pub(super) fn load(path: &Path, wanted: Option<&str>) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    let mut bytes = Bytes::new(&place, &content);
    let entries = archive::entries(&mut bytes)?;
    let mut level_sets: Vec<usize> = Vec::new();
    let mut chosen = None;
    for (number, grid) in archive::candidates(&mut bytes, &entries, wanted)? {
        let grid = grid?;
        if chosen.is_some() || grid.is_level_set() {
            // The others are looked at no further.
            level_sets.extend(grid.is_level_set().then_some(number));
            continue;
        }
        let values = tree::read(&mut bytes, &grid)?;
        if values.are_distances && grid.class != "fog volume" {
            level_sets.push(number);
        } else {
            chosen = Some((number, grid, values));
        }
    }
    let Some((number, grid, values)) = chosen else {
        let names = level_sets.iter().map(|i| format!("'{}'", entries[*i].name));
        let names = names.collect::<Vec<_>>().join(", ");
        let what = format!("it holds distances to surfaces (level sets: {names}), no density");
        return Err(Error::unsupported(&place, what, "convert one to a fog volume"));
    };
    let mut voxels = values.voxels;
    let greatest = voxels.iter().map(|v| v.density).fold(0.0, f32::max);
    voxels.retain(|v| v.density >= greatest * LEAST_SHARE);
    if voxels.is_empty() {
        let what = format_args!("its grid '{}' is empty", grid.name);
        return Err(Error::invalid(&place, what, "give one with a density above 0"));
    }
    let mut left_out: Vec<String> = Vec::new();
    // Who names one knows what is left out.
    if entries.len() > 1 && wanted.is_none() {
        let others = entries.iter().enumerate().filter(|(i, _)| *i != number);
        let others = others.map(|(i, entry)| match level_sets.contains(&i) {
            true => format!("'{}', a level set", entry.name),
            false => format!("'{}' of {}", entry.name, entry.kind),
        });
        let others: Vec<String> = others.collect();
        let (name, others) = (&grid.name, others.join("; "));
        left_out
            .push(format!("of its {} grids only '{name}' is drawn, not {others}", entries.len()));
    }
    if values.negative > 0 {
        let (name, count) = (&grid.name, values.negative);
        left_out.push(format!("{count} voxels of its grid '{name}' are negative and draw nothing"));
    }

    let mut scene = Scene {
        source: match wanted {
            Some(grid) => format!("{}, grid {grid}", file_name(path)),
            None => file_name(path),
        },
        files: vec![path.to_path_buf()],
        warnings: left_out.into_iter().map(|what| format!("{place}: {what}")).collect(),
        view: View { pitch: 15.0, background: [0.02, 0.035, 0.06], ..View::default() },
        ..Scene::default()
    };
    scene.textures.push(sprite::round(soft));
    scene.materials.push(Material {
        name: "smoke".into(),
        base: Vec4::new(1.0, 1.0, 1.0, ALPHA),
        base_texture: Some(TextureUse::plain(0)),
        alpha_mode: AlphaMode::Blend,
        // The voxels' colours are lit already.
        unlit: true,
        ..Material::default()
    });
    let particles = Particles {
        centres: voxels.iter().map(|v| v.at.as_vec3() + strewn(v)).collect(),
        sizes: vec![SIZE; voxels.len()],
        colours: light::colours(&voxels, greatest, &grid.place),
        ..Particles::default()
    };
    scene.add(grid.name, Shape::Particles(particles));
    // The grid's own transformation, for voxels that count from its origin.
    scene.objects[0].place = grid.place;
    Ok(scene)
}

/// How far a billboard stands from its voxel's middle: anywhere in the voxel, so that
/// no lattice shows.
fn strewn(voxel: &Voxel) -> Vec3 {
    let [x, y, z] = voxel.at.to_array().map(|c| c as u32);
    let mut random = Stream::new([0x7db, x, y, z]);
    let mut side = || random.range(-0.5, 0.5);
    Vec3::new(side(), side(), side())
}

/// A billboard's texture: full in the middle, fading towards its edge.
fn soft(distance: f32) -> f32 {
    let left = 1.0 - distance * distance;
    left * left
}
