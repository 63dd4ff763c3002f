//! The engines of a design against each other, on one thread, over fragments that are
//! sorted into tiles already; and whole replays: `cargo bench --bench engines`.
//!
//! Every bench first checks that the pictures agree. The plain text of the exact design
//! is also the usual way to do it: a list for each pixel, sorted by the standard library.

mod common;

use common::{Work, assert_same, binned, captured, draw_all, engines, in_file};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rayon::ThreadPoolBuilder;
use screendoor::design::{REFERENCE, configure};
use screendoor::rop::{Implementation, ReplayOptions};
use screendoor::trace::WriteOptions;

const SCENE: &str = "builtin:engine";
const SIDE: u32 = 512;

fn bench(c: &mut Criterion, name: &str, counts: &[u32], works: &[(&str, Work)]) {
    let trace = captured(SCENE, SIDE);
    let design = configure(name, &[]).expect("defaults are good");
    for samples in counts {
        let frame = design.frame(&trace, *samples, 1).expect("it has the samples");
        let (tiles, fragments) = binned(&trace, &frame);
        let reference = design.build(&frame, Implementation::Reference).expect("it is built");
        for (label, implementation) in engines() {
            let engine = design.build(&frame, implementation).expect("it is built");
            assert_same(&*engine, &*reference, &frame, &tiles);
            for (part, work) in works {
                let mut group = c.benchmark_group(format!("{part}/{name}/{samples}"));
                group.throughput(Throughput::Elements(fragments as u64));
                group.bench_function(label, |b| {
                    b.iter_custom(|times| {
                        (0..times).map(|_| draw_all(&*engine, &frame, &tiles, *work)).sum()
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
    let memory = captured(SCENE, SIDE);
    let trace = in_file(&folder.path().join("engine.arrow"), |file| {
        common::write(&memory, file, WriteOptions::default())
    });
    let mut group = c.benchmark_group("replay/lk/8");
    group.throughput(Throughput::Elements(trace.rows()));
    let design = configure("lk", &[]).expect("defaults are good");
    for threads in [1, 2] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        for (label, implementation) in
            [("reference", Implementation::Reference), ("fast", Implementation::Fast)]
        {
            let options = ReplayOptions { implementation, ..ReplayOptions::default() };
            let run = || design.replay(&trace, 8, 1, &options).expect("it replays");
            group.bench_function(format!("{label}, threads: {threads}"), |b| {
                b.iter(|| pool.install(run));
            });
        }
    }
    group.finish();
}

/// What the machine's memory gives.
fn stream(c: &mut Criterion) {
    let words = common::stream();
    let mut group = c.benchmark_group("stream");
    group.throughput(Throughput::Bytes(size_of_val(&words[..]) as u64));
    group.bench_function("read, threads: 1", |b| b.iter(|| common::sum(&words)));
    group.finish();
}

fn exact(c: &mut Criterion) {
    bench(c, REFERENCE, &[1, 8, 64], &[("picture", Work::Picture)]);
}

fn lk(c: &mut Criterion) {
    let works = [
        ("picture", Work::Picture),
        ("draw", Work::Draw),
        ("blocks", Work::Blocks),
        ("count", Work::Count),
    ];
    bench(c, "lk", &[8], &works);
    bench(c, "lk", &[1, 2, 4, 16, 32, 64], &works[..1]);
}

fn systematic(c: &mut Criterion) {
    bench(c, "systematic", &[8], &[("picture", Work::Picture)]);
}

fn enderton(c: &mut Criterion) {
    bench(c, "enderton", &[8], &[("picture", Work::Picture)]);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = stream, lk, systematic, enderton, exact, replay
}
criterion_main!(benches);
