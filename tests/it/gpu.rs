//! The GPU port gives the bits of the plain text. Without an adapter these tests are
//! counted as skipped, or fail where `SCREENDOOR_GPU=require` says that there is one.

use screendoor::design::{Configured, DESIGNS};
use screendoor::gpu::{Gpu, GpuOptions, GpuRun};
use screendoor::rop::{Contents, Frame, ReplayOptions, Told, Which};
use screendoor::tile::{TileGrid, TileId};
use screendoor::trace::{Block, Fragment, Header, Trace, WriteOptions};

use crate::fast::crowd;
use crate::util::{gpu, header, random_fragments, trace, trace_bytes, variants};

/// What the touched tiles' pixels hold, and the picture's hash.
type Found = (Vec<(TileId, Vec<Contents>)>, String);

fn on_gpu(
    gpu: &Gpu,
    design: &Configured,
    trace: &Trace,
    frame: &Frame,
    options: &GpuOptions,
) -> Found {
    let port = design.port(frame).unwrap();
    let mut run = GpuRun::new(gpu, &port, frame, trace, options).unwrap();
    let contents = |_, state| (0..256).map(|i| port.plain.contents(&state, i)).collect();
    let mut held = run.states(contents).unwrap();
    held.sort_by_key(|(tile, _)| *tile);
    (held, run.picture().unwrap().hash())
}

/// The same by the plain text.
fn by_plain_text(design: &Configured, trace: &Trace, frame: &Frame) -> Found {
    let engine = design.build(frame, Which::Reference).unwrap();
    let mut fragments: Vec<(TileId, Fragment)> = trace
        .batches()
        .flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>())
        .map(|mut f| {
            f.coverage = f.coverage & screendoor::trace::SampleMask::first(frame.samples());
            (frame.grid.tile(f.x, f.y), f)
        })
        .filter(|(_, f)| !f.coverage.is_empty())
        .collect();
    fragments.sort_by_key(|(tile, _)| *tile);
    let held = fragments.chunk_by(|a, b| a.0 == b.0).map(|list| {
        let tile = list[0].0;
        let list: Vec<Fragment> = list.iter().map(|(_, f)| *f).collect();
        let mut state = engine.clear(frame.grid, tile);
        for pass in 0..engine.passes() {
            for block in Block::all_of(&list) {
                engine.draw(pass, &mut state, &block, Told::Nobody);
            }
            engine.end_pass(pass, frame.grid, tile, &mut state);
        }
        (tile, (0..256).map(|i| engine.contents(&state, i)).collect())
    });
    let held = held.collect();
    let options = ReplayOptions { engine: Which::Reference, ..ReplayOptions::default() };
    let picture = design.replay(trace, frame.samples(), frame.seed, &options).unwrap().picture;
    (held, picture.hash())
}

/// Holds all variants of a design against its plain text at a sample count.
fn check(name: &str, samples: u32) {
    let Some(gpu) = gpu() else { return };
    let header = Header { background: [0.1, 0.2, 0.3], ..header(40, 40, samples) };
    let entry = DESIGNS.iter().find(|entry| entry.info.name == name).unwrap();
    for (i, design) in variants(entry).into_iter().enumerate() {
        let mut fragments = crowd(&header, 60, i as u32);
        fragments.extend(random_fragments(&header, 300, i as u32));
        let trace = trace(&header, &fragments);
        let frame = design.frame(&trace, samples, i as u32).unwrap();
        eprintln!(
            "{:?} {}",
            std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap(),
            design.label()
        );
        let expected = by_plain_text(&design, &trace, &frame);
        let found = on_gpu(gpu, &design, &trace, &frame, &GpuOptions::default());
        let label = design.label();
        for ((tile, found), (expected_tile, expected)) in found.0.iter().zip(&expected.0) {
            assert_eq!(tile, expected_tile, "{label} {samples}");
            for (within, (found, expected)) in found.iter().zip(expected).enumerate() {
                assert_eq!(found, expected, "{label} {samples}: tile {tile:?}, pixel {within}");
            }
        }
        assert_eq!(found.0.len(), expected.0.len(), "{label} {samples}: tiles");
        assert_eq!(found.1, expected.1, "{label} {samples}: picture");
    }
}

fn check_counts(name: &str) {
    for samples in std::env::var("NS").unwrap().split(",").map(|s| s.parse().unwrap()) {
        check(name, samples);
    }
}

#[test]
fn lk_is_its_plain_text() {
    check_counts("lk");
}

#[test]
fn systematic_is_its_plain_text() {
    check_counts("systematic");
}

#[test]
fn enderton_is_its_plain_text() {
    check_counts("enderton");
}
