//! `tests/python/lk.py`, written from `docs/EXACT_RULES.md` alone, leaves the bits that ours
//! leaves; and the page's examples are what the program computes.

use std::path::{Path, PathBuf};
use std::process::Command;

use screendoor::random::Stream;
use screendoor::rop::{PixelIndex, PixelOrder, Reference, ReferenceKey, Site};
use screendoor::tile::TileGrid;
use screendoor::trace::{
    ColourFormat, ColumnId, DepthPlane, Fragment, Header, SampleMask, Scalar, Trace, Unorm32,
};

use super::{document, python};
use crate::util::{design, header, picture, random_fragments, trace_bytes};

fn program() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/lk.py");
    std::fs::read_to_string(path).unwrap()
}

/// What the program makes of a trace.
fn replay(program: &Path, trace: &Path, samples: u32, seed: u32) -> Vec<u8> {
    let output = program.with_extension("out");
    let arguments = [samples.to_string(), seed.to_string()];
    let mut command = Command::new(python());
    command.arg(program).arg(trace).args(arguments).arg(&output);
    let done = command.output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    std::fs::read(output).unwrap()
}

/// The first difference between what the program left and what ours leaves: all colours, and
/// the state of every pixel of `looked_at`.
fn difference(
    found: &[u8],
    trace: &Trace,
    samples: u32,
    seed: u32,
    looked_at: &[(u16, u16)],
) -> Option<String> {
    let lk = design("lk");
    let ours = picture(&lk, trace, samples, seed);
    let size = 3 * 4 + 4 + 8 + samples as usize * 16;
    assert_eq!(found.len(), (ours.width() * ours.height()) as usize * size);
    let pixel = |x: u32, y: u32| &found[(y * ours.width() + x) as usize * size..][..size];
    for y in 0..ours.height() {
        for x in 0..ours.width() {
            let expected = ours.get(x, y).map(|c| (c as f32).to_le_bytes()).concat();
            if pixel(x, y)[..12] != expected {
                return Some(format!("the colour of {x},{y}"));
            }
        }
    }
    for &(x, y) in looked_at {
        let story = lk.explain(trace, samples, seed, Site { x, y }, &|_, _| ()).unwrap();
        let state = story.steps.last().map_or(&story.cleared, |step| &step.contents);
        let field = |name: &str| &state.fields.iter().find(|(n, _)| *n == name).unwrap().1;
        let surface: u32 = field("surface").parse().unwrap();
        let held: SampleMask =
            field("covered").split(' ').filter_map(|s| s.parse::<usize>().ok()).collect();
        let mut expected = [&surface.to_le_bytes()[..], &held.0.to_le_bytes()].concat();
        for sample in &state.samples {
            expected.extend(sample.depth.0.to_le_bytes());
            sample.colour.iter().for_each(|c| expected.extend(c.to_le_bytes()));
        }
        if pixel(x.into(), y.into())[12..] != expected {
            return Some(format!("the state of {x},{y}"));
        }
    }
    None
}

/// Fragments with all that the rules are about: equal depths, planes that leave the range,
/// alphas at the ends, surfaces of several fragments.
fn made(header: &Header, count: usize) -> Vec<Fragment> {
    let mut random = Stream::new([0x1c, count as u32]);
    let mut fragments = random_fragments(header, count, 6);
    for f in &mut fragments {
        f.x = f.x.max((header.width - 1).saturating_sub(32) as u16);
        f.alpha = [0.0, 1.0, 0.5, f.alpha, 1e-12][random.below(5) as usize];
        f.depth = match random.below(4) {
            0 => DepthPlane { z: Unorm32(random.below(3) << 30), dzdx: 0, dzdy: 0 },
            1 => DepthPlane { z: Unorm32(7), dzdx: -3, dzdy: 5 },
            2 => DepthPlane { z: Unorm32(u32::MAX - 7), dzdx: i32::MAX, dzdy: i32::MIN },
            _ => f.depth,
        };
        if random.below(2) == 0 {
            f.coverage = SampleMask(1 << random.below(header.pattern.samples()));
        }
    }
    fragments
}

/// A trace with sample counts and seeds, and the pixels whose state is looked at.
type Case = (PathBuf, Vec<(u32, u32)>, Vec<(u16, u16)>);

/// What the program is held to.
fn cases(folder: &Path) -> Vec<Case> {
    let stored =
        |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("traces/{name}.arrow"));
    let grid = |step: u16| -> Vec<(u16, u16)> {
        let side = |from: u16| (from..64).step_by(step.into());
        side(1).flat_map(|y| side(2).map(move |x| (x, y))).collect()
    };
    let write = |name: &str, header: &Header, fragments: &[Fragment]| {
        let path = folder.join(name);
        std::fs::write(&path, trace_bytes(header, fragments, Default::default())).unwrap();
        path
    };
    let mut small = header(5, 3, 16);
    small.background = [0.1, 0.7, 1e-3];
    small.colour = ColourFormat::F32;
    let mut fragments = made(&small, 600);
    // A pixel that nothing covers, and one whose sum overflows.
    fragments.retain(|f| (f.x, f.y) != (0, 0));
    fragments.push(Fragment {
        x: 4,
        y: 2,
        coverage: SampleMask(0x7fff),
        depth: DepthPlane::default(),
        colour: [f32::MAX, -f32::MAX, 1.0],
        alpha: 1.0,
        primitive: 600,
        object: 0,
        ..Fragment::default()
    });
    let every = (0..3).flat_map(|y| (0..5).map(move |x| (x, y))).collect();
    // Numbers of pixels at the end of the curve: their indices have more than 32 bits.
    let mut wide = header(65536, 1, 8);
    wide.constants =
        [(ColumnId::R, Scalar::Real(0.3)), (ColumnId::Dzdy, Scalar::Signed(-12))].into();
    let mut far = made(&wide, 400);
    far.iter_mut().for_each(|f| (f.colour[0], f.depth.dzdy) = (0.3, -12));
    vec![
        (stored("ramps"), vec![(1, 0), (4, 1), (64, 7)], grid(13)),
        (stored("layers"), vec![(8, 0), (16, 0xdead_beef)], grid(21)),
        (stored("foliage"), vec![(2, 0), (8, 3)], grid(13)),
        (write("small.arrow", &small, &fragments), vec![(16, 5), (2, 0)], every),
        (write("wide.arrow", &wide, &far), vec![(8, 1)], (65504..=65535).map(|x| (x, 0)).collect()),
    ]
}

#[test]
#[ignore = "needs python3 with pyarrow and numpy (SCREENDOOR_PYTHON names another interpreter)"]
fn a_program_written_from_the_rules_leaves_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lk.py");
    std::fs::write(&path, program()).unwrap();
    for (file, runs, looked_at) in cases(folder.path()) {
        let trace = Trace::open(&file).unwrap();
        for (samples, seed) in runs {
            let found = replay(&path, &file, samples, seed);
            let difference = difference(&found, &trace, samples, seed, &looked_at);
            assert_eq!(difference, None, "{}, {samples} samples, seed {seed}", file.display());
        }
    }
}

#[test]
#[ignore = "needs python3 with pyarrow and numpy (SCREENDOOR_PYTHON names another interpreter)"]
fn a_bit_or_a_rule_that_is_another_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let cases = cases(folder.path());
    let path = folder.path().join("changed.py");
    let good = program();
    for (from, to) in [
        ("0x6C50B47C", "0x6C50B47D"),
        ("0x8D22F6E6", "0x8D22F6E4"),
        ("0xE6FE3BEB", "0xE6FE3BEA"),
        ("0x846CA68B", "0x846CA68F"),
        ("index >> 32", "index >> 40"),
        ("3 * right ^ down", "3 * down ^ right"),
        ("at[s] <= depth[s]", "at[s] < depth[s]"),
        ("(depth[s], s)", "(depth[s], -s)"),
        ("(depth[s], s)", "(at[s], s)"),
        ("held | mask", "mask"),
        ("+ 1 & WORD", "+ 2 & WORD"),
        ("max(d, 0)", "max(d, 1)"),
        ("// 16", "// 17"),
        ("np.isfinite(total)", "True"),
        ("np.where(same[..., None], colours[:, :, 0], mean)", "mean"),
    ] {
        assert!(good.matches(from).count() == 1, "{from}");
        std::fs::write(&path, good.replace(from, to)).unwrap();
        // The two that were made for it.
        let told = cases[3..].iter().any(|(file, runs, looked_at)| {
            let trace = Trace::open(file).unwrap();
            let (samples, seed) = runs[0];
            let found = replay(&path, file, samples, seed);
            difference(&found, &trace, samples, seed, looked_at).is_some()
        });
        assert!(told, "'{to}' for '{from}' is not found");
    }
    // And a bit of what it leaves.
    let (file, runs, looked_at) = &cases[3];
    let (trace, (samples, seed)) = (Trace::open(file).unwrap(), runs[0]);
    std::fs::write(&path, good).unwrap();
    let found = replay(&path, file, samples, seed);
    for bit in (0..found.len() * 8).step_by(found.len() * 8 / 37) {
        let mut found = found.clone();
        found[bit / 8] ^= 1 << (bit % 8);
        assert!(difference(&found, &trace, samples, seed, looked_at).is_some(), "bit {bit}");
    }
}

#[test]
fn the_page_s_examples_are_what_is_computed() {
    let page = document("EXACT_RULES.md");
    let number = |x: u16, y: u16, side: u32| {
        PixelOrder::Hilbert.index(Site { x, y }, TileGrid::new(side, side - 2)).0
    };
    let row = |y: u16, side: u32, count: u16| -> String {
        (0..count).map(|x| format!("{:>2} ", number(x, y, side))).collect()
    };
    let eight = row(0, 5, 5);
    let first = format!("{}       {}", row(0, 4, 4).trim(), eight.trim_end());
    let rows = [first, row(1, 4, 4), row(2, 4, 4), row(3, 4, 4)];
    for row in rows {
        let found = page.lines().any(|line| line.trim() == row.trim());
        assert!(found, "no line '{}'", row.trim());
    }
    for seed in [0, 7] {
        let key = ReferenceKey { pixel: PixelIndex(5), surface: 2, seed };
        let values: Vec<String> =
            (0..4).map(|n| format!("0x{:08x}", Reference::Lk2011.value(n, 4, &key))).collect();
        let line = format!("seed {seed}: {}", values.join(" "));
        assert!(page.lines().any(|l| l == line), "no line '{line}'");
    }
}
