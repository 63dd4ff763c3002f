//! What lanes of pixels make of fragments is what the plain text makes of them.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, i32x16, u32x16};

use screendoor_trace::param::Values;
use screendoor_trace::random::Stream;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, Fragment, SampleMask, Unorm32};

use crate::contract::contents::Contents;
use crate::contract::event::EventCounts;
use crate::contract::tiled::{BlockList, Listener, TiledDesign};
use crate::fast::{
    Count, FastEngine, FastTracked, Flaw, Parameterised, Published, PublishedHash, Width, levels,
};
use crate::in_lanes::words as words_of;
use crate::stochastic::fast::abreast::hits::Limits;
use crate::stochastic::fast::abreast::nested;
use crate::stochastic::fast::abreast::packed::{
    Ranks, all, bit, left_by, pack, packed, right_by, unpack,
};
use crate::stochastic::fast::tests::{PARAMS, frame};
use crate::stochastic::single_pass;
use crate::tracked::{Hashed, REFERENCE, TrackedSampler};
use crate::{PixelIndex, Reference, ReferenceKey};

/// Many fragments of a tile, some steep, some opaque, none at the near end of the depth range
/// unless `near` says so.
fn fragments(samples: u32, seed: u32, near: bool) -> Vec<Fragment> {
    let mut random = Stream::new([0xab4ea5, samples, seed]);
    let side = 1 + random.below(16);
    let count = 1500 + random.below(2000);
    let fragment = |i: u32| {
        let bits = u64::from(random.word()) << 32 | u64::from(random.word());
        let bits = if random.below(3) == 0 { u64::MAX } else { bits };
        let mask = SampleMask(bits | 1 << random.below(samples)) & SampleMask::first(samples);
        let z = match random.below(3) {
            0 => (1 << 30) + random.below(1 << 16),
            1 => (2 + random.below(3)) << 29,
            _ => u32::MAX - random.below(300),
        };
        let mut slope = || match random.below(40) {
            0 => random.word() as i32 >> 3,
            _ => random.below(200) as i32 - 100,
        };
        let depth = DepthPlane { z: Unorm32(z), dzdx: slope(), dzdy: slope() };
        let depth = match near && i % 400 == 399 {
            true => DepthPlane { z: Unorm32(random.below(3)), ..depth },
            false => depth,
        };
        Fragment {
            x: random.below(side) as u16,
            y: random.below(side) as u16,
            // Rows that cover nothing come, too.
            coverage: if random.below(9) == 0 { SampleMask::NONE } else { mask },
            depth,
            colour: [random.unit(), random.unit() - 0.5, 0.25],
            alpha: [0.0, 1.0, 1e-9, random.unit(), random.unit()][random.below(5) as usize],
            primitive: random.below(4),
            object: random.below(2),
            ..Fragment::default()
        }
    };
    (0..count).map(fragment).collect()
}

type Found = (Vec<Contents>, EventCounts, Vec<[u64; 3]>);

/// What the tile holds in the end, what was counted, and its colours.
fn drawn(engine: &dyn TiledDesign, fragments: &[Fragment]) -> Found {
    let (grid, tile) = (TileGrid::new(16, 16), TileId(0));
    let mut counts = EventCounts::default();
    let mut state = engine.clear(grid, tile);
    // Parts of which some are drawn at once and some are too short.
    for part in fragments.chunks(fragments.len() / 2 - 200) {
        let blocks = Block::all_of(part);
        let told = Listener::Counts(&mut counts);
        engine.draw_blocks(0, &mut state, &mut BlockList::new(&blocks), told);
    }
    let contents = (0..TILE_PIXELS).map(|within| engine.contents(&state, within)).collect();
    let colours = engine.resolve(grid, tile, &state);
    (contents, counts, colours.iter().map(|c| c.map(f64::to_bits)).collect())
}

/// The colours that an engine finds without a state, once counting and once not.
fn seen(
    engine: &dyn TiledDesign,
    fragments: &[Fragment],
) -> Option<(EventCounts, [Vec<[u64; 3]>; 2])> {
    let (grid, tile) = (TileGrid::new(16, 16), TileId(0));
    let blocks = Block::all_of(fragments);
    let mut counts = EventCounts::default();
    let counted =
        engine.picture(grid, tile, &mut BlockList::new(&blocks), Listener::Counts(&mut counts))?;
    let uncounted = engine.picture(grid, tile, &mut BlockList::new(&blocks), Listener::Nobody)?;
    let bits = [counted, uncounted].map(|tile| tile.iter().map(|c| c.map(f64::to_bits)).collect());
    Some((counts, bits))
}

/// Parameters of figure 7, all of them in some case.
const CASES: [&str; 14] = [
    "",
    "sort=false",
    "compact=false",
    "compact=false,sort=false",
    "track=covered",
    "surfaces=every-fragment",
    "surfaces=primitive",
    "surfaces=object,track=covered",
    "prehash=true",
    "reference=lk2011-1,depth-bits=24",
    "reference=lk2011-2,depth-bits=16,sort=false",
    "reference=vegdahl",
    "reference=vegdahl-v2,pixel-order=morton",
    "reference=radical-inverse,compact=false",
];

fn check<const N: usize>()
where
    Count<N>: Width,
{
    let frame = frame::<N>();
    for (number, case) in CASES.into_iter().enumerate() {
        let given: Vec<(String, String)> = case
            .split(',')
            .filter_map(|setting| setting.split_once('='))
            .map(|(key, value)| (key.to_string(), value.to_string()))
            .collect();
        let values = Values::resolve("lk", PARAMS, &given).unwrap();
        let references = Hashed(values.get(REFERENCE));
        let plain = || {
            single_pass(&values, &frame, TrackedSampler::<_, N>::new(&values, &frame, references))
        };
        for (seed, near) in [(number as u32, false), (number as u32 + 100, true)] {
            let fragments = fragments(N as u32, seed, near);
            let expected = drawn(&plain(), &fragments);
            for (name, level) in levels() {
                let rules = Parameterised::of(&values);
                let any = FastEngine::new(
                    plain(),
                    FastTracked::<_, _, N>::new(&values, rules, references),
                    level,
                );
                let published = FastEngine::new(
                    plain(),
                    FastTracked::<_, _, N>::new(&values, Published, PublishedHash),
                    level,
                );
                let mut engines: Vec<&dyn TiledDesign> = vec![&any];
                if case.is_empty() {
                    engines.push(&published);
                }
                for engine in engines {
                    let found = drawn(engine, &fragments);
                    let place = format!("{name}, {N} samples, '{case}', near: {near}");
                    for (within, (found, expected)) in found.0.iter().zip(&expected.0).enumerate() {
                        assert_eq!(found, expected, "{place}: pixel {within}");
                    }
                    assert_eq!(found.1, expected.1, "{place}: events");
                    assert!(found.2 == expected.2, "{place}: colours");
                    let (counts, colours) = seen(engine, &fragments).expect("it is seen at once");
                    assert_eq!(counts, expected.1, "{place}: events of a picture");
                    assert!(colours.iter().all(|seen| *seen == expected.2), "{place}: picture");
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

fn flaws_are_seen<const N: usize>()
where
    Count<N>: Width,
{
    let frame = frame::<N>();
    let values = Values::resolve("lk", PARAMS, &[]).unwrap();
    let references = Hashed(values.get(REFERENCE));
    let plain =
        || single_pass(&values, &frame, TrackedSampler::<_, N>::new(&values, &frame, references));
    let fragments = fragments(N as u32, 7, false);
    let expected = drawn(&plain(), &fragments);
    for (name, level) in levels() {
        for flaw in (0..N).flat_map(|lane| [Flaw::Depth(lane), Flaw::Choice(lane)]) {
            let sampler = FastTracked::<_, _, N>::new(&values, Published, PublishedHash);
            let engine = FastEngine::new(plain(), sampler, level).with_flaw(flaw);
            let found = drawn(&engine, &fragments);
            assert!(found.0 != expected.0, "{name}, {N} samples: {flaw:?} stays hidden");
        }
    }
}

#[test]
fn a_defect_in_any_lane_or_list_is_found() {
    flaws_are_seen::<1>();
    flaws_are_seen::<4>();
    flaws_are_seen::<8>();
}

/// What [`nested`] finds of sixteen pixels, in words.
fn nested_at<const N: usize>(
    level: Level,
    x: &[u32; 16],
    limits: &[u64; 16],
    rounds: usize,
) -> [u32; 16] {
    #[inline(always)]
    fn found<S: Simd, const N: usize>(
        simd: S,
        x: &[u32; 16],
        limits: &[u64; 16],
        rounds: usize,
    ) -> [u32; 16] {
        let threshold = u32x16::from_slice(simd, &limits.map(|limit| limit as u32));
        let above = u32x16::from_slice(simd, &limits.map(|limit| (limit >> 32) as u32));
        let limits = Limits { threshold, opaque: above.simd_gt(u32x16::splat(simd, 0)) };
        let x = u32x16::from_slice(simd, x);
        words_of(match rounds {
            0 => nested::<S, N, 0>(simd, x, &limits),
            1 => nested::<S, N, 1>(simd, x, &limits),
            2 => nested::<S, N, 2>(simd, x, &limits),
            3 => nested::<S, N, 3>(simd, x, &limits),
            _ => nested::<S, N, 4>(simd, x, &limits),
        })
    }
    crate::for_level!(level, simd => found::<_, N>(simd, x, limits, rounds))
}

fn one_hash_is_all<const N: usize>() {
    let mut random = Stream::new([0x0e4a54, N as u32]);
    let references = [
        Reference::RadicalInverse,
        Reference::Lk2011Rounds1,
        Reference::Lk2011Rounds2,
        Reference::Lk2011Rounds3,
        Reference::Lk2011,
    ];
    for _ in 0..200 {
        let keys: [ReferenceKey; 16] = std::array::from_fn(|_| ReferenceKey {
            pixel: PixelIndex(random.word() >> 6),
            surface: random.word() >> random.below(32),
            seed: random.below(3),
        });
        for (rounds, reference) in references.into_iter().enumerate() {
            let values = keys.map(|key| {
                let value = |n: usize| reference.value(n as u32, N as u32, &key);
                std::array::from_fn::<u32, N, _>(value)
            });
            // Limits anywhere, at the ends, and at the values themselves.
            let limits: [u64; 16] = std::array::from_fn(|i| match random.below(6) {
                0 => 0,
                1 => 1 << 32,
                2 => u64::from(u32::MAX),
                3 => u64::from(values[i][random.below(N as u32) as usize]),
                4 => u64::from(values[i][random.below(N as u32) as usize]) + 1,
                _ => u64::from(random.word()),
            });
            let x = keys.map(|key| {
                let (reversed, moved) =
                    crate::stochastic::reference_value::place(0, N as u32, &key);
                reversed.wrapping_add(moved)
            });
            for (name, level) in levels() {
                let found = nested_at::<N>(level, &x, &limits, rounds);
                for i in 0..16 {
                    let passes = |n: &usize| u64::from(values[i][*n]) < limits[i];
                    let expected = (0..N).filter(passes).fold(0, |set, n| set | bit(n));
                    assert_eq!(
                        found[i], expected,
                        "{name} {reference:?} {:?} {}",
                        keys[i], limits[i]
                    );
                }
            }
        }
    }
}

#[test]
fn one_hash_says_which_numbers_pass() {
    one_hash_is_all::<1>();
    one_hash_is_all::<2>();
    one_hash_is_all::<4>();
    one_hash_is_all::<8>();
}

/// Where sixteen pixels' samples are picked, in words.
fn picked_at<const N: usize>(
    level: Level,
    keys: &[[i32; 16]; N],
    sorted: bool,
    hits: &[u32; 16],
    among: &[u32; 16],
) -> [u32; 16] {
    #[inline(always)]
    fn found<S: Simd, const N: usize>(
        simd: S,
        keys: &[[i32; 16]; N],
        sorted: bool,
        hits: &[u32; 16],
        among: &[u32; 16],
    ) -> [u32; 16] {
        let mut lanes = [i32x16::splat(simd, 0); N];
        for i in 0..N {
            lanes[i] = i32x16::from_slice(simd, &keys[i]);
        }
        let [hits, among] = [hits, among].map(|set| u32x16::from_slice(simd, set));
        let ranks = match sorted {
            true => Ranks::of(simd, &lanes),
            false => Ranks::in_sample_order(simd, among),
        };
        let mut set = u32x16::splat(simd, 0);
        for (i, picked) in ranks.picked(simd, hits, among).into_iter().enumerate() {
            set = picked.select(set | u32x16::splat(simd, bit(i)), set);
        }
        words_of(set)
    }
    crate::for_level!(level, simd => found::<_, N>(simd, keys, sorted, hits, among))
}

fn ranks_are_those_of_sorting<const N: usize>() {
    let mut random = Stream::new([0x4a4c5, N as u32]);
    for round in 0..300 {
        let among: [u32; 16] =
            std::array::from_fn(|_| pack(random.word() & (u32::MAX >> (32 - N))));
        let hits: [u32; 16] = std::array::from_fn(|_| pack(random.word() & (u32::MAX >> (32 - N))));
        // Many equal ones, and the greatest that there is; the others' are greater.
        let kinds = 1 + random.below(1 << (round % 8));
        let mut keys = [[0; 16]; N];
        for (i, row) in keys.iter_mut().enumerate() {
            for (lane, key) in row.iter_mut().enumerate() {
                *key = match among[lane] & bit(i) != 0 {
                    true if random.below(4) == 0 => i32::MAX - 1,
                    true => (random.below(kinds) as i32).wrapping_mul(0x1234_5677) & !1,
                    false => i32::MAX,
                };
            }
        }
        for sorted in [true, false] {
            let expected: [u32; 16] = std::array::from_fn(|lane| {
                let mut order: Vec<usize> = (0..N).filter(|i| among[lane] & bit(*i) != 0).collect();
                if sorted {
                    order.sort_by_key(|i| (keys[*i][lane], *i));
                }
                let chosen = order.iter().enumerate().filter(|(n, _)| hits[lane] & bit(*n) != 0);
                chosen.fold(0, |set, (_, i)| set | bit(*i))
            });
            for (name, level) in levels() {
                let found = picked_at::<N>(level, &keys, sorted, &hits, &among);
                assert_eq!(found, expected, "{name}, {N} samples, sorted: {sorted}");
            }
        }
    }
}

#[test]
fn samples_are_picked_by_their_rank() {
    ranks_are_those_of_sorting::<1>();
    ranks_are_those_of_sorting::<2>();
    ranks_are_those_of_sorting::<4>();
    ranks_are_those_of_sorting::<8>();
}

/// A word shifted either way, and a mask packed.
#[inline(always)]
fn shifted<S: Simd>(simd: S, word: u32, by: &[u32; 16]) -> [[u32; 16]; 3] {
    let (word, by) = (u32x16::splat(simd, word), u32x16::from_slice(simd, by));
    [right_by(simd, word, by), left_by(simd, word, by), packed::<S, 8>(simd, word)].map(words_of)
}

#[test]
fn nothing_is_left_of_a_word_that_is_shifted_beyond_its_end() {
    for (name, level) in levels() {
        let at = |word: u32, by: &[u32; 16]| -> [[u32; 16]; 3] {
            crate::for_level!(level, simd => shifted(simd, word, by))
        };
        for start in [0, 16, 32, 48] {
            let by: [u32; 16] = std::array::from_fn(|i| start + i as u32);
            for word in [u32::MAX, 0x1234_5678, 1, 1 << 31] {
                let [right, left, packed] = at(word, &by);
                for (i, by) in by.iter().enumerate() {
                    assert_eq!(right[i], word.checked_shr(*by).unwrap_or(0), "{name} {by}");
                    // Beyond 60 bits nobody asks.
                    assert!(
                        *by > 60 || left[i] == word.checked_shl(*by).unwrap_or(0),
                        "{name} {by}"
                    );
                    assert_eq!(packed[i], pack(word & 0xff), "{name}");
                }
            }
        }
    }
}

#[test]
fn packed_sets_hold_what_masks_do() {
    for mask in 0..256 {
        assert_eq!(unpack(pack(mask)), mask);
        assert_eq!(pack(mask).count_ones(), mask.count_ones());
    }
    assert_eq!([all(8), all(4), all(1)], [0x8888_8888, 0x8888, 8]);
}
