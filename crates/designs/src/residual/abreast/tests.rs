//! What lanes of pixels make of fragments is what the plain text makes of them.

use fearless_simd::Level;

use super::LaneFlaw;
use crate::configure;
use crate::residual::ResidualSampler;
use crate::residual::fast::FastResidual;
use screendoor_rop::fast::{Count, FastEngine, Width, levels};
use screendoor_rop::{
    BlockList, Contents, EventCounts, Frame, Listener, Stochastic, TiledDesign, stochastic,
};
use screendoor_trace::random::Stream;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, Fragment, SampleMask, Unorm32};

type Plain<const N: usize> = Stochastic<ResidualSampler<N>, N>;

fn frame<const N: usize>() -> Frame {
    Frame {
        grid: TileGrid::new(16, 16),
        positions: (0..N as i32).map(|s| [(s % 4 * 4 - 8) as i8, (s / 4 * 7 - 8) as i8]).collect(),
        background: [0.25, 0.0, 1.0],
        space: Default::default(),
        seed: 5,
        colour_bits: 96,
        view: None,
        opaque: true,
        primitive_depths: None,
        columns: Default::default(),
    }
}

fn plain<const N: usize>(settings: &str) -> (Plain<N>, ResidualSampler<N>) {
    let design = configure(&format!("residual:{settings}"), &[]).unwrap();
    let sampler = || ResidualSampler::of(design.values(), &frame::<N>());
    (stochastic::single_pass(design.values(), &frame::<N>(), sampler()), sampler())
}

fn fast<const N: usize>(
    settings: &str,
    level: Level,
    flaw: Option<LaneFlaw>,
) -> FastEngine<FastResidual<N>, N>
where
    Count<N>: Width,
{
    let (plain, sampler) = plain(settings);
    let twin = FastResidual::new(sampler).expect("it has a twin");
    FastEngine::new(plain, FastResidual { flaw, ..twin }, level)
}

/// Many fragments of a tile: steep, opaque, at the far plane, of no sample, of colours beyond
/// all bounds; a few at the near end of the depth range if `near`.
fn fragments<const N: usize>(seed: u32, near: bool) -> Vec<Fragment> {
    let mut random = Stream::new([0x0e51d, N as u32, seed]);
    let side = 2 + random.below(15);
    let fragment = |i: u32| {
        let all = SampleMask::first(N as u32);
        let coverage = match random.below(9) {
            0 => SampleMask::NONE,
            1..4 => all,
            _ => SampleMask(u64::from(random.word()) | 1 << random.below(N as u32)) & all,
        };
        let z = match random.below(5) {
            _ if near && i % 500 == 499 => random.below(3),
            0 => (2 + random.below(3)) << 29,
            1 => u32::MAX - random.below(300),
            2 => (1 << 30) + random.below(1 << 16),
            _ => (1 << 28) + random.word() / 2,
        };
        let mut slope = || match random.below(40) {
            0 => random.word() as i32 >> 3,
            _ => random.below(200) as i32 - 100,
        };
        let depth = DepthPlane { z: Unorm32(z), dzdx: slope(), dzdy: slope() };
        let red = match random.below(60) {
            0 => f32::NAN,
            1 => f32::NEG_INFINITY,
            2 => 1e30,
            3 => -5e3,
            _ => random.unit(),
        };
        Fragment {
            x: random.below(side) as u16,
            y: random.below(side) as u16,
            coverage,
            depth,
            colour: [red, random.unit() - 0.5, 40.0 * random.unit()],
            alpha: [0.0, 1.0, 1e-9, random.unit(), random.unit()][random.below(5) as usize],
            ..Fragment::default()
        }
    };
    (0..2500).map(fragment).collect()
}

type Colours = Vec<[u64; 3]>;

const TILE: TileId = TileId(0);

fn bits(pixels: &[[f64; 3]]) -> Colours {
    // One number that is none is as good as another.
    let bits = |x: f64| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() };
    pixels.iter().map(|pixel| pixel.map(bits)).collect()
}

/// What a pixel holds, as it is shown: a colour that is no number is not itself.
fn told(contents: &Contents) -> String {
    format!("{contents:?}")
}

/// What the tile holds in the end, what was counted, and its colours.
fn drawn(
    engine: &dyn TiledDesign,
    fragments: &[Fragment],
) -> (Vec<Contents>, EventCounts, Colours) {
    let grid = TileGrid::new(16, 16);
    let (mut counts, mut state) = (EventCounts::default(), engine.clear(grid, TILE));
    // Parts of which two are drawn at once and one is too short.
    for part in fragments.chunks(fragments.len() / 2 - 100) {
        let blocks = Block::all_of(part);
        let told = Listener::Counts(&mut counts);
        engine.draw_blocks(0, &mut state, &mut BlockList::new(&blocks), told);
    }
    let contents = (0..TILE_PIXELS).map(|within| engine.contents(&state, within)).collect();
    (contents, counts, bits(&engine.resolve(grid, TILE, &state)[..]))
}

/// The colours that an engine finds without a state.
fn seen(engine: &dyn TiledDesign, fragments: &[Fragment], told: Listener<'_>) -> Option<Colours> {
    let blocks = Block::all_of(fragments);
    let grid = TileGrid::new(16, 16);
    engine.picture(grid, TILE, &mut BlockList::new(&blocks), told).map(|tile| bits(&tile[..]))
}

const CASES: [&str; 5] =
    ["", "sort=false", "depth-bits=24", "depth-bits=16,sort=false", "pixel-order=morton"];

fn check<const N: usize>()
where
    Count<N>: Width,
{
    for (seed, settings) in (0..).zip(CASES) {
        for near in [false, true] {
            let fragments = fragments::<N>(seed, near);
            let expected = drawn(&plain::<N>(settings).0, &fragments);
            for (name, level) in levels() {
                let engine = fast::<N>(settings, level, None);
                let place = format!("{name}, {N} samples, '{settings}', near: {near}");
                let found = drawn(&engine, &fragments);
                for (within, (found, expected)) in found.0.iter().zip(&expected.0).enumerate() {
                    assert_eq!(told(found), told(expected), "{place}: pixel {within}");
                }
                assert_eq!(found.1, expected.1, "{place}: events");
                assert!(found.2 == expected.2, "{place}: colours");
                let mut counts = EventCounts::default();
                let counted = seen(&engine, &fragments, Listener::Counts(&mut counts));
                assert_eq!(counts, expected.1, "{place}: events of a picture");
                let uncounted = seen(&engine, &fragments, Listener::Nobody);
                for colours in [counted, uncounted] {
                    assert!(colours.as_ref() == Some(&expected.2), "{place}: picture");
                }
            }
        }
    }
}

#[test]
fn lanes_of_pixels_are_the_plain_text_with_every_parameter() {
    check::<1>();
    check::<2>();
    check::<4>();
    check::<8>();
}

#[test]
fn what_is_looked_up_is_drawn_one_by_one() {
    let fragments = fragments::<8>(1, false);
    for (_, level) in levels() {
        let engine = fast::<8>("dither=bayer", level, None);
        assert_eq!(seen(&engine, &fragments, Listener::Nobody), None);
    }
}

fn flaws_are_seen<const N: usize>()
where
    Count<N>: Width,
{
    use LaneFlaw::{Depth, Fragments, Held, Mass, Sum};
    let cases = [7, 8, 9, 10].map(|seed| fragments::<N>(seed, false));
    let cases = cases.map(|fragments| (drawn(&plain::<N>("").0, &fragments), fragments));
    let held = (0..3).flat_map(|c| (0..N).map(move |s| Held(c, s)));
    for flaw in [Fragments, Depth, Mass].into_iter().chain((0..4).map(Sum)).chain(held) {
        for (name, level) in levels() {
            let engine = fast::<N>("", level, Some(flaw));
            // Not all of it shows in any case: what a sample holds goes when the next one comes.
            let found = cases.iter().any(|(expected, fragments)| {
                let found = drawn(&engine, fragments);
                let held = found.0.iter().zip(&expected.0).any(|(a, b)| told(a) != told(b));
                held || found.2 != expected.2
            });
            assert!(found, "{name}, {N} samples: {flaw:?} stays hidden");
        }
    }
}

#[test]
fn a_wrong_bit_in_what_a_pixel_keeps_is_found() {
    flaws_are_seen::<1>();
    flaws_are_seen::<4>();
    flaws_are_seen::<8>();
}
