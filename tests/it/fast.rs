//! The fast engines give the bits of the plain text: state, events and picture.

use screendoor::design::{Configured, DESIGNS};
use screendoor::param::Options;
use screendoor::random::Stream;
use screendoor::rop::{BlockList, EventCounts, Frame, Implementation, Listener, Site};
use screendoor::tile::{TileGrid, TileId};
use screendoor::trace::{Block, DepthPlane, Fragment, Header, SampleMask, Unorm32};

use crate::util::{header, trace, variants};

/// The engines that this machine can run, but for the reference.
fn engines() -> Vec<Implementation> {
    // `Fast` is one of the others.
    let own = |implementation: &Implementation| {
        *implementation != Implementation::Fast && matches!(implementation.level(), Ok(Some(_)))
    };
    Implementation::ALL.iter().copied().filter(own).collect()
}

/// Fragments that crowd a few pixels of one tile: depths from a handful of levels or
/// anywhere, flat, sloped and very steep planes, the ends of the depth range, all
/// kinds of masks, alpha 0, tiny, middling and 1.
pub fn crowd(header: &Header, count: usize, seed: u32) -> Vec<Fragment> {
    let mut random = Stream::new([0xfa57, seed]);
    let all = SampleMask::first(header.pattern.samples());
    let fragment = |i: usize| {
        let z = match random.below(8) {
            0 => 0,
            1 => random.below(20),
            2 => u32::MAX - random.below(20),
            3 | 4 => (1 + random.below(4)) << 29,
            5 => (1 << 31) + random.below(16),
            _ => random.word(),
        };
        let mut slope = || match random.below(7) {
            6 => [i32::MIN, i32::MAX, 1 << 27, -(1 << 27)][random.below(4) as usize],
            0 | 1 => 0,
            2 => random.below(64) as i32 - 32,
            3 => random.word() as i32 >> 8,
            4 => random.word() as i32 >> 4,
            _ => random.word() as i32,
        };
        let (dzdx, dzdy) = (slope(), slope());
        let bits = u64::from(random.word()) << 32 | u64::from(random.word());
        let mask = match random.below(4) {
            0 => all,
            1 => SampleMask(1 << random.below(header.pattern.samples())),
            _ => SampleMask(bits) & all,
        };
        let alpha = match random.below(6) {
            0 => 1.0,
            1 => 0.0,
            2 => 1e-9,
            _ => random.unit(),
        };
        Fragment {
            x: random.below(4) as u16,
            y: 0,
            coverage: if mask.is_empty() { all } else { mask },
            depth: DepthPlane { z: Unorm32(z), dzdx, dzdy },
            colour: [random.unit(), -random.unit(), i as f32],
            alpha,
            primitive: random.below(5),
            object: random.below(2),
            ..Fragment::default()
        }
    };
    (0..count).map(fragment).collect()
}

/// What an engine makes of fragments: what each pixel holds after each pass, what was
/// counted, and the colours.
fn run(
    design: &Configured,
    frame: &Frame,
    implementation: Implementation,
    fragments: &[Fragment],
    at_once: bool,
) -> (Vec<screendoor::rop::Contents>, EventCounts, Vec<[u64; 3]>) {
    let engine = design.build(frame, implementation).unwrap();
    let (grid, tile) = (frame.grid, TileId(0));
    let mut counts = EventCounts::default();
    let mut held = Vec::new();
    // Once counting, once not: kernels are compiled for both.
    let mut counted = engine.clear(grid, tile);
    let mut uncounted = engine.clear(grid, tile);
    for pass in 0..engine.passes() {
        // In two parts, as windows cut them.
        for part in fragments.chunks(fragments.len() / 2 + 1).map(Block::all_of) {
            if at_once {
                let blocks = || BlockList::new(&part);
                let told = Listener::Counts(&mut counts);
                engine.draw_blocks(pass, &mut counted, &mut blocks(), told);
                engine.draw_blocks(pass, &mut uncounted, &mut blocks(), Listener::Nobody);
                continue;
            }
            for block in &part {
                engine.draw(pass, &mut counted, block, Listener::Counts(&mut counts));
                engine.draw(pass, &mut uncounted, block, Listener::Nobody);
            }
        }
        engine.end_pass(pass, grid, tile, &mut counted, Listener::Counts(&mut counts));
        engine.end_pass(pass, grid, tile, &mut uncounted, Listener::Nobody);
        for within in (0..5).chain([20, 255]) {
            held.push(engine.contents(&counted, within));
            held.push(engine.contents(&uncounted, within));
        }
    }
    let colours = [&counted, &uncounted].map(|state| engine.resolve(grid, tile, state));
    let bits = colours.iter().flat_map(|tile| tile.iter().map(|c| c.map(f64::to_bits)));
    (held, counts, bits.collect())
}

/// Fragments all over a tile, so many that engines look at many at once; few or none at the
/// near end of the depth range, where they would not.
fn throng(header: &Header, seed: u32) -> Vec<Fragment> {
    let mut random = Stream::new([0x7412, seed]);
    // From a few pixels to all; lists of the same length and of very different ones.
    let (side, skew) = (1 + random.below(16), random.below(2) == 1);
    let count = 1300 + random.below(3000) as usize;
    let spread = |mut f: Fragment| {
        let mut place = || match skew && random.below(3) > 0 {
            true => 0,
            false => random.below(side) as u16,
        };
        (f.x, f.y) = (place(), place());
        let near = random.below(20_000) == 0;
        if !near && f.depth.z.0 < 1 << 30 {
            f.depth.z.0 |= 1 << 30;
            (f.depth.dzdx, f.depth.dzdy) = (f.depth.dzdx >> 6, f.depth.dzdy >> 6);
        }
        // Steep ones at times.
        if !near && random.below(50) > 0 {
            (f.depth.dzdx, f.depth.dzdy) = (f.depth.dzdx >> 8, f.depth.dzdy >> 8);
        }
        f
    };
    crowd(header, count, seed).into_iter().map(spread).collect()
}

/// Holds all engines of all variants of a design against its plain text.
fn check(name: &str, samples: u32, cases: u32, at_once: bool) {
    let header = Header { background: [0.1, 0.2, 0.3], ..header(40, 40, samples) };
    let empty = trace(&header, &[]);
    let entry = DESIGNS.iter().find(|entry| entry.info.name == name).unwrap();
    for (i, design) in variants(entry).into_iter().enumerate() {
        for case in 0..cases {
            let seed = case * 1000 + i as u32;
            let fragments = if at_once { throng(&header, seed) } else { crowd(&header, 60, seed) };
            let frame = design.frame(&empty, samples, seed).unwrap();
            let expected = run(&design, &frame, Implementation::Reference, &fragments, at_once);
            for implementation in engines() {
                let found = run(&design, &frame, implementation, &fragments, at_once);
                let label = design.label();
                assert_eq!(found.0, expected.0, "{label} {implementation:?} {samples}: state");
                assert_eq!(found.1, expected.1, "{label} {implementation:?} {samples}: events");
                assert!(found.2 == expected.2, "{label} {implementation:?} {samples}: colours");
            }
        }
    }
}

fn check_counts(name: &str) {
    for samples in [1, 2, 4, 8, 16, 32, 64] {
        check(name, samples, 6, false);
    }
    for samples in [1, 2, 4, 8] {
        check(name, samples, 2, true);
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
fn residual_is_its_plain_text() {
    check_counts("residual");
}

#[test]
fn enderton_is_its_plain_text() {
    check_counts("enderton");
}

#[test]
fn hashed_alpha_is_its_plain_text() {
    check_counts("hashed-alpha");
}

#[test]
fn exact_is_its_plain_text() {
    check_counts("exact");
}

#[test]
fn a_pixel_told_fragment_by_fragment_is_the_same() {
    // `explain` asks for records; it must see what the picture is made of.
    let header = header(8, 8, 8);
    let fragments: Vec<Fragment> = crowd(&header, 80, 7).into_iter().filter(|f| f.x == 0).collect();
    let trace = trace(&header, &fragments);
    for name in ["lk", "systematic", "residual", "enderton", "hashed-alpha", "exact"] {
        let design = crate::util::design(name);
        let explained = design.explain(&trace, 8, 5, Site { x: 0, y: 0 }, &|_, _| ()).unwrap();
        let picture = crate::util::picture(&design, &trace, 8, 5);
        assert_eq!(picture.get(0, 0), explained.colour, "{name}");
        assert_eq!(TileGrid::within(0, 0), 0);
    }
}
