//! The exact design's engines on one thread, from cleared tiles to their pictures:
//! `cargo bench --bench exact`.
//!
//! The plain text is also the usual way to do it: a list for each pixel, sorted by
//! the standard library. Every bench first checks that the pictures agree.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use screendoor::capture::{Capture, CaptureOptions};
use screendoor::design::{REFERENCE, configure};
use screendoor::picture::TilePixels;
use screendoor::rop::{Engine, Frame, Told, Which};
use screendoor::tile::TileId;
use screendoor::trace::{Fragment, SampleMask, Trace};

const SCENE: &str = "builtin:engine";
const SIDE: u32 = 512;
/// Fragments that the replay hands to an engine at a time.
const CHUNK: usize = 64;

fn captured() -> Trace {
    let scene = screendoor::scene::load(SCENE).expect("it is built in");
    let options = CaptureOptions { width: SIDE, height: SIDE, ..CaptureOptions::default() };
    let capture = Capture::new(&scene, &options).expect("the options are good");
    capture.to_memory(|_, _| ()).expect("it is captured")
}

/// The touched tiles' fragments, as the replay hands them out.
fn binned(trace: &Trace, frame: &Frame) -> Vec<(TileId, Vec<Fragment>)> {
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
    tiles.map(|(tile, fragments)| (TileId(tile as u32), fragments)).collect()
}

fn picture(engine: &dyn Engine, frame: &Frame, tile: TileId, fragments: &[Fragment]) -> TilePixels {
    let mut state = engine.clear(frame.grid, tile);
    for chunk in fragments.chunks(CHUNK) {
        engine.draw(0, &mut state, chunk, Told::Nobody);
    }
    engine.end_pass(0, frame.grid, tile, &mut state);
    engine.resolve(frame.grid, tile, &state)
}

fn exact(c: &mut Criterion) {
    let trace = captured();
    let design = configure(REFERENCE, &[]).expect("defaults are good");
    let mut group = c.benchmark_group("exact");
    for samples in [1, 4, 8, 16, 64] {
        let frame = design.frame(&trace, samples, 1).expect("it has the samples");
        let tiles = binned(&trace, &frame);
        let engine = |which| design.build(&frame, which).expect("it is built");
        let [fast, reference] = [Which::Fast, Which::Reference].map(engine);
        for (tile, fragments) in &tiles {
            let [a, b] = [&fast, &reference].map(|e| picture(&**e, &frame, *tile, fragments));
            let bits = |p: &TilePixels| p.map(|colour| colour.map(f64::to_bits));
            assert_eq!(bits(&a), bits(&b), "the engines differ in {tile:?}");
        }
        let count: usize = tiles.iter().map(|(_, fragments)| fragments.len()).sum();
        group.throughput(Throughput::Elements(count as u64));
        for (name, engine) in [("reference", &reference), ("fast", &fast)] {
            group.bench_function(BenchmarkId::new(name, format!("{samples} samples")), |b| {
                b.iter(|| {
                    for (tile, fragments) in &tiles {
                        black_box(picture(&**engine, &frame, *tile, fragments));
                    }
                });
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = exact
}
criterion_main!(benches);
