//! Fragments per second of capture, trace reading and each design's replay.
//!
//! `cargo bench` runs all; `cargo bench -- replay/lk` a part. Every bench first
//! checks what it is about to time against the hashes in `traces/`, or the plain text.

mod common;

use std::hint::black_box;
use std::path::Path;

use common::{COMPRESSIONS, stored};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayon::ThreadPoolBuilder;
use screendoor::capture::{Capture, CaptureOptions};
use screendoor::design::DESIGNS;
use screendoor::error::Result;
use screendoor::rop::{Implementation, ReplayOptions, Replayed};
use screendoor::trace::{Compression, Trace};

/// The trace that is timed, and the scene it is made of (`traces/README.md`).
const TRACE: &str = "engine";
const SCENE: &str = "builtin:engine:rows=1,detail=2";
const SEED: u32 = 1;

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/traces"))
}

fn open() -> Trace {
    Trace::open(folder().join(format!("{TRACE}.arrow"))).expect("the trace is in the tree")
}

fn capture(c: &mut Criterion) {
    let scene = screendoor::scene::load(SCENE).expect("it is built in");
    let options = CaptureOptions { width: 64, height: 64, ..CaptureOptions::default() };
    let capture = Capture::new(&scene, &options).expect("the options are good");
    let made = capture.to_memory(|_, _| ()).expect("it is captured");
    let expected = open();
    assert_eq!(made.content(), expected.content(), "the capture has changed");

    let mut group = c.benchmark_group("capture");
    group.throughput(Throughput::Elements(expected.rows()));
    group.bench_function(TRACE, |b| b.iter(|| capture.to_memory(|_, _| ()).map(black_box)));
    group.finish();
}

fn read(c: &mut Criterion) {
    let source = open();
    let mut group = c.benchmark_group("read");
    group.throughput(Throughput::Elements(source.rows()));
    for (name, compression) in COMPRESSIONS {
        let trace = stored(&source, compression);
        let hash = trace.verify(|_| ()).expect("it holds");
        assert_eq!(Some(hash.as_str()), source.content(), "the trace has changed");
        group.bench_function(name, |b| {
            b.iter(|| {
                let rows: usize = trace.batches().map(|b| black_box(b.expect("good")).len()).sum();
                assert_eq!(rows as u64, trace.rows());
            });
        });
    }
    group.finish();
}

fn replay(c: &mut Criterion) {
    // Uncompressed: the designs are timed, not the decoder.
    let trace = stored(&open(), Compression::None);
    let mut group = c.benchmark_group("replay");
    group.throughput(Throughput::Elements(trace.rows()));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    for entry in DESIGNS {
        let design = entry.configure(&[]).expect("defaults are good");
        for samples in [4, 8, 16, 64] {
            let name = entry.info.name;
            let with = |implementation| {
                let options = ReplayOptions { implementation, ..ReplayOptions::default() };
                design.replay(&trace, samples, SEED, &options)
            };
            let run = || with(Implementation::Fast);
            let picture = |run: Result<Replayed>| run.expect("it replays").picture.hash();
            let expected = picture(with(Implementation::Reference));
            assert_eq!(picture(run()), expected, "{name} at {samples} is not the plain text");
            for threads in if threads > 1 { vec![1, threads] } else { vec![1] } {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
                let id = BenchmarkId::new(name, format!("{samples} samples, {threads} threads"));
                group.bench_function(id, |b| b.iter(|| pool.install(run).map(black_box)));
            }
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = capture, read, replay
}
criterion_main!(benches);
