//! The GPU port gives the bits of the plain text. Without an adapter these tests are
//! counted as skipped, or fail where `SCREENDOOR_GPU=require` says that there is one.

use std::sync::OnceLock;

use screendoor::design::{Configured, DESIGNS};
use screendoor::gpu::{self, Gpu, GpuOptions, GpuRun};
use screendoor::picture::Picture;
use screendoor::rop::{Contents, Frame, ReplayOptions, Told, Which};
use screendoor::tile::TileId;
use screendoor::trace::{Block, Fragment, Header, Trace};

use crate::fast::crowd;
use crate::util::{header, picture, random_fragments, trace, variants};

/// The GPU, opened once; `None` where there is none and none is required.
fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    let gpu = GPU.get_or_init(|| match Gpu::open(None) {
        Ok(gpu) => {
            eprintln!("GPU: {}", gpu.adapter());
            Some(gpu)
        }
        Err(error) if std::env::var_os("SCREENDOOR_GPU").is_some_and(|v| v == "require") => {
            panic!("SCREENDOOR_GPU=require, but: {error}")
        }
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    });
    gpu.as_ref()
}

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

/// Channels of a picture that differ from the plain text's by more than is allowed, and the
/// most that any differs by.
fn differing(found: &Picture, expected: &Picture) -> (usize, f64) {
    let pixels = (0..expected.height()).flat_map(|y| (0..expected.width()).map(move |x| (x, y)));
    let differences = pixels.flat_map(|(x, y)| {
        let (found, expected) = (found.get(x, y), expected.get(x, y));
        (0..3).map(move |i| (found[i] - expected[i]).abs() / (1.0 + expected[i].abs()))
    });
    differences.fold((0, 0.0), |(count, most), difference| {
        // What is no number differs.
        let beyond = !(difference <= gpu::TOLERANCE);
        (count + usize::from(beyond), f64::max(most, difference))
    })
}

fn check_blended(name: &str) {
    let Some(gpu) = gpu() else { return };
    let entry = DESIGNS.iter().find(|entry| entry.info.name == name).unwrap();
    for samples in [1, 8, 32, 64] {
        let header = Header { background: [0.1, 0.2, 0.3], ..header(40, 40, samples) };
        for (i, design) in variants(entry).into_iter().enumerate() {
            let mut fragments = crowd(&header, 60, i as u32);
            fragments.extend(random_fragments(&header, 6000, i as u32));
            let trace = trace(&header, &fragments);
            let (found, _) =
                design.replay_on(gpu, &trace, samples, 7, &GpuOptions::default()).unwrap();
            let expected = picture(&design, &trace, samples, 7);
            let found = differing(&found.picture, &expected);
            eprintln!("{} {samples}: {found:?}", design.label());
        }
    }
}

#[test]
fn kbuffer() {
    check_blended("kbuffer");
}
#[test]
fn mlab() {
    check_blended("mlab");
}
#[test]
fn wboit() {
    check_blended("wboit");
}
#[test]
fn slab() {
    check_blended("slab");
}
