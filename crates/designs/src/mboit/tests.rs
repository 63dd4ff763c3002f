//! `mboit` and `wboit` in lanes give the bits of the plain text: state, events and picture.

use crate::configure;
use screendoor_rop::{BlockList, EventCounts, Frame, Implementation, Listener, TiledDesign};
use screendoor_trace::param::Options as _;
use screendoor_trace::random::Stream;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, Fragment, SampleMask, Unorm32};

const TILE: TileId = TileId(0);

fn frame(samples: u32, opaque: bool, colour_bits: u32) -> Frame {
    let mut random = Stream::new([3, samples]);
    let mut place = || random.below(16) as i8 - 8;
    Frame {
        grid: TileGrid::new(16, 16),
        positions: (0..samples).map(|_| [place(), place()]).collect(),
        background: [0.25, 0.1, 1.5],
        space: Default::default(),
        seed: 0,
        colour_bits,
        view: None,
        opaque,
        primitive_depths: None,
        columns: Default::default(),
    }
}

/// Fragments on some of a tile's pixels, the more of them the fewer those are: alphas at both
/// ends and between, depths at the ends, the same, near each other and anywhere; some cover
/// nothing.
fn fragments(frame: &Frame, count: usize, seed: u32) -> Vec<Fragment> {
    let mut random = Stream::new([0xb1e7d, seed]);
    let side = 1 + random.below(16);
    let all = SampleMask::first(frame.samples());
    let fragment = |_| {
        let word = u64::from(random.word()) << 32 | u64::from(random.word());
        let coverage = match random.below(8) {
            0 => SampleMask(0),
            1 | 2 => all,
            3 => SampleMask(1 << random.below(frame.samples())),
            _ => SampleMask(word) & all,
        };
        let z = match random.below(6) {
            0 => 0,
            1 => u32::MAX,
            2 => 1 << 30,
            3 => (1 << 31) + random.below(1 << 12),
            _ => random.word(),
        };
        let alpha = match random.below(8) {
            0 => 1.0,
            1 => 0.0,
            2 => 1e-7,
            _ => random.unit(),
        };
        Fragment {
            x: random.below(side) as u16,
            y: random.below(side) as u16,
            coverage,
            depth: DepthPlane {
                z: Unorm32(z),
                dzdx: random.word() as i32 >> 8,
                dzdy: random.word() as i32 >> 8,
            },
            colour: [random.unit(), random.range(-1.0, 1.0), random.range(0.0, 200.0)],
            alpha,
            ..Fragment::default()
        }
    };
    (0..count).map(fragment).collect()
}

/// What an engine makes of fragments that come in windows: what pixels hold after each pass,
/// what was counted, and the colours.
fn drawn(
    engine: &dyn TiledDesign,
    frame: &Frame,
    fragments: &[Fragment],
    counting: bool,
) -> (Vec<String>, EventCounts, Vec<[u64; 3]>) {
    let mut state = engine.clear(frame.grid, TILE);
    let (mut counts, mut held) = (EventCounts::default(), Vec::new());
    for pass in 0..engine.passes() {
        for window in fragments.chunks(fragments.len() / 2 + 1) {
            let blocks = Block::all_of(window);
            let told = if counting { Listener::Counts(&mut counts) } else { Listener::Nobody };
            engine.draw_blocks(pass, &mut state, &mut BlockList::new(&blocks), told);
        }
        engine.end_pass(pass, frame.grid, TILE, &mut state, Listener::Nobody);
        held.extend((0..TILE_PIXELS).map(|i| format!("{:?}", engine.contents(&state, i))));
    }
    let colours = engine.resolve(frame.grid, TILE, &state);
    (held, counts, colours.iter().map(|c| c.map(f64::to_bits)).collect())
}

fn engines_agree(specs: &[&str], seeds: std::ops::Range<u32>) {
    for implementation in Implementation::ALL {
        if !matches!(implementation.level(), Ok(Some(_))) {
            continue;
        }
        for (spec, seed) in specs.iter().flat_map(|spec| seeds.clone().map(move |s| (spec, s))) {
            let samples = 1 << (seed % 6);
            let design = configure(spec, &[]).unwrap();
            let frame = frame(samples, seed % 4 < 2, if seed % 3 == 0 { 48 } else { 96 });
            let given = fragments(&frame, 900, seed);
            let build = |implementation| design.build(&frame, implementation).unwrap();
            let (fast, plain) = (build(*implementation), build(Implementation::Reference));
            let expected = drawn(&*plain, &frame, &given, true);
            let found = drawn(&*fast, &frame, &given, true);
            let what = format!("{spec}, {samples} samples, seed {seed}, {implementation:?}");
            for (found, expected) in found.0.iter().zip(&expected.0) {
                assert_eq!(found, expected, "{what}");
            }
            assert!(found == expected, "{what}");
            let unheard = drawn(&*fast, &frame, &given, false);
            assert!((unheard.0, unheard.2) == (expected.0, expected.2.clone()), "{what}");
            let blocks = Block::all_of(&given);
            let whole =
                fast.picture(frame.grid, TILE, &mut BlockList::new(&blocks), Listener::Nobody);
            let bits = whole.map(|pixels| pixels.map(|c| c.map(f64::to_bits)).to_vec());
            assert!(bits.is_none_or(|bits| bits == expected.2), "{what}: the picture");
        }
    }
}

#[test]
fn moments_in_lanes_give_the_plain_texts_bits() {
    let specs = [
        "mboit",
        "mboit:coverage=share",
        "mboit:opaque=together,colour=16",
        "mboit:moments=6,overestimation=0,colour=8",
        "mboit:moments=6,lens=parallel,bias=10",
        "mboit:moments=8,bias=0.1",
        "mboit:moments=8,coverage=share,near=0.001,range=1000000",
    ];
    engines_agree(&specs, 0..12);
}

#[test]
fn weights_in_lanes_give_the_plain_texts_bits() {
    let mut specs =
        ["eq7", "eq8", "eq9", "eq10", "one"].map(|w| format!("wboit:weight={w}")).to_vec();
    let more = ["coverage=share", "opaque=together", "lens=parallel", "colour=8", "colour=16"];
    specs.extend(more.map(|m| format!("wboit:{m}")));
    specs.push("wboit:near=0.001,range=1000000".to_string());
    engines_agree(&specs.iter().map(String::as_str).collect::<Vec<_>>(), 0..12);
}
