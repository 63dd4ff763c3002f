//! What a replay costs beside its design: reading, checking, decoding, sorting by tile,
//! resolving.
//!
//! The engine here does next to nothing, so that what is left is the replay's own. Every
//! bench first checks what it is about to time.

mod common;

use std::hint::black_box;

use common::{COMPRESSIONS, captured, stored};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use screendoor::picture::TilePixels;
use screendoor::rop::{
    Contents, Frame, Layout, Listener, ReplayOptions, Replayed, TileState, TiledDesign, replay,
};
use screendoor::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor::trace::{Block, Trace};

/// Layers over every pixel: two million fragments.
const SCENE: &str = "builtin:layers:count=32,alpha=0.1,coloured=true";
const SIDE: u32 = 256;
const SAMPLES: u32 = 8;

/// Counts a tile's fragments.
struct Counting;

impl TiledDesign for Counting {
    fn passes(&self) -> u32 {
        1
    }

    fn layout(&self) -> Layout {
        Layout::default()
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        None
    }

    fn clear(&self, _: TileGrid, _: TileId) -> TileState {
        Box::new([0_u64; 2])
    }

    fn draw(&self, _: u32, state: &mut TileState, fragments: &Block, _: Listener<'_>) {
        let [count, bits] = state.downcast_mut::<[u64; 2]>().expect("it is this engine's own");
        // Every fragment is looked at, as a design would.
        for fragment in fragments.iter() {
            *count += 1;
            *bits ^= fragment.coverage.0 ^ u64::from(fragment.primitive);
        }
    }

    fn end_pass(&self, _: u32, _: TileGrid, _: TileId, _: &mut TileState, _: Listener<'_>) {}

    fn resolve(&self, _: TileGrid, _: TileId, state: &TileState) -> TilePixels {
        let [count, bits] = state.downcast_ref::<[u64; 2]>().expect("it is this engine's own");
        Box::new([[*count as f64, (bits & 0xff) as f64, 0.0]; TILE_PIXELS])
    }

    fn contents(&self, _: &TileState, _: usize) -> Contents {
        Contents::default()
    }
}

/// The trace with its columns stored in each way, in memory: no file system is timed.
fn traces() -> Vec<(&'static str, Trace)> {
    let captured = captured(SCENE, SIDE);
    let store = |(name, compression)| (name, stored(&captured, compression));
    COMPRESSIONS.into_iter().map(store).collect()
}

/// Fragments that cover one of the replay's samples.
fn drawn(trace: &Trace) -> u64 {
    let mask = screendoor::trace::SampleMask::first(SAMPLES);
    let batches = trace.batches().map(|batch| batch.expect("it reads"));
    batches.map(|b| b.iter().filter(|f| !(f.coverage & mask).is_empty()).count() as u64).sum()
}

fn whole(c: &mut Criterion) {
    let mut group = c.benchmark_group("pipeline/replay");
    for (name, trace) in traces() {
        group.throughput(Throughput::Elements(trace.rows()));
        let frame = Frame::of(&trace, SAMPLES, 1).expect("it has the samples");
        // The file is read each time.
        let options = ReplayOptions { keep: false, ..ReplayOptions::default() };
        let run = || replay(&Counting, &frame, &trace, &options).expect("it runs");
        let counted = |replayed: &Replayed| -> u64 {
            let tiles =
                (0..frame.grid.count() as u32).filter_map(|t| replayed.picture.tile(TileId(t)));
            tiles.map(|pixels| pixels[0][0] as u64).sum()
        };
        assert_eq!(counted(&run()), drawn(&trace), "fragments are lost");
        for threads in [1, 2] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let id = BenchmarkId::new(name, format!("{threads} threads"));
            group.bench_function(id, |b| b.iter(|| pool.install(run)));
        }
    }
    group.finish();
}

fn read(c: &mut Criterion) {
    let mut group = c.benchmark_group("pipeline/read and check");
    for (name, trace) in traces() {
        group.throughput(Throughput::Elements(trace.rows()));
        for threads in [1, 2] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let rows = || -> u64 {
                let batches = (0..trace.batch_count()).into_par_iter();
                batches.map(|i| black_box(trace.batch(i).expect("it reads")).len() as u64).sum()
            };
            assert_eq!(rows(), trace.rows());
            let id = BenchmarkId::new(name, format!("{threads} threads"));
            group.bench_function(id, |b| b.iter(|| pool.install(rows)));
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = read, whole
}
criterion_main!(benches);
