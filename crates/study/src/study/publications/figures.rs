//! The pictures of LK's figures, and the noise of those that show it.

use crate::study::publications::experiment::Lab;
use crate::study::publications::noise::{CORRELATION_SEEDS, FigureNoise, Noise, edge_noise, noise};
use crate::study::publications::sampling::layers;
use crate::study::publications::table_1::study_of;
use crate::study::publications::{Effort, capture, pictures, replay};
use std::path::Path;

use screendoor_scene::capture::CaptureOptions;
use screendoor_scene::scene;
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::Trace;

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

/// A rectangle of a picture.
fn crop(picture: &Picture, [x0, y0]: [u32; 2], side: u32) -> Picture {
    let pixel = |x, y| picture.get(x0 + x, y0 + y);
    Picture::from_fn(TileGrid::new(side, side), pixel).in_space(picture.space())
}

/// What a figure's panels share.
struct Panels<'a> {
    trace: &'a Trace,
    samples: u32,
    exact: &'a Picture,
    seeds: u32,
    /// The part of the picture that is shown.
    part: &'a dyn Fn(&Picture) -> Picture,
    pictures: &'a mut Vec<NamedPicture>,
}

impl Panels<'_> {
    /// Draws panels, by name and design: keeps the first seed's picture of each and
    /// gives the noise over all seeds.
    fn draw(&mut self, panels: &[(&'static str, &'static str)]) -> Result<Vec<Noise>> {
        let exact = (self.part)(self.exact);
        let mut list = Vec::new();
        for (name, design) in panels {
            let drawn = pictures(design, self.trace, self.samples, self.seeds)?;
            let shown: Vec<Picture> =
                drawn.map(|picture| Ok((self.part)(&picture?))).collect::<Result<_>>()?;
            list.push(noise(design, self.samples, &shown, &exact));
            self.pictures.extend(shown.into_iter().next().map(|picture| (*name, picture)));
        }
        Ok(list)
    }
}

/// The pictures by name, and the noise in them.
pub(super) fn figures(lab: &Lab<'_>, effort: Effort) -> Result<(Vec<NamedPicture>, FigureNoise)> {
    let mut shown = Vec::new();
    let seeds = effort.seeds;
    let whole = |p: &Picture| p.clone();
    // Figure 1, left: the ramps.
    let options =
        CaptureOptions { width: 256, height: 256, samples: 16, ..CaptureOptions::default() };
    let ramps = capture("builtin:ramps", &options, false)?;
    let exact = replay("exact", &ramps, 16, 0)?.picture;
    let (trace, samples, part, exact) = (&ramps, 16, &whole, &exact);
    let mut figure = Panels { trace, samples, exact, seeds, part, pictures: &mut shown };
    let dithering = figure.draw(&[("figure-1-enderton", "enderton"), ("figure-1-lk", "lk")])?;
    let edges = ["enderton", "lk"]
        .into_iter()
        .map(|design| edge_noise(design, trace, samples, exact, seeds))
        .collect::<Result<_>>()?;
    // Figure 3: eight white layers of alpha 0.1 at 8 samples.
    let eight = layers("count=8,alpha=0.1", 128, 8)?;
    let exact = replay("exact", &eight, 8, 0)?.picture;
    let (trace, samples, exact, seeds) = (&eight, 8, &exact, CORRELATION_SEEDS);
    let mut figure = Panels { trace, samples, exact, seeds, part, pictures: &mut shown };
    let correlation = figure.draw(&[
        ("figure-3-lk2011", "lk"),
        ("figure-3-sobol", "lk:reference=sobol"),
        ("figure-3-white", "lk:reference=white"),
        ("figure-3-lk2011-static", "lk:sort=false,compact=false"),
        ("figure-3-sobol-static", "lk:reference=sobol,sort=false,compact=false"),
        ("figure-3-radical-inverse", "lk:reference=radical-inverse,sort=false,compact=false"),
    ])?;
    // Figures 1, right, 6 and 10: the cloth, triangles in random order.
    let side = effort.side;
    let cloth = built_in(lab, "builtin:cloth", effort)?;
    let inset = [side * 3 / 8, side * 5 / 16];
    let corner = |p: &Picture| crop(p, inset, side / 4);
    let seeds = effort.seeds;
    let exact = replay("exact", &cloth, 64, 0)?.picture;
    let (trace, samples, exact, part) = (&cloth, 64, &exact, &corner);
    let mut figure = Panels { trace, samples, exact, seeds, part, pictures: &mut shown };
    let cloth_noise =
        figure.draw(&[("figure-1-cloth-enderton", "enderton"), ("figure-1-cloth-lk", "lk")])?;
    let exact = replay("exact", &cloth, 16, 0)?.picture;
    let (samples, exact) = (16, &exact);
    let mut figure = Panels { trace, samples, exact, seeds, part, pictures: &mut shown };
    let sorting =
        figure.draw(&[("figure-6-unsorted", "lk:sort=false"), ("figure-6-sorted", "lk")])?;
    if !effort.brief {
        for (name, spec) in [("figure-10-enderton", "enderton"), ("figure-10-lk", "lk")] {
            shown.push((name, replay(spec, &cloth, 16, 0)?.picture));
        }
        // Figure 9: the motor.
        let engine = built_in(lab, "builtin:engine", effort)?;
        for (name, design) in [("figure-9-enderton", "enderton"), ("figure-9-lk", "lk")] {
            shown.push((name, replay(design, &engine, 16, 0)?.picture));
        }
    }
    let noise = FigureNoise { dithering, edges, cloth: cloth_noise, correlation, sorting };
    Ok((shown, noise))
}

/// A scene as table 1 has it: its trace, where the table has just been measured on it.
fn built_in(lab: &Lab<'_>, source: &str, effort: Effort) -> Result<Trace> {
    let study = study_of(effort)?;
    let entry = study.scenes.iter().find(|s| s.drawn() == source).expect("it is in the table");
    let drawn = lab.place(&study).join("traces").join(format!("{}.arrow", entry.name));
    if drawn.is_file() {
        return Trace::open(&drawn);
    }
    capture(source, &entry.options(entry.camera_choice(Path::new("")).choose(&[])?)?, entry.white)
}
