//! Replaying a trace through a design: streamed, binned by tile, tiles in
//! parallel.
//!
//! A window of fragments is read and sorted into tiles while the window before
//! it is drawn. Within a tile, fragments stay in API order and one thread draws
//! them, so that neither the number of threads nor the size of the windows
//! changes a bit of the result. Memory is that of the touched tiles' state and of
//! two windows. A design whose state grows with the fragments is given the trace
//! several times, for groups of tiles that fit into the memory limit.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::picture::{Picture, TilePixels};
use crate::rop::design::{Contents, Design, Frame, Site, StateBits};
use crate::rop::event::{EventCounts, NoProbe, Probe, Record};
use crate::tile::{TILE_PIXELS, TileGrid, TileId, TileMap};
use crate::trace::{Batch, Fragment, SampleMask, Trace};

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
/// As [`Trace::batch`]; [`Error::Config`] where one pixel's fragments do not fit
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

/// Tiles whose fragments are drawn together.
#[derive(Clone, Debug, PartialEq)]
enum Group {
    Everything,
    /// Tiles with numbers in a range.
    Tiles(Range<u32>),
    /// A range of one tile's pixels.
    Part(TileId, Range<usize>),
}

impl Group {
    #[inline]
    fn holds(&self, tile: TileId, x: u16, y: u16) -> bool {
        match self {
            Group::Everything => true,
            Group::Tiles(range) => range.contains(&tile.0),
            Group::Part(only, within) => tile == *only && within.contains(&TileGrid::within(x, y)),
        }
    }
}

/// Cuts the frame into groups whose fragments take at most the memory limit.
fn group_tiles(
    frame: &Frame,
    trace: &Trace,
    bytes_per_fragment: u64,
    options: &ReplayOptions<'_>,
) -> Result<Vec<Group>> {
    let limit = (options.memory / bytes_per_fragment).max(1);
    if trace.rows() <= limit {
        return Ok(vec![Group::Everything]);
    }
    let grid = frame.grid;
    let mut by_tile = vec![0_u64; grid.count()];
    for_each_fragment(frame, trace, |tile, _| by_tile[tile.0 as usize] += 1)?;

    let mut groups = Vec::new();
    let (mut start, mut sum) = (0_u32, 0);
    for (tile, n) in by_tile.iter().enumerate() {
        let tile = tile as u32;
        if sum + n > limit {
            if sum > 0 {
                groups.push(Group::Tiles(start..tile));
            }
            (start, sum) = (tile, 0);
        }
        if *n <= limit {
            sum += n;
            continue;
        }
        // One tile alone is too much: cut it into ranges of pixels.
        let mut by_pixel = vec![0_u64; TILE_PIXELS];
        for_each_fragment(frame, trace, |t, within| by_pixel[within] += u64::from(t.0 == tile))?;
        let (mut first, mut in_part) = (0, 0);
        for (within, n) in by_pixel.iter().enumerate() {
            if *n > limit {
                let (x, y) = grid.pixel(TileId(tile), within);
                return Err(Error::config(
                    format_args!(
                        "pixel {x},{y} alone holds {n} fragments, which take {} MiB",
                        (n * bytes_per_fragment).div_ceil(1 << 20)
                    ),
                    "raise the memory limit (--memory)",
                ));
            }
            if in_part + n > limit {
                groups.push(Group::Part(TileId(tile), first..within));
                (first, in_part) = (within, 0);
            }
            in_part += n;
        }
        groups.push(Group::Part(TileId(tile), first..TILE_PIXELS));
        start = tile + 1;
    }
    if sum > 0 {
        groups.push(Group::Tiles(start..grid.count() as u32));
    }
    Ok(groups)
}

/// Tells the tile, and the place within it, of every fragment of the trace that
/// covers a sample of the frame.
fn for_each_fragment(
    frame: &Frame,
    trace: &Trace,
    mut each: impl FnMut(TileId, usize),
) -> Result<()> {
    let mask = SampleMask::first(frame.samples());
    for batch in trace.batches() {
        let batch = batch?;
        for i in (0..batch.len()).filter(|i| !(batch.coverage(*i) & mask).is_empty()) {
            let (x, y) = batch.pixel(i);
            each(frame.grid.tile(x, y), TileGrid::within(x, y));
        }
    }
    Ok(())
}

/// Cuts a trace into windows of fragments.
struct Windows<'a> {
    trace: &'a Trace,
    frame: &'a Frame,
    group: &'a Group,
    length: usize,
    next_batch: usize,
    /// What the last window left of its last batch.
    rest: Option<(Batch, usize)>,
    /// By tile, for counting: fragments in this window, then the place of the next.
    cursors: Vec<u32>,
}

/// A window's fragments, sorted into tiles.
struct Window {
    /// Batches and the row at which each begins in this window.
    parts: Vec<Part>,
    rows: usize,
    /// Tiles with fragments, in rising order, and where theirs end in `rows_by_tile`.
    tiles: Vec<(TileId, u32)>,
    /// Window rows, tile after tile, in API order within a tile.
    rows_by_tile: Vec<u32>,
}

struct Part {
    batch: Batch,
    /// The batch's first row that belongs to the window.
    first: usize,
    /// That row's number in the window.
    start: usize,
    /// The number after the part's last row.
    end: usize,
}

impl<'a> Windows<'a> {
    fn new(trace: &'a Trace, frame: &'a Frame, group: &'a Group, length: usize) -> Self {
        let cursors = vec![0; frame.grid.count()];
        // Window rows are numbered in 32 bits.
        let length = length.min(1 << 30);
        Windows { trace, frame, group, length, next_batch: 0, rest: None, cursors }
    }

    fn next_binned(&mut self) -> Option<Result<Window>> {
        let mut parts: Vec<Part> = Vec::new();
        let mut rows = 0;
        while rows < self.length {
            let (batch, first) = match self.rest.take() {
                Some(rest) => rest,
                None if self.next_batch < self.trace.batch_count() => {
                    self.next_batch += 1;
                    match self.trace.batch(self.next_batch - 1) {
                        Ok(batch) => (batch, 0),
                        Err(e) => return Some(Err(e)),
                    }
                }
                None => break,
            };
            let taken = (batch.len() - first).min(self.length - rows);
            if first + taken < batch.len() {
                self.rest = Some((batch.clone(), first + taken));
            }
            parts.push(Part { batch, first, start: rows, end: rows + taken });
            rows += taken;
        }
        (rows > 0).then(|| Ok(self.bin(parts, rows)))
    }

    /// A counting sort by tile, stable in API order.
    fn bin(&mut self, parts: Vec<Part>, rows: usize) -> Window {
        let cursors = &mut self.cursors;
        let mut tiles: Vec<(TileId, u32)> = Vec::new();
        for_each_row(&parts, self.frame, self.group, |tile, _| {
            let count = &mut cursors[tile.0 as usize];
            if *count == 0 {
                tiles.push((tile, 0));
            }
            *count += 1;
        });
        tiles.sort_unstable();
        let mut end = 0;
        for (tile, tile_end) in &mut tiles {
            let cursor = &mut cursors[tile.0 as usize];
            let count = std::mem::replace(cursor, end);
            end += count;
            *tile_end = end;
        }
        let mut rows_by_tile = vec![0; end as usize];
        for_each_row(&parts, self.frame, self.group, |tile, row| {
            let cursor = &mut cursors[tile.0 as usize];
            rows_by_tile[*cursor as usize] = row;
            *cursor += 1;
        });
        for (tile, _) in &tiles {
            cursors[tile.0 as usize] = 0;
        }
        Window { parts, rows, tiles, rows_by_tile }
    }
}

/// Tells tile and window row of every fragment of a window that covers a sample
/// of the frame and belongs to the group.
#[inline]
fn for_each_row(parts: &[Part], frame: &Frame, group: &Group, mut each: impl FnMut(TileId, u32)) {
    let mask = SampleMask::first(frame.samples());
    for part in parts {
        for row in part.start..part.end {
            let i = row - part.start + part.first;
            if (part.batch.coverage(i) & mask).is_empty() {
                continue;
            }
            let (x, y) = part.batch.pixel(i);
            let tile = frame.grid.tile(x, y);
            if group.holds(tile, x, y) {
                each(tile, row as u32);
            }
        }
    }
}

impl Window {
    fn draw<D: Design, T: Tally>(
        &self,
        design: &D,
        frame: &Frame,
        pass: u32,
        states: &mut TileMap<Vec<D::Pixel>>,
    ) -> T {
        let mut work: Vec<(usize, TileId, &[u32])> = Vec::with_capacity(self.tiles.len());
        let mut start = 0;
        for (tile, end) in &self.tiles {
            let fresh = || sites(frame.grid, *tile).map(|site| design.clear(site)).collect();
            let slot = states.touch(*tile, fresh);
            work.push((slot, *tile, &self.rows_by_tile[start..*end as usize]));
            start = *end as usize;
        }
        work.sort_unstable_by_key(|(slot, ..)| *slot);
        let mut tiles = Vec::with_capacity(work.len());
        let (mut rest, mut skipped) = (states.touched_mut(), 0);
        for (slot, _, rows) in work {
            let (tile, later) = rest[slot - skipped..].split_first_mut().expect("it is touched");
            tiles.push((&mut tile.1, rows));
            (rest, skipped) = (later, slot + 1);
        }
        tiles
            .into_par_iter()
            .map(|(pixels, rows)| {
                let mut tally = T::default();
                self.draw_tile(design, frame, pass, pixels, rows, &mut tally);
                tally
            })
            .reduce(T::default, T::add)
    }

    fn draw_tile<D: Design, T: Tally>(
        &self,
        design: &D,
        frame: &Frame,
        pass: u32,
        pixels: &mut [D::Pixel],
        rows: &[u32],
        tally: &mut T,
    ) {
        let mask = SampleMask::first(frame.samples());
        let mut parts = self.parts.iter();
        let mut part = parts.next().expect("a window has parts");
        for row in rows {
            let row = *row as usize;
            while row >= part.end {
                part = parts.next().expect("rows lie in the parts");
            }
            let mut fragment = part.batch.fragment(row - part.start + part.first);
            fragment.coverage = fragment.coverage & mask;
            draw_one(design, pass, pixels, &fragment, tally);
        }
    }
}

fn draw_one<D: Design, P: Probe>(
    design: &D,
    pass: u32,
    pixels: &mut [D::Pixel],
    fragment: &Fragment,
    probe: &mut P,
) {
    let site = Site { x: fragment.x, y: fragment.y };
    let pixel = &mut pixels[TileGrid::within(site.x, site.y)];
    probe.fragment(fragment.coverage);
    design.draw(pass, site, pixel, fragment, probe);
}

/// One fragment's way through a design.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Step {
    /// Which of the design's passes.
    pub pass: u32,
    /// The fragment's row in the trace.
    pub row: u64,
    /// The fragment, its coverage cut to the replay's samples.
    pub fragment: Fragment,
    /// What the design did.
    pub record: Record,
    /// The pixel's state after it.
    pub contents: Contents,
}

/// What a design did at one pixel.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Explanation {
    /// The pixel's state before the first fragment.
    pub cleared: Contents,
    /// Its fragments in API order, pass after pass.
    pub steps: Vec<Step>,
    /// The pixel's linear colour.
    pub colour: [f64; 3],
}

/// Replays the fragments of pixel `site` alone and writes down what happens.
///
/// # Errors
/// As [`Trace::batch`].
pub fn explain<D: Design>(
    design: &D,
    frame: &Frame,
    trace: &Trace,
    site: Site,
    progress: &dyn Fn(u64, u64),
) -> Result<Explanation> {
    let mask = SampleMask::first(frame.samples());
    let mut fragments: Vec<(u64, Fragment)> = Vec::new();
    let mut row = 0;
    for batch in trace.batches() {
        let batch = batch?;
        for i in (0..batch.len()).filter(|i| batch.pixel(*i) == (site.x, site.y)) {
            let mut fragment = batch.fragment(i);
            fragment.coverage = fragment.coverage & mask;
            if !fragment.coverage.is_empty() {
                fragments.push((row + i as u64, fragment));
            }
        }
        row += batch.len() as u64;
        progress(row, trace.rows());
    }
    let mut pixel = design.clear(site);
    let cleared = design.contents(&pixel);
    let mut steps = Vec::new();
    for pass in 0..design.passes() {
        for (row, fragment) in &fragments {
            let mut record = Record::default();
            record.fragment(fragment.coverage);
            design.draw(pass, site, &mut pixel, fragment, &mut record);
            let contents = design.contents(&pixel);
            steps.push(Step { pass, row: *row, fragment: *fragment, record, contents });
        }
        design.end_pass(pass, site, &mut pixel);
    }
    Ok(Explanation { cleared, steps, colour: design.resolve(site, &pixel) })
}

/// Draws fragments into one pixel, for tests of designs.
pub fn draw_pixel<D: Design>(design: &D, site: Site, fragments: &[Fragment]) -> D::Pixel {
    let mut pixel = design.clear(site);
    for pass in 0..design.passes() {
        for fragment in fragments {
            design.draw(pass, site, &mut pixel, fragment, &mut NoProbe);
        }
        design.end_pass(pass, site, &mut pixel);
    }
    pixel
}
