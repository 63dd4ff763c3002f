//! Pictures, and what can be measured on them.

use serde::Serialize;

use crate::capture::CaptureOptions;
use crate::error::Result;
use crate::metrics::{Region, errors};
use crate::picture::Picture;
use crate::scene;
use crate::study::publications::sampling::layers;
use crate::study::publications::table_1::{SCENES, Table1Scene};
use crate::study::publications::{Effort, capture, replay};
use crate::tile::TileGrid;

/// Error that is left when pixels are averaged over square blocks.
#[derive(Clone, Debug, Serialize)]
pub struct Dithering {
    /// The design.
    pub design: String,
    /// RMSE over blocks of [`BLOCKS`] pixels a side.
    pub rmse: [f64; 4],
}

/// Sides of the blocks of [`Dithering`].
pub const BLOCKS: [u32; 4] = [1, 2, 4, 8];

/// Every built-in scene that looks like something, small.
pub(super) fn gallery() -> Result<Vec<(String, Picture)>> {
    const SIDE: u32 = 300;
    let scenes = scene::builtin::BUILTINS.iter().filter(|b| b.name != "layers");
    scenes
        .map(|builtin| {
            let options = CaptureOptions {
                width: SIDE,
                height: SIDE,
                samples: 16,
                ..CaptureOptions::default()
            };
            let trace = capture(&format!("builtin:{}", builtin.name), &options, false)?;
            Ok((format!("`{}`", builtin.name), replay("exact", &trace, 16, 0)?.picture))
        })
        .collect()
}

/// A picture by its name.
pub type NamedPicture = (&'static str, Picture);

/// The picture averaged over blocks of `side` × `side` pixels.
pub(super) fn averaged(picture: &Picture, side: u32) -> Picture {
    let grid = TileGrid::new(picture.width() / side, picture.height() / side);
    Picture::from_fn(grid, |x, y| {
        let mut sum = [0.0; 3];
        for (dx, dy) in (0..side).flat_map(|dy| (0..side).map(move |dx| (dx, dy))) {
            let colour = picture.get(x * side + dx, y * side + dy);
            sum.iter_mut().zip(colour).for_each(|(s, c)| *s += c);
        }
        sum.map(|s| s / f64::from(side * side))
    })
}

/// A rectangle of a picture.
fn crop(picture: &Picture, [x0, y0]: [u32; 2], side: u32) -> Picture {
    Picture::from_fn(TileGrid::new(side, side), |x, y| picture.get(x0 + x, y0 + y))
}

/// The pictures by name, and the noise of figure 1's ramps.
pub(super) fn figures(effort: Effort) -> Result<(Vec<NamedPicture>, Vec<Dithering>)> {
    let (mut pictures, mut dithering) = (Vec::new(), Vec::new());
    // Figure 1, left: the ramps.
    let options =
        CaptureOptions { width: 256, height: 256, samples: 16, ..CaptureOptions::default() };
    let ramps = capture("builtin:ramps", &options, false)?;
    let exact = replay("exact", &ramps, 16, 0)?.picture;
    for (name, spec) in [("figure-1-enderton", "enderton"), ("figure-1-lk", "lk")] {
        let picture = replay(spec, &ramps, 16, 0)?.picture;
        let rmse = BLOCKS.map(|side| {
            let (a, b) = (averaged(&picture, side), averaged(&exact, side));
            errors(&a, &b, &Region::frame(a.grid())).rmse
        });
        dithering.push(Dithering { design: spec.to_string(), rmse });
        pictures.push((name, picture));
    }
    // Figure 3: eight white layers of alpha 0.1 at 8 samples.
    let eight = layers("count=8,alpha=0.1", 128, 8)?;
    for (name, spec) in [
        ("figure-3-lk2011", "lk"),
        ("figure-3-sobol", "lk:reference=sobol"),
        ("figure-3-sobol-static", "lk:reference=sobol,sort=false,compact=false"),
        ("figure-3-lk2011-static", "lk:sort=false,compact=false"),
        ("figure-3-radical-inverse", "lk:reference=radical-inverse,sort=false,compact=false"),
        ("figure-3-white", "lk:reference=white"),
    ] {
        pictures.push((name, replay(spec, &eight, 8, 0)?.picture));
    }
    // Figures 1, right, 6 and 10: the cloth, triangles in random order.
    let side = effort.side;
    let spec = built_in("builtin:cloth");
    let cloth = capture(spec.source, &spec.options(side), false)?;
    let inset = [side * 3 / 8, side * 5 / 16];
    let corner = |p: &Picture| crop(p, inset, side / 4);
    pictures.push(("cloth-exact", replay("exact", &cloth, 64, 0)?.picture));
    for (name, spec, samples) in [
        ("figure-1-cloth-enderton", "enderton", 64),
        ("figure-1-cloth-lk", "lk", 64),
        ("figure-6-unsorted", "lk:sort=false", 16),
        ("figure-6-sorted", "lk", 16),
    ] {
        pictures.push((name, corner(&replay(spec, &cloth, samples, 0)?.picture)));
    }
    for (name, spec) in [("figure-10-enderton", "enderton"), ("figure-10-lk", "lk")] {
        pictures.push((name, replay(spec, &cloth, 16, 0)?.picture));
    }
    // Figure 9: the motor.
    let spec = built_in("builtin:engine");
    let engine = capture(spec.source, &spec.options(side), spec.white)?;
    for (name, design) in [("figure-9-enderton", "enderton"), ("figure-9-lk", "lk")] {
        pictures.push((name, replay(design, &engine, 16, 0)?.picture));
    }
    Ok((pictures, dithering))
}

fn built_in(source: &str) -> &'static Table1Scene {
    SCENES.iter().find(|s| s.source == source).expect("it is in the table")
}
