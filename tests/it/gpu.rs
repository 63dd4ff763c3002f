//! The GPU port gives the bits of the plain text. Without an adapter these tests are
//! counted as skipped, or fail where `SCREENDOOR_GPU=require` says that there is one.

use screendoor::capture::{Capture, CaptureOptions};
use screendoor::design::{Configured, DESIGNS, Entry};
use screendoor::gpu::{self, Gpu, GpuOptions, GpuRun, Threads};
use screendoor::picture::Picture;
use screendoor::rop::{Contents, Family, Frame, Implementation, Listener, ReplayOptions};
use screendoor::tile::TileId;
use screendoor::trace::{Block, ColourFormat, ColumnId, Fragment, Header, Scalar, Trace};

use crate::fast::crowd;
use crate::util::{design, gpu, header, nearly_bare, not_bare, random_fragments, trace, variants};

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
    let engine = design.build(frame, Implementation::Reference).unwrap();
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
                engine.draw(pass, &mut state, &block, Listener::Nobody);
            }
            engine.end_pass(pass, frame.grid, tile, &mut state, Listener::Nobody);
        }
        (tile, (0..256).map(|i| engine.contents(&state, i)).collect())
    });
    let held = held.collect();
    let options =
        ReplayOptions { implementation: Implementation::Reference, ..ReplayOptions::default() };
    let picture = design.replay(trace, frame.samples(), frame.seed, &options).unwrap().picture;
    (held, picture.hash())
}

/// Holds what was found against what was expected, pixel by pixel.
fn assert_same(found: &Found, expected: &Found, label: &str) {
    for ((tile, found), (expected_tile, expected)) in found.0.iter().zip(&expected.0) {
        assert_eq!(tile, expected_tile, "{label}");
        for (within, (found, expected)) in found.iter().zip(expected).enumerate() {
            assert_eq!(found, expected, "{label}: tile {tile:?}, pixel {within}");
        }
    }
    assert_eq!(found.0.len(), expected.0.len(), "{label}: tiles");
    assert_eq!(found.1, expected.1, "{label}: picture");
}

/// Holds a variant of a design against its plain text.
pub fn check(gpu: &Gpu, design: &Configured, samples: u32, seed: u32, threads: Threads) {
    let header = Header { background: [0.1, 0.2, 0.3], ..header(40, 40, samples) };
    let mut fragments = crowd(&header, 60, seed);
    fragments.extend(random_fragments(&header, 300, seed));
    let trace = trace(&header, &fragments);
    let frame = design.frame(&trace, samples, seed).unwrap();
    let options = GpuOptions { threads, ..GpuOptions::default() };
    let expected = by_plain_text(design, &trace, &frame);
    let found = on_gpu(gpu, design, &trace, &frame, &options);
    assert_same(&found, &expected, &format!("{} {samples} {threads:?}", design.label()));
}

const COUNTS: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];

/// Holds every variant at 8 samples, and at every other count every fifth, in turn; the
/// design itself at every count, with threads given pixels and samples.
fn check_all(name: &str) {
    let Some(gpu) = gpu() else { return };
    let entry = DESIGNS.iter().find(|entry| entry.info.name == name).unwrap();
    for (i, design) in variants(entry).into_iter().enumerate() {
        for (turn, samples) in COUNTS.into_iter().enumerate() {
            if i == 0 {
                check(gpu, &design, samples, 0, Threads::Sample);
            }
            if i == 0 || samples == 8 || (i + turn) % 5 == 0 {
                check(gpu, &design, samples, i as u32, Threads::Pixel);
            }
        }
    }
}

#[test]
#[ignore = "takes ten minutes on a software driver: every variant at every count, both ways"]
fn every_variant_at_every_count_is_its_plain_text() {
    let Some(gpu) = gpu() else { return };
    let stochastic = |e: &&Entry| e.is_ported() && e.info.family == Family::Stochastic;
    for entry in DESIGNS.iter().filter(stochastic) {
        for (i, design) in variants(entry).into_iter().enumerate() {
            for samples in COUNTS {
                check(gpu, &design, samples, i as u32, Threads::Pixel);
                check(gpu, &design, samples, i as u32, Threads::Sample);
            }
        }
    }
}

#[test]
fn lk_is_its_plain_text() {
    check_all("lk");
}

#[test]
fn systematic_is_its_plain_text() {
    check_all("systematic");
}

#[test]
fn residual_is_its_plain_text() {
    check_all("residual");
}

#[test]
fn enderton_is_its_plain_text() {
    check_all("enderton");
}

/// The picture of a GPU and of the plain text.
pub fn pictures(
    gpu: &Gpu,
    design: &Configured,
    trace: &Trace,
    samples: u32,
    options: &GpuOptions,
) -> [Picture; 2] {
    let (found, _, fragments) = gpu::replay(gpu, design, trace, samples, 7, options).unwrap();
    let options = ReplayOptions { count_events: true, ..ReplayOptions::default() };
    let expected = design.replay(trace, samples, 7, &options).unwrap();
    assert_eq!(found.touched_tiles, expected.touched_tiles);
    assert_eq!(fragments, expected.events.unwrap().fragments);
    [found.picture, expected.picture]
}

#[test]
fn what_nothing_covers_is_the_background_bit_for_bit_on_a_device_too() {
    let Some(gpu) = gpu() else { return };
    let ported = DESIGNS.iter().filter(|entry| entry.is_ported());
    let plain = ported.map(|entry| entry.configure(&[]).unwrap());
    let several = ["enderton:rounds=4", "lk:method=alpha-correction"].map(design);
    for design in plain.chain(several) {
        for samples in [1, 8, 64] {
            // A device may take colours below 2^-126 for 0.
            for background in [[0.1, 1.0 / 3.0, 0.7], [65504.0, 0.3, 0.0]] {
                let trace = nearly_bare(samples, background);
                let options = GpuOptions::default();
                let [found, _] = pictures(gpu, &design, &trace, samples, &options);
                let wrong = not_bare(&found, background);
                assert!(wrong.is_empty(), "{} at {samples}: {wrong:?}", design.label());
            }
        }
    }
}

/// Channels that differ by more than is allowed, and how many there are.
pub fn differing([found, expected]: &[Picture; 2]) -> [usize; 2] {
    let pixels = (0..expected.height()).flat_map(|y| (0..expected.width()).map(move |x| (x, y)));
    let channels = pixels.flat_map(|(x, y)| {
        let (found, expected) = (found.get(x, y), expected.get(x, y));
        (0..3).map(move |i| (found[i] - expected[i]).abs() / (1.0 + expected[i].abs()))
    });
    // What is no number differs.
    let allowed = |difference: f64| difference <= gpu::TOLERANCE;
    channels.fold([0, 0], |[beyond, all], d| [beyond + usize::from(!allowed(d)), all + 1])
}

/// Holds the pictures of a blending design against the plain text's.
fn check_blended(name: &str) {
    let Some(gpu) = gpu() else { return };
    let entry = DESIGNS.iter().find(|entry| entry.info.name == name).unwrap();
    let (mut beyond, mut all) = (0, 0);
    for (i, design) in variants(entry).into_iter().enumerate() {
        // Every parameter at 8 samples, what is read from masks of either width elsewhere.
        for samples in if i == 0 { vec![1, 2, 4, 8, 16, 32, 64] } else { vec![8] } {
            let header = Header { background: [0.1, 0.2, 0.3], ..header(40, 40, samples) };
            let mut fragments = crowd(&header, 60, i as u32);
            fragments.extend(random_fragments(&header, 4000, i as u32));
            let trace = trace(&header, &fragments);
            let options = GpuOptions::default();
            let [b, n] = differing(&pictures(gpu, &design, &trace, samples, &options));
            (beyond, all) = (beyond + b, all + n);
        }
    }
    // Where a probability lies within rounding of a random number, another layer enters.
    let most = if name == "slab" { all / 100_000 } else { 0 };
    assert!(beyond <= most, "{name}: {beyond} of {all} channels");
}

#[test]
fn kbuffer_is_near_its_plain_text() {
    check_blended("kbuffer");
}

#[test]
fn mlab_is_near_its_plain_text() {
    check_blended("mlab");
}

#[test]
fn merging_is_near_its_plain_text() {
    check_blended("merging");
}

#[test]
fn wboit_is_near_its_plain_text() {
    check_blended("wboit");
}

#[test]
fn slab_is_near_its_plain_text() {
    check_blended("slab");
}

/// The stochastic designs, and one that sums over passes.
const STOCHASTIC: [&str; 6] = [
    "lk",
    "systematic",
    "residual",
    "enderton",
    "enderton:mask=naive",
    "lk:method=depth-correction",
];

#[test]
fn captured_scenes_give_the_same_bits_in_chunks_of_any_size() {
    let Some(gpu) = gpu() else { return };
    for scene in screendoor::scene::builtin::BUILTINS.iter().map(|b| b.name) {
        let loaded = screendoor::scene::load(&format!("builtin:{scene}")).unwrap();
        let size = CaptureOptions { width: 72, height: 40, ..CaptureOptions::default() };
        let trace = Capture::new(&loaded, &size).unwrap().to_memory(|_, _| ()).unwrap();
        for (i, design) in STOCHASTIC.iter().map(|spec| design(spec)).enumerate() {
            // One in five keeps nothing on the device, one has a single chunk.
            let rows = [u64::MAX, 1000, 4096, 777, 5000][i % 5];
            let resident = [u64::MAX, 0, 100_000, u64::MAX, 0][i % 5];
            let options =
                GpuOptions { rows: rows.max(trace.rows() / 20), resident, ..GpuOptions::default() };
            let [found, expected] = pictures(gpu, &design, &trace, 8, &options);
            assert_eq!(found.hash(), expected.hash(), "{scene}: {}", design.label());
        }
    }
}

#[test]
fn columns_of_every_type_and_constants_are_read() {
    let Some(gpu) = gpu() else { return };
    for samples in [4, 16, 32, 64] {
        for colour in [ColourFormat::F16, ColourFormat::F32] {
            let mut header = Header { colour, ..header(40, 24, samples) };
            for constants in [false, true] {
                let mut fragments = random_fragments(&header, 500, samples);
                // Half precision's smallest, and its largest.
                fragments[0].colour = [5.960_464_5e-8, 6.0e-5, 65504.0];
                if constants {
                    header.constants.insert(ColumnId::Y, Scalar::Unsigned(7));
                    header.constants.insert(ColumnId::Dzdx, Scalar::Signed(-50));
                    header.constants.insert(ColumnId::Alpha, Scalar::Real(0.25));
                    header.constants.insert(ColumnId::G, Scalar::Real(0.125));
                    for f in &mut fragments {
                        (f.y, f.alpha, f.colour[1], f.depth.dzdx) = (7, 0.25, 0.125, -50);
                    }
                }
                let trace = trace(&header, &fragments);
                let frame = design("lk").frame(&trace, samples, 3).unwrap();
                let found = on_gpu(gpu, &design("lk"), &trace, &frame, &GpuOptions::default());
                let expected = by_plain_text(&design("lk"), &trace, &frame);
                assert_same(&found, &expected, &format!("{samples} {colour:?} {constants}"));
            }
        }
    }
}

#[test]
fn a_pixel_of_many_fragments_is_drawn_to_its_end() {
    let Some(gpu) = gpu() else { return };
    // More than a driver's patience: Mesa's ends loops after 65535 iterations.
    let header = header(16, 16, 8);
    let mut fragments = random_fragments(&header, 70_000, 1);
    for (i, f) in fragments.iter_mut().enumerate() {
        (f.x, f.y, f.alpha) = (3, 5, 0.3);
        f.depth.z.0 = u32::MAX / 2 - 20_000 * i as u32;
        f.primitive = i as u32;
    }
    let trace = trace(&header, &fragments);
    for name in ["lk", "enderton", "kbuffer"] {
        let [found, expected] = pictures(gpu, &design(name), &trace, 8, &GpuOptions::default());
        assert_eq!(found.hash(), expected.hash(), "{name}");
    }
}

#[test]
fn tiles_far_apart_and_empty_traces_are_drawn() {
    let Some(gpu) = gpu() else { return };
    let header = Header { background: [0.5, 0.25, 2.0], ..header(5000, 3000, 4) };
    let mut fragments = random_fragments(&header, 50, 9);
    (fragments[0].x, fragments[0].y) = (4999, 2999);
    for list in [&fragments[..], &[]] {
        let trace = trace(&header, list);
        for name in ["lk", "kbuffer"] {
            let [found, expected] = pictures(gpu, &design(name), &trace, 4, &GpuOptions::default());
            assert_eq!(found.hash(), expected.hash(), "{name}");
        }
    }
}

#[test]
fn a_design_without_a_port_and_an_unknown_adapter_are_told() {
    let frame_of = trace(&header(8, 8, 4), &[]);
    let ported = |spec: &str| {
        let design = design(spec);
        let frame = design.frame(&frame_of, 4, 0).unwrap();
        let port = design.port(&frame);
        assert_eq!(port.is_ok(), design.is_ported(), "{spec}");
        port.map(|_| ())
    };
    DESIGNS.iter().for_each(|entry| drop(ported(entry.info.name)));
    let error = ported("exact").unwrap_err();
    assert!(error.is_config());
    assert!(
        error
            .to_string()
            .starts_with("'exact' has no port to GPUs; replay it with --engine fast; lk, "),
        "{error}"
    );
    if let Some(gpu) = gpu() {
        let error = Gpu::open(Some("no such adapter")).unwrap_err();
        assert!(error.to_string().contains(&gpu.adapter().name), "{error}");
    }
}
