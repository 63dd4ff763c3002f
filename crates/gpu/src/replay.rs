//! Replaying a trace on a GPU: chunk by chunk, sorted by pixel there, a thread for each
//! pixel; the pixels' state stays on the device.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;

use crate::bin::{Binner, Scratch, uniform};
use crate::chunk::{Chunks, Uploaded};
use crate::device::{Gpu, most_bytes};
use crate::kept::{Kept, Key, Ready};
use crate::options::{GpuOptions, GpuSeconds, Threads};
use crate::params::Params;
use crate::program::Program;
use crate::shader;
use crate::time::Timer;
use screendoor_designs::Configured;
use screendoor_rop::{Constant, Frame, Port, Replayed, Shader, TileState, TileWords};
use screendoor_trace::error::Result;
use screendoor_trace::picture::{Picture, TilePixels};
use screendoor_trace::tile::{TILE_PIXELS, TileId, TileMap};
use screendoor_trace::trace::Trace;

/// A replay on a GPU, its state still there.
pub struct GpuRun<'a> {
    gpu: &'a Gpu,
    port: &'a Port,
    frame: &'a Frame,
    params: Params,
    programs: Programs,
    timer: Timer,
    pages: Vec<Page>,
    /// The touched tiles, in the order of their places.
    tiles: Vec<TileId>,
    tile_of: wgpu::Buffer,
    /// Fragments drawn, over all passes.
    fragments: u64,
    seconds: GpuSeconds,
    start: Instant,
}

/// The state of some tiles' pixels.
struct Page {
    state: wgpu::Buffer,
    /// Its first tile's place, and how many it holds.
    first: usize,
    tiles: usize,
}

/// What sorts chunks.
struct Sorter {
    binner: Binner,
    scratch: Scratch,
    /// Each tile's place among the touched ones.
    slots: Vec<u32>,
}

impl Sorter {
    fn new(gpu: &Gpu, frame: &Frame, chunks: &Chunks) -> Result<Self> {
        let most = (0..chunks.len()).map(|i| chunks.rows(i)).max().unwrap_or(0);
        Ok(Sorter {
            binner: Binner::new(gpu, frame.samples(), &chunks.types().collect::<Vec<_>>())?,
            scratch: Scratch::new(gpu, most)?,
            slots: vec![0; frame.grid.count()],
        })
    }
}

/// A program of a design.
struct Step {
    /// As what its time is counted.
    name: &'static str,
    program: Program,
    /// Pixels that a group is given.
    pixels: usize,
}

/// The design's programs.
struct Programs {
    clear: Step,
    draw: Step,
    /// How many fragments of each pixel are drawn at a time.
    fragments: u32,
    end_pass: Option<Step>,
    resolve: Option<Step>,
    tables: wgpu::Buffer,
    /// What is bound where a program looks at nothing: to read from, and to write to.
    nothing: [wgpu::Buffer; 2],
}

/// Loop iterations of a thread, at most. Mesa's software driver ends all loops of a thread
/// without a word after 65535 of them, and others take a device for lost that is busy for
/// seconds.
const ITERATIONS: u32 = 60_000;

/// Rows of a chunk, at most, whatever a buffer holds: shaders count them in 32 bits.
const MAX_ROWS: u64 = 1 << 30;

/// Threads of a group of `shaders/replay.wgsl`.
const GROUP: usize = 64;

/// Replays `trace` through a design on a GPU: the result, where the time went, and how many fragments
/// were drawn over all passes.
///
/// # Errors
/// As [`Configured::port`], [`Frame::of`] and [`GpuRun::new`].
pub fn replay(
    gpu: &Gpu,
    design: &Configured,
    trace: &Trace,
    samples: u32,
    seed: u32,
    options: &GpuOptions<'_>,
) -> Result<(Replayed, GpuSeconds, u64)> {
    let frame = design.frame(trace, samples, seed)?;
    let port = design.port(&frame)?;
    let mut run = GpuRun::new(gpu, &port, &frame, trace, options)?;
    let picture = run.picture()?;
    let replayed = Replayed {
        picture,
        events: None,
        state_bits: port.plain.state_bits(),
        layout: port.plain.layout(),
        passes: port.plain.passes(),
        touched_tiles: run.touched_tiles(),
    };
    Ok((replayed, run.seconds().clone(), run.fragments()))
}

impl Programs {
    fn new(
        gpu: &Gpu,
        port: &Port,
        frame: &Frame,
        chunks: &Chunks,
        threads: Threads,
    ) -> Result<Self> {
        let samples = frame.samples();
        let source = source(&[port.program], port, samples, chunks.types());
        let step = |name| -> Result<Step> {
            Ok(Step { name, program: gpu.program(&source, name)?, pixels: GROUP })
        };
        let by_sample = threads == Threads::Sample && port.by_sample;
        let (draw, iterations) = if by_sample {
            let file = lanes_file(gpu, samples);
            let source =
                self::source(&[port.program, shader::named(file)], port, samples, chunks.types());
            let program = gpu.program(&source, "draw_lanes")?;
            // Two loops over the samples, and what a reference value may take.
            let iterations = 2 * samples + u32::BITS;
            (Step { name: "draw", program, pixels: GROUP / samples as usize }, iterations)
        } else {
            (step("draw")?, port.iterations)
        };
        let storage = wgpu::BufferUsages::STORAGE;
        Ok(Programs {
            clear: step("clear")?,
            draw,
            fragments: (ITERATIONS / (iterations + 1)).max(1),
            end_pass: port.ends_passes.then(|| step("end_pass")).transpose()?,
            resolve: port.resolves.then(|| step("resolve")).transpose()?,
            tables: gpu.filled("tables", bytemuck::cast_slice(&tables(port, frame)), storage)?,
            nothing: [gpu.buffer("nothing", 8, storage)?, gpu.buffer("nothing", 8, storage)?],
        })
    }
}

/// How the threads of a pixel look at each other's values.
fn lanes_file(gpu: &Gpu, samples: u32) -> &'static str {
    let [least, most] = gpu.adapter().subgroup;
    // A group must be made of whole subgroups, and these of whole pixels.
    let fits = |size: u32| size >= samples && size <= GROUP as u32 && size.is_power_of_two();
    match gpu.has_subgroups() && fits(least) && fits(most) {
        true => "lanes_subgroup",
        false => "lanes_workgroup",
    }
}

/// The text of a design's program for a trace's columns.
pub(super) fn source(
    files: &[Shader],
    port: &Port,
    samples: u32,
    types: impl Iterator<Item = (String, Constant)>,
) -> String {
    let mut constants = port.constants.clone();
    constants.extend(types);
    constants.extend(port.places());
    shader::program(files, samples, &constants)
}

/// The samples' places and what else the design asks for.
fn tables(port: &Port, frame: &Frame) -> Vec<u32> {
    let place = |[x, y]: &[i8; 2]| u32::from(*x as i16 as u16) | u32::from(*y as i16 as u16) << 16;
    let places = frame.positions.iter().map(place);
    let ranks = port.ranks.into_iter().flatten().copied().collect::<Vec<u16>>();
    places.chain(ranks.chunks(2).map(|r| u32::from(r[0]) | u32::from(r[1]) << 16)).collect()
}

impl<'a> GpuRun<'a> {
    /// Draws all of `trace`.
    ///
    /// # Errors
    /// As [`Trace::batch`]; [`screendoor_trace::error::Error::Gpu`] where the device fails.
    pub fn new(
        gpu: &'a Gpu,
        port: &'a Port,
        frame: &'a Frame,
        trace: &Trace,
        options: &GpuOptions<'_>,
    ) -> Result<Self> {
        let start = Instant::now();
        let bytes = most_bytes(&gpu.device);
        // Behind the keys stands their number.
        let rows = options.rows.min(bytes / 4 - 1).min(MAX_ROWS);
        let chunks = Chunks::of(trace, bytes, rows, frame.columns);
        let mut run = GpuRun {
            gpu,
            port,
            frame,
            params: Params::of(frame),
            programs: Programs::new(gpu, port, frame, &chunks, options.threads)?,
            timer: Timer::new(gpu)?,
            pages: Vec::new(),
            tiles: Vec::new(),
            tile_of: gpu.buffer("tiles", 4, wgpu::BufferUsages::STORAGE)?,
            fragments: 0,
            seconds: GpuSeconds::default(),
            start,
        };
        let (samples, columns) = (frame.samples(), frame.columns);
        let key = Key { trace: trace.mark(), samples, columns, rows };
        run.draw_all(trace, &chunks, key, options)?;
        gpu.wait("drawing")?;
        Ok(run)
    }

    fn draw_all(
        &mut self,
        trace: &Trace,
        chunks: &Chunks,
        key: Key,
        options: &GpuOptions<'_>,
    ) -> Result<()> {
        let kept = if options.keep { self.gpu.kept.get(trace, &key)? } else { None };
        let mut ready: Vec<Option<Arc<Ready>>> = vec![None; chunks.len()];
        let mut sorter = None;
        if let Some(kept) = kept {
            self.tiles = kept.tiles;
            self.make_room(0)?;
            ready = kept.chunks.into_iter().map(Some).collect();
        } else {
            sorter = Some(Sorter::new(self.gpu, self.frame, chunks)?);
        }
        let pixels = self.frame.grid.count() * TILE_PIXELS;
        let bytes = |i| Ready::bytes(chunks.bytes(i), chunks.rows(i), pixels);
        let mut left = options.resident;
        let passes = self.port.plain.passes();
        // Only all chunks are of use for the next replay.
        let keeps = options.keep && (0..chunks.len()).map(bytes).sum::<u64>() <= left;
        let (mut done, total) = (0, trace.rows() * u64::from(passes));
        for pass in 0..passes {
            self.params.pass_number = pass;
            for (i, place) in ready.iter_mut().enumerate() {
                let chunk = match (&*place, &mut sorter) {
                    (Some(chunk), _) => Arc::clone(chunk),
                    (None, Some(sorter)) => {
                        let begun = Instant::now();
                        let uploaded = chunks.upload(self.gpu, trace, i, &self.params)?;
                        self.gpu.wait("uploading")?;
                        self.seconds.upload += begun.elapsed().as_secs_f64();
                        if pass == 0 {
                            self.touch(sorter, &uploaded)?;
                        }
                        Arc::new(self.sort(sorter, uploaded)?)
                    }
                    (None, None) => unreachable!("all chunks are kept, or none"),
                };
                self.draw(&chunk)?;
                self.fragments += u64::from(chunk.sorted.kept);
                if place.is_none() && pass == 0 && (passes > 1 || keeps) && bytes(i) <= left {
                    left -= bytes(i);
                    *place = Some(chunk);
                }
                done += chunks.rows(i) as u64;
                (options.progress)(done, total);
            }
            if let Some(step) = &self.programs.end_pass {
                self.for_all_pages(step, None)?;
            }
        }
        if sorter.is_some()
            && keeps
            && let Some(chunks) = ready.into_iter().collect()
        {
            self.gpu.kept.put(Kept { key, tiles: self.tiles.clone(), chunks });
        }
        Ok(())
    }

    /// Makes room for the tiles that a chunk is the first to touch.
    fn touch(&mut self, sorter: &mut Sorter, chunk: &Uploaded) -> Result<()> {
        let tiles = sorter.slots.len();
        let bits = sorter.binner.touched(self.gpu, &self.timer, chunk, tiles)?;
        let first = self.tiles.len();
        for (tile, slot) in sorter.slots.iter_mut().enumerate() {
            let touched = bits[tile / 32] >> (tile % 32) & 1 == 1;
            let known = self.tiles.get(*slot as usize) == Some(&TileId(tile as u32));
            if touched && !known {
                *slot = self.tiles.len() as u32;
                self.tiles.push(TileId(tile as u32));
            }
        }
        self.make_room(first)
    }

    /// Makes room for the state of the touched tiles from the `first` on.
    fn make_room(&mut self, first: usize) -> Result<()> {
        if first == self.tiles.len() {
            return Ok(());
        }
        let tiles: Vec<u32> = self.tiles.iter().map(|tile| tile.0).collect();
        let usage = wgpu::BufferUsages::STORAGE;
        self.tile_of = self.gpu.filled("tiles", bytemuck::cast_slice(&tiles), usage)?;
        let words = u64::from(self.port.words()) * TILE_PIXELS as u64;
        let most = ((most_bytes(&self.gpu.device) / (4 * words.max(3))) as usize).max(1);
        let mut at = first;
        while at < self.tiles.len() {
            let tiles = most.min(self.tiles.len() - at);
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
            let state = self.gpu.buffer("state", 4 * words * tiles as u64, usage)?;
            self.pages.push(Page { state, first: at, tiles });
            let page = self.pages.len() - 1;
            self.run_on(page, &self.programs.clear, None, None)?;
            at += tiles;
        }
        Ok(())
    }

    fn sort(&self, sorter: &Sorter, uploaded: Uploaded) -> Result<Ready> {
        let Sorter { binner, scratch, slots } = sorter;
        let usage = wgpu::BufferUsages::STORAGE;
        let slots = self.gpu.filled("tiles' places", bytemuck::cast_slice(slots), usage)?;
        let places = (&slots, self.tiles.len());
        let sorted = binner.sort(self.gpu, &self.timer, scratch, &uploaded, places)?;
        Ok(Ready { uploaded, sorted })
    }

    /// Draws a chunk, so many fragments of each pixel at a time that no driver loses
    /// patience.
    fn draw(&self, chunk: &Ready) -> Result<()> {
        let fragments = self.programs.fragments;
        for from in (0..chunk.sorted.longest).step_by(fragments as usize) {
            // What is the frame's may be another replay's there: its seed, say.
            let Params { rows, columns, .. } = chunk.uploaded.params;
            let part = Params { rows, columns, from_fragment: from, fragments, ..self.params };
            self.for_all_pages(&self.programs.draw, Some((chunk, part)))?;
        }
        Ok(())
    }

    fn for_all_pages(&self, step: &Step, chunk: Option<(&Ready, Params)>) -> Result<()> {
        let mut pages = 0..self.pages.len();
        pages.try_for_each(|page| self.run_on(page, step, chunk, None))
    }

    /// Runs a program for the pixels of a page, as far as the chunk knows them.
    fn run_on(
        &self,
        page: usize,
        step: &Step,
        chunk: Option<(&Ready, Params)>,
        picture: Option<&wgpu::Buffer>,
    ) -> Result<()> {
        let Page { state, first, tiles } = &self.pages[page];
        let (first_pixel, pixels) = (first * TILE_PIXELS, tiles * TILE_PIXELS);
        let known = chunk.map_or(usize::MAX, |(chunk, _)| chunk.sorted.pixels as usize);
        let taken = pixels.min(known.saturating_sub(first_pixel));
        if taken == 0 {
            return Ok(());
        }
        let params = Params {
            pass_number: self.params.pass_number,
            first_pixel: first_pixel as u32,
            pixels: pixels as u32,
            taken: taken as u32,
            ..chunk.map_or(self.params, |(_, params)| params)
        };
        let chunk = chunk.map(|(chunk, _)| chunk);
        // What is not there is not read.
        let [nothing, nowhere] = &self.programs.nothing;
        let buffers = [
            ("params", &uniform(self.gpu, &params)?),
            ("columns", chunk.map_or(nothing, |chunk| &chunk.uploaded.columns)),
            ("tables", &self.programs.tables),
            ("state", state),
            ("rows", chunk.map_or(nothing, |chunk| &chunk.sorted.rows)),
            ("ends", chunk.map_or(nothing, |chunk| &chunk.sorted.ends)),
            ("tile_of", &self.tile_of),
            ("picture", picture.unwrap_or(nowhere)),
        ];
        let bound = self.gpu.bind(&step.program, &buffers)?;
        let groups = taken.div_ceil(step.pixels) as u64;
        self.gpu.submit(step.name, |encoder| {
            self.timer.run(self.gpu, encoder, step.name, (&step.program, &bound), groups);
            Ok(())
        })
    }

    /// How many tiles hold a fragment.
    pub fn touched_tiles(&self) -> usize {
        self.tiles.len()
    }

    /// How many fragments were drawn; over several passes each counts several times.
    pub fn fragments(&self) -> u64 {
        self.fragments
    }

    /// Where the time went, until the picture was made; before, reading and upload alone.
    pub fn seconds(&self) -> &GpuSeconds {
        &self.seconds
    }

    /// Brings the state back and hands each tile's to `look`, as the plain text holds it.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Gpu`] where the device fails.
    pub fn states<T: Send>(
        &self,
        look: impl Fn(TileId, TileState) -> T + Sync,
    ) -> Result<Vec<(TileId, T)>> {
        let mut all = Vec::with_capacity(self.tiles.len());
        for page in &self.pages {
            let stride = page.tiles * TILE_PIXELS;
            let tiles = &self.tiles[page.first..page.first + page.tiles];
            let found: Vec<_> = self.gpu.read(&page.state, "bringing the state back", |words| {
                let tile = |(i, tile): (usize, &TileId)| {
                    let words = TileWords { words, stride, first: i * TILE_PIXELS };
                    (*tile, look(*tile, self.port.restore(self.frame.grid, *tile, words)))
                };
                tiles.par_iter().enumerate().map(tile).collect()
            })?;
            all.extend(found);
        }
        Ok(all)
    }

    /// The picture: of the device's own sums where they are the plain text's, and else
    /// resolved by the plain text.
    ///
    /// # Errors
    /// As [`GpuRun::states`].
    pub fn picture(&mut self) -> Result<Picture> {
        let begun = Instant::now();
        let grid = self.frame.grid;
        let tiles = match &self.programs.resolve {
            Some(step) => self.resolved(step)?,
            None => self.states(|tile, state| self.port.plain.resolve(grid, tile, &state))?,
        };
        let mut finished: TileMap<TilePixels> = TileMap::new(grid);
        for (tile, pixels) in tiles {
            finished.get_or_insert_with(tile, || pixels);
        }
        self.seconds.device = self.timer.seconds(self.gpu)?;
        self.seconds.back = begun.elapsed().as_secs_f64();
        self.seconds.wall = self.start.elapsed().as_secs_f64();
        let background = self.frame.background.map(f64::from);
        Ok(Picture::from_tiles(background, finished).in_space(self.frame.space))
    }

    fn resolved(&self, step: &Step) -> Result<Vec<(TileId, TilePixels)>> {
        let mut all = Vec::with_capacity(self.tiles.len());
        for (i, page) in self.pages.iter().enumerate() {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
            let bytes = (12 * page.tiles * TILE_PIXELS) as u64;
            let picture = self.gpu.buffer("the picture", bytes, usage)?;
            self.run_on(i, step, None, Some(&picture))?;
            let tiles = &self.tiles[page.first..page.first + page.tiles];
            self.gpu.read(&picture, "bringing the picture back", |words| {
                for (tile, words) in tiles.iter().zip(words.chunks_exact(3 * TILE_PIXELS)) {
                    let colour = |i: usize| f64::from(f32::from_bits(words[i]));
                    let mut pixels: TilePixels = Box::new([[0.0; 3]; TILE_PIXELS]);
                    for (i, pixel) in pixels.iter_mut().enumerate() {
                        *pixel = std::array::from_fn(|c| colour(3 * i + c));
                    }
                    all.push((*tile, pixels));
                }
            })?;
        }
        Ok(all)
    }
}
