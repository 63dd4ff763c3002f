//! Replaying a trace through a design: streamed, binned by tile, tiles in
//! parallel.
//!
//! A window of fragments is read and sorted into tiles while the window before
//! it is drawn. Within a tile, fragments stay in API order and one thread draws
//! them, so that neither the number of threads nor the size of the windows
//! changes a bit of the result. Memory is that of the touched tiles' state and of
//! two windows. A design whose state grows with the fragments is given the trace
//! several times, for groups of tiles that fit into the memory limit.

mod explain;
mod group;
mod window;

use rayon::prelude::*;

pub use explain::{Explanation, Step, draw_pixel, explain};

use crate::error::Result;
use crate::picture::{Picture, TilePixels};
use crate::rop::design::{Design, Frame, Site, StateBits};
use crate::rop::event::{EventCounts, NoProbe, Probe};
use crate::rop::replay::group::{Group, group_tiles};
use crate::rop::replay::window::Windows;
use crate::tile::{TILE_PIXELS, TileGrid, TileId, TileMap};
use crate::trace::Trace;

/// How to replay a trace; none of it changes the picture.
#[derive(Clone, Copy)]
pub struct ReplayOptions<'a> {
    /// Whether to count events.
    pub count_events: bool,
    /// Fragments that are binned at a time, at least 1.
    pub window: usize,
    /// Bytes that the state of a design may take that grows with the fragments.
    pub memory: u64,
    /// Is told how many fragments have been drawn, of how many.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
}

impl Default for ReplayOptions<'_> {
    fn default() -> Self {
        ReplayOptions {
            count_events: false,
            window: 1 << 19,
            memory: 1 << 29,
            progress: &|_, _| (),
        }
    }
}

/// The result of a replay.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// The picture.
    pub picture: Picture,
    /// What the design did, if it was asked to count.
    pub events: Option<EventCounts>,
    /// State per pixel.
    pub state_bits: StateBits,
    /// How many times the design read the trace.
    pub passes: u32,
    /// Tiles that at least one fragment touched.
    pub touched_tiles: usize,
}

/// Replays `trace` through `design`.
///
/// # Errors
/// As [`Trace::batch`]; [`crate::error::Error::Config`] where one pixel's fragments do not fit
/// into the memory limit.
pub fn replay<D: Design>(
    design: &D,
    frame: &Frame,
    trace: &Trace,
    options: &ReplayOptions<'_>,
) -> Result<Replayed> {
    if options.count_events {
        let (picture, tiles, events) = run::<D, EventCounts>(design, frame, trace, options)?;
        Ok(finish(design, picture, tiles, Some(events)))
    } else {
        let (picture, tiles, NoProbe) = run::<D, NoProbe>(design, frame, trace, options)?;
        Ok(finish(design, picture, tiles, None))
    }
}

fn finish<D: Design>(
    design: &D,
    picture: Picture,
    touched_tiles: usize,
    events: Option<EventCounts>,
) -> Replayed {
    Replayed {
        picture,
        events,
        state_bits: design.state_bits(),
        passes: design.passes(),
        touched_tiles,
    }
}

/// A probe whose counts of parts add up.
trait Tally: Probe + Default + Send {
    fn add(self, other: Self) -> Self;
}

impl Tally for EventCounts {
    fn add(self, other: Self) -> Self {
        self.merged(&other)
    }
}

impl Tally for NoProbe {
    fn add(self, _: Self) -> Self {
        self
    }
}

fn run<D: Design, T: Tally>(
    design: &D,
    frame: &Frame,
    trace: &Trace,
    options: &ReplayOptions<'_>,
) -> Result<(Picture, usize, T)> {
    let groups = match design.bytes_per_fragment() {
        None => vec![Group::Everything],
        Some(bytes) => group_tiles(frame, trace, bytes as u64, options)?,
    };
    let background = frame.background.map(f64::from);
    let mut finished: TileMap<TilePixels> = TileMap::new(frame.grid);
    let mut tally = T::default();
    let total = trace.rows() * u64::from(design.passes()) * groups.len() as u64;
    let mut done = 0;
    for group in &groups {
        let mut states: TileMap<Vec<D::Pixel>> = TileMap::new(frame.grid);
        for pass in 0..design.passes() {
            let mut windows = Windows::new(trace, frame, group, options.window.max(1));
            let mut next = windows.next_binned();
            while let Some(window) = next.transpose()? {
                let (drawn, ahead) = rayon::join(
                    || window.draw::<D, T>(design, frame, pass, &mut states),
                    || windows.next_binned(),
                );
                tally = tally.add(drawn);
                next = ahead;
                done += window.rows as u64;
                (options.progress)(done, total);
            }
            states.touched_mut().par_iter_mut().for_each(|(tile, pixels)| {
                for (site, pixel) in sites(frame.grid, *tile).zip(pixels) {
                    design.end_pass(pass, site, pixel);
                }
            });
        }
        let resolved = states.map(|tiles| {
            tiles
                .into_par_iter()
                .map(|(tile, pixels)| {
                    (tile, resolve_tile(design, frame, tile, &pixels, background))
                })
                .collect()
        });
        merge(&mut finished, resolved, group);
    }
    let touched = finished.touched().len();
    Ok((Picture::from_tiles(background, finished), touched, tally))
}

/// The sites of a tile's pixels, including those beyond the frame's edge.
fn sites(grid: TileGrid, tile: TileId) -> impl Iterator<Item = Site> {
    (0..TILE_PIXELS).map(move |within| {
        let (x, y) = grid.pixel(tile, within);
        // Beyond a frame of full size this wraps; such pixels are never drawn to.
        Site { x: x as u16, y: y as u16 }
    })
}

fn resolve_tile<D: Design>(
    design: &D,
    frame: &Frame,
    tile: TileId,
    pixels: &[D::Pixel],
    background: [f64; 3],
) -> TilePixels {
    let mut result = Box::new([background; TILE_PIXELS]);
    for ((site, pixel), out) in sites(frame.grid, tile).zip(pixels).zip(result.iter_mut()) {
        *out = design.resolve(site, pixel);
    }
    result
}

/// Adds a group's tiles to the finished ones; of a tile that is done in parts,
/// only the part's pixels.
fn merge(finished: &mut TileMap<TilePixels>, part: TileMap<TilePixels>, group: &Group) {
    for (tile, pixels) in part.into_touched() {
        match group {
            Group::Part(_, within) if finished.get(tile).is_some() => {
                let whole = finished.get_or_insert_with(tile, || unreachable!("it is there"));
                whole[within.clone()].copy_from_slice(&pixels[within.clone()]);
            }
            _ => {
                finished.get_or_insert_with(tile, || pixels);
            }
        }
    }
}
