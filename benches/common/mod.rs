//! What the benches share: traces that are made on the spot, and kernels on their own.
#![allow(dead_code, reason = "no bench uses all of it")]

use std::fs::File;
use std::hint::black_box;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use screendoor::capture::{Capture, CaptureOptions};
use screendoor::param::Options;
use screendoor::picture::TilePixels;
use screendoor::rop::{BlockList, EventCounts, Frame, Implementation, Listener, TiledDesign};
use screendoor::tile::TileId;
use screendoor::trace::{Block, Compression, SampleMask, Trace, TraceWriter, WriteOptions};

/// A square trace of a scene, in memory.
pub fn captured(scene: &str, side: u32) -> Trace {
    let scene = screendoor::scene::load(scene).expect("it is built in");
    let options = CaptureOptions { width: side, height: side, ..CaptureOptions::default() };
    let capture = Capture::new(&scene, &options).expect("the options are good");
    capture.to_memory(|_, _| ()).expect("it is captured")
}

/// Writes a trace's fragments as `options` say.
pub fn write<W: Write>(source: &Trace, to: W, options: WriteOptions) -> W {
    let header = source.header().clone();
    let mut writer = TraceWriter::new(to, "bench", header, options).expect("the header is good");
    for batch in source.batches() {
        for fragment in batch.expect("it reads").iter() {
            writer.push(&fragment).expect("it writes");
        }
    }
    writer.finish().expect("it writes").0
}

/// How a trace's columns can be stored.
pub const COMPRESSIONS: [(&str, Compression); 3] =
    [("none", Compression::None), ("lz4", Compression::Lz4), ("zstd", Compression::Zstd)];

/// The same trace in memory, its columns stored otherwise.
pub fn stored(source: &Trace, compression: Compression) -> Trace {
    let options = WriteOptions { compression, ..WriteOptions::default() };
    Trace::from_bytes(write(source, Vec::new(), options), "bench").expect("it opens")
}

/// A trace that `write` writes to a file, mapped.
pub fn in_file(path: &Path, write: impl FnOnce(BufWriter<File>) -> BufWriter<File>) -> Trace {
    let file = File::create(path).expect("it is writable");
    // Large writes make large folios of the page cache, which are mapped sooner.
    write(BufWriter::with_capacity(1 << 20, file)).flush().expect("it writes");
    Trace::open(path).expect("it opens")
}

/// A tile and its fragments, in the blocks in which a replay hands them out.
pub type Tile = (TileId, Vec<Block>);

/// The touched tiles' fragments, and how many there are.
pub fn binned(trace: &Trace, frame: &Frame) -> (Vec<Tile>, usize) {
    let mask = SampleMask::first(frame.samples());
    let mut tiles = vec![Vec::new(); frame.grid.count()];
    let mut count = 0;
    for batch in trace.batches() {
        for mut fragment in batch.expect("it reads").iter() {
            fragment.coverage = fragment.coverage & mask;
            if !fragment.coverage.is_empty() {
                tiles[frame.grid.tile(fragment.x, fragment.y).0 as usize].push(fragment);
                count += 1;
            }
        }
    }
    let tiles = tiles.into_iter().enumerate().filter(|(_, fragments)| !fragments.is_empty());
    let tile =
        |(tile, fragments): (usize, Vec<_>)| (TileId(tile as u32), Block::all_of(&fragments));
    (tiles.map(tile).collect(), count)
}

/// Which parts of an engine's work are timed.
#[derive(Clone, Copy, PartialEq)]
pub enum Work {
    /// Clearing, drawing and resolving, as a replay has it done: the kernel.
    Picture,
    /// The same, with events counted.
    Count,
    /// Clearing and drawing into a tile's state, all of its fragments at once.
    Draw,
    /// Clearing, drawing a block at a time, as is done with few fragments of a tile, and
    /// resolving.
    Blocks,
}

/// Draws a tile; its colours, and the time that it took. A replay has just copied a block when
/// it is drawn: here, too, they are copied first, which is not timed.
pub fn draw(
    engine: &dyn TiledDesign,
    frame: &Frame,
    (tile, blocks): &Tile,
    work: Work,
) -> (TilePixels, Duration) {
    let mut events = EventCounts::default();
    let near = black_box(blocks.clone());
    let resolved = work != Work::Draw;
    let start = Instant::now();
    if matches!(work, Work::Picture | Work::Count) {
        let told = told(&mut events, work);
        let mut list = BlockList::new(&near);
        if let Some(pixels) = engine.picture(frame.grid, *tile, &mut list, told) {
            return (pixels, start.elapsed());
        }
    }
    let mut state = engine.clear(frame.grid, *tile);
    for pass in 0..engine.passes() {
        if work == Work::Blocks {
            for block in &near {
                engine.draw(pass, &mut state, block, Listener::Nobody);
            }
        } else {
            let told = told(&mut events, work);
            engine.draw_blocks(pass, &mut state, &mut BlockList::new(&near), told);
        }
        engine.end_pass(pass, frame.grid, *tile, &mut state, Listener::Nobody);
    }
    let drawn = start.elapsed();
    let pixels = engine.resolve(frame.grid, *tile, &state);
    let time = if resolved { start.elapsed() } else { drawn };
    black_box(events);
    (pixels, time)
}

fn told(events: &mut EventCounts, work: Work) -> Listener<'_> {
    if work == Work::Count { Listener::Counts(events) } else { Listener::Nobody }
}

/// The time that all tiles take, one after the other.
pub fn draw_all(engine: &dyn TiledDesign, frame: &Frame, tiles: &[Tile], work: Work) -> Duration {
    tiles.iter().map(|tile| black_box(draw(engine, frame, tile, work)).1).sum()
}

/// Panics where two engines do not agree to the last bit, or one with itself.
pub fn assert_same(a: &dyn TiledDesign, b: &dyn TiledDesign, frame: &Frame, tiles: &[Tile]) {
    for tile in tiles {
        let works = [Work::Picture, Work::Count, Work::Draw, Work::Blocks];
        let pixels = works.map(|work| draw(a, frame, tile, work).0).into_iter();
        let bits = |pixels: TilePixels| pixels.map(|colour| colour.map(f64::to_bits));
        let expected = bits(draw(b, frame, tile, Work::Draw).0);
        for pixels in pixels {
            assert_eq!(bits(pixels), expected, "engines differ in {:?}", tile.0);
        }
    }
}

/// The engines that this machine can run.
pub fn engines() -> impl Iterator<Item = (&'static str, Implementation)> {
    let all = Implementation::CHOICES
        .iter()
        .zip(Implementation::ALL)
        .map(|(choice, implementation)| (choice.name, *implementation));
    all.filter(|(_, implementation)| implementation.level().is_ok())
}

/// What is read when the machine's memory is measured: more than the caches hold.
pub fn stream() -> Vec<u64> {
    vec![1; 1 << 25]
}

/// Reads all of it, at the rate that memory gives.
pub fn sum(words: &[u64]) -> u64 {
    black_box(words).iter().fold(0, |sum, word| sum.wrapping_add(*word))
}
