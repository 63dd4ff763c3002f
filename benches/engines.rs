//! The engines of a design against each other, on one thread, over fragments that are
//! sorted into tiles already: `cargo bench --bench engines`.
//!
//! Every bench first checks that the pictures agree. The plain text of the exact design
//! is also the usual way to do it: a list for each pixel, sorted by the standard library.

use std::fs::File;
use std::hint::black_box;
use std::io::{BufWriter, Write};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rayon::ThreadPoolBuilder;
use screendoor::capture::{Capture, CaptureOptions};
use screendoor::design::{REFERENCE, configure};
use screendoor::param::Options;
use screendoor::rop::{Engine, EventCounts, Frame, ReplayOptions, TileState, Told, Which};
use screendoor::tile::TileId;
use screendoor::trace::{Block, SampleMask, Trace, TraceWriter, WriteOptions};

const SCENE: &str = "builtin:engine";
const SIDE: u32 = 512;

fn captured() -> Trace {
    let scene = screendoor::scene::load(SCENE).expect("it is built in");
    let options = CaptureOptions { width: SIDE, height: SIDE, ..CaptureOptions::default() };
    let capture = Capture::new(&scene, &options).expect("the options are good");
    capture.to_memory(|_, _| ()).expect("it is captured")
}

/// The touched tiles' fragments, as the replay hands them out.
fn binned(trace: &Trace, frame: &Frame) -> Vec<Tile> {
    let mask = SampleMask::first(frame.samples());
    let mut tiles = vec![Vec::new(); frame.grid.count()];
    for batch in trace.batches() {
        for mut fragment in batch.expect("it reads").iter() {
            fragment.coverage = fragment.coverage & mask;
            if !fragment.coverage.is_empty() {
                tiles[frame.grid.tile(fragment.x, fragment.y).0 as usize].push(fragment);
            }
        }
    }
    let tiles = tiles.into_iter().enumerate().filter(|(_, fragments)| !fragments.is_empty());
    tiles.map(|(tile, fragments)| (TileId(tile as u32), Block::all_of(&fragments))).collect()
}

/// Which parts of an engine's work are timed.
#[derive(Clone, Copy, PartialEq)]
enum Work {
    /// Clearing and drawing: the kernel.
    Draw,
    /// The same, with events counted.
    Count,
    /// Clearing, drawing and resolving.
    Picture,
}

fn run(engine: &dyn Engine, frame: &Frame, (tile, blocks): &Tile, work: Work) -> TileState {
    let mut events = EventCounts::default();
    let mut state = engine.clear(frame.grid, *tile);
    for pass in 0..engine.passes() {
        for block in blocks {
            let told = match work {
                Work::Count => Told::Counts(&mut events),
                Work::Draw | Work::Picture => Told::Nobody,
            };
            engine.draw(pass, &mut state, block, told);
        }
        engine.end_pass(pass, frame.grid, *tile, &mut state);
    }
    black_box(events);
    state
}

/// A tile and its fragments.
type Tile = (TileId, Vec<Block>);

/// The engines that this machine can run.
fn engines() -> impl Iterator<Item = (&'static str, Which)> {
    let all = Which::CHOICES.iter().zip(Which::ALL).map(|(choice, which)| (choice.name, *which));
    all.filter(|(_, which)| which.level().is_ok() && *which != Which::Portable)
}

fn bench(c: &mut Criterion, name: &str, counts: &[u32], works: &[(&str, Work)]) {
    let trace = captured();
    let design = configure(name, &[]).expect("defaults are good");
    for samples in counts {
        let frame = design.frame(&trace, *samples, 1).expect("it has the samples");
        let tiles = binned(&trace, &frame);
        let fragments: usize = tiles.iter().flat_map(|(_, blocks)| blocks).map(Block::len).sum();
        let reference = design.build(&frame, Which::Reference).expect("it is built");
        for (label, which) in engines() {
            let engine = design.build(&frame, which).expect("it is built");
            for tile in &tiles {
                let [a, b] = [&engine, &reference].map(|e| {
                    let state = run(&**e, &frame, tile, Work::Picture);
                    e.resolve(frame.grid, tile.0, &state).map(|colour| colour.map(f64::to_bits))
                });
                assert_eq!(a, b, "{name}: {label} differs in {:?}", tile.0);
            }
            for (part, work) in works {
                let mut group = c.benchmark_group(format!("{part}/{name}/{samples}"));
                group.throughput(Throughput::Elements(fragments as u64));
                group.bench_function(label, |b| {
                    b.iter(|| {
                        for tile in &tiles {
                            let state = run(&*engine, &frame, tile, *work);
                            if *work == Work::Picture {
                                black_box(engine.resolve(frame.grid, tile.0, &state));
                            }
                            black_box(state);
                        }
                    });
                });
                group.finish();
            }
        }
    }
}

/// From the mapped file to the picture.
fn replay(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("there is room");
    let path = folder.path().join("engine.arrow");
    let captured = captured();
    let header = captured.header().clone();
    let mut file = BufWriter::new(File::create(&path).expect("it is writable"));
    let mut writer = TraceWriter::new(&mut file, SCENE, header, WriteOptions::default())
        .expect("the header is good");
    for batch in captured.batches() {
        for fragment in batch.expect("it reads").iter() {
            writer.push(&fragment).expect("it writes");
        }
    }
    writer.finish().expect("it writes");
    file.flush().expect("it writes");
    let trace = Trace::open(&path).expect("it opens");
    let mut group = c.benchmark_group("replay/lk/8");
    group.throughput(Throughput::Elements(trace.rows()));
    let design = configure("lk", &[]).expect("defaults are good");
    for threads in [1, 2] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        for (label, which) in [("reference", Which::Reference), ("fast", Which::Fast)] {
            let options = ReplayOptions { engine: which, ..ReplayOptions::default() };
            let run = || design.replay(&trace, 8, 1, &options).expect("it replays");
            group.bench_function(format!("{label}, threads: {threads}"), |b| {
                b.iter(|| pool.install(run));
            });
        }
    }
    group.finish();
}

/// What the machine's memory gives: a sum over more than the caches hold.
fn stream(c: &mut Criterion) {
    let words = vec![1_u64; 1 << 25];
    let mut group = c.benchmark_group("stream");
    group.throughput(Throughput::Bytes(8 << 25));
    group.bench_function("read, threads: 1", |b| {
        b.iter(|| black_box(&words).iter().fold(0_u64, |sum, word| sum.wrapping_add(*word)));
    });
    group.finish();
}

fn exact(c: &mut Criterion) {
    bench(c, REFERENCE, &[1, 8, 64], &[("picture", Work::Picture)]);
}

fn lk(c: &mut Criterion) {
    let works = [("draw", Work::Draw), ("count", Work::Count)];
    bench(c, "lk", &[8], &works);
    bench(c, "lk", &[1, 2, 4, 16, 32, 64], &works[..1]);
}

fn systematic(c: &mut Criterion) {
    bench(c, "systematic", &[8], &[("draw", Work::Draw)]);
}

fn enderton(c: &mut Criterion) {
    bench(c, "enderton", &[8], &[("draw", Work::Draw)]);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = stream, lk, systematic, enderton, exact, replay
}
criterion_main!(benches);
