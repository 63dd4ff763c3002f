//! Visibility: how much light reaches a depth, by the state of every design that tells it.
//!
//! The suite runs over the registry, and over designs with planted faults, which it has to find.

use rayon::prelude::*;
use screendoor::design::{Configured, DESIGNS};
use screendoor::metrics::student_t;
use screendoor::random::Stream;
use screendoor::rop::visibility::VisibilityMap;
use screendoor::rop::{
    Contents, Frame, Implementation, Layout, Listener, OpaquePromise, Promise, ReplayOptions,
    TileState, TiledDesign,
};
use screendoor::tile::{TileGrid, TileId};
use screendoor::trace::{Block, Fragment, Header, SampleMask, Trace, Unorm32};

use crate::util::{all_variants, design, header, layered, random_fragments, trace};

const SAMPLES: u32 = 8;

/// Draws a trace with a seed, to be asked.
type Draw<'a> = &'a (dyn Fn(&Trace, u32) -> VisibilityMap + Sync);

fn options(implementation: Implementation) -> ReplayOptions<'static> {
    ReplayOptions { implementation, ..ReplayOptions::default() }
}

fn drawn(design: &Configured, trace: &Trace, seed: u32) -> VisibilityMap {
    design.visibility_map(trace, SAMPLES, seed, &options(Implementation::Fast)).unwrap()
}

/// Whether the design's state tells.
fn tells(design: &Configured, trace: &Trace) -> bool {
    match design.visibility_map(trace, SAMPLES, 0, &ReplayOptions::default()) {
        Ok(_) => true,
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains("does not tell how much light"), "{}: {text}", design.label());
            false
        }
    }
}

/// The variants of all designs that tell.
fn tellers() -> Vec<Configured> {
    let trace = trace(&header(4, 4, SAMPLES), &[]);
    all_variants().into_iter().filter(|design| tells(design, &trace)).collect()
}

/// Fragments of all kinds, depths over the whole range, few at the ends of it.
fn mixed(header: &Header) -> Vec<Fragment> {
    let pixels = header.width * header.height;
    let mut fragments = random_fragments(header, pixels as usize * 12, 77);
    for (i, f) in fragments.iter_mut().enumerate() {
        f.depth.z.0 = f.depth.z.0 / 2 + (1 << 30);
        (f.depth.dzdx, f.depth.dzdy) = (f.depth.dzdx / 16, f.depth.dzdy / 16);
        f.alpha = if i % 9 == 0 { 1.0 } else { 0.1 + 0.7 * f.alpha };
        if i % 2 == 0 {
            f.coverage = SampleMask::first(SAMPLES);
        }
    }
    fragments
}

/// What depends on rounding alone, in numbers from 0 to 1.
const SLACK: f64 = 1e-6;

/// Where light is more than there is, less than none, or more behind than before; or not all
/// in front of everything. `slack` is what a reconstruction may be off.
fn malformed(draw: Draw<'_>, slack: f64) -> Vec<String> {
    let header = header(12, 12, SAMPLES);
    let map = draw(&trace(&header, &mixed(&header)), 1);
    let mut wrong = Vec::new();
    for (x, y) in (0..12).flat_map(|x| (0..12).map(move |y| (x, y))) {
        let mut before = map.pixel(x, y, Unorm32(0));
        if (before - 1.0).abs() > slack {
            wrong.push(format!("{before} in front of everything at {x},{y}"));
        }
        for step in 1..=64_u32 {
            let z = Unorm32((step << 26).wrapping_sub(1));
            let here = map.pixel(x, y, z);
            if !(-SLACK..=1.0 + SLACK).contains(&here) || here > before + slack {
                wrong.push(format!("{here} behind {before} at {x},{y}, depth {}", z.0));
            }
            before = here;
        }
    }
    wrong
}

/// Where opaque surfaces do not hide what is behind them, or hide more.
fn wrong_of_opaque(draw: Draw<'_>) -> Vec<String> {
    let header = header(6, 6, SAMPLES);
    let mut fragments = layered(&header, 5, |i| ((i * 3 % 5 + 1) << 28, [0.5; 3], 1.0));
    // Pixels with none, and pixels with fewer.
    fragments.retain(|f| f.x > 0 && !(f.x == 1 && f.primitive == 0));
    let trace = trace(&header, &fragments);
    let map = draw(&trace, 3);
    let exact = drawn(&design("exact"), &trace, 0);
    let mut wrong = Vec::new();
    for (x, y) in (0..6).flat_map(|x| (0..6).map(move |y| (x, y))) {
        for z in
            (0..8_u32).flat_map(|i| [(i << 28).saturating_sub(1), i << 28, (i << 28) + (1 << 20)])
        {
            let [found, truth] = [&map, &exact].map(|map| map.pixel(x, y, Unorm32(z)));
            if found != truth {
                wrong.push(format!("{found} for {truth} at {x},{y}, depth {z}"));
            }
        }
    }
    wrong
}

/// Seeds of a test of expectations.
const SEEDS: u32 = 48;

/// Student's t of the mean error over a frame, the greatest of several depths, of layers and of
/// pieces. A difference below what single precision rounds is none.
fn greatest_t(draw: Draw<'_>) -> f64 {
    let header = header(12, 12, SAMPLES);
    let alphas = [0.3, 0.5, 0.2, 0.7, 0.4, 0.6];
    let mut layers =
        layered(&header, 6, |i| (((i * 5) % 6 + 1) << 28, [0.5; 3], alphas[i as usize]));
    let mut pieces = layers.clone();
    Stream::new([5]).shuffle(&mut pieces);
    for (i, f) in pieces.iter_mut().enumerate() {
        f.coverage = SampleMask(0b1011_0110 >> (i % 2) & 0xff);
        f.primitive = i as u32;
    }
    layers.reverse();
    let mut greatest = 0.0_f64;
    for fragments in [layers, pieces] {
        let trace = trace(&header, &fragments);
        let exact = drawn(&design("exact"), &trace, 0);
        let pixels: Vec<(u32, u32)> = (0..12).flat_map(|x| (0..12).map(move |y| (x, y))).collect();
        let maps: Vec<VisibilityMap> = (0..SEEDS).map(|seed| draw(&trace, seed)).collect();
        for depth in 1..8 {
            let z = Unorm32((depth << 28) + 5);
            let error = |map: &VisibilityMap| {
                let of = |(x, y): &(u32, u32)| map.pixel(*x, *y, z) - exact.pixel(*x, *y, z);
                pixels.iter().map(of).sum::<f64>() / pixels.len() as f64
            };
            let errors: Vec<f64> = maps.iter().map(error).collect();
            let n = errors.len() as f64;
            let mean = errors.iter().sum::<f64>() / n;
            let variance = errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / (n - 1.0);
            if mean.abs() > SLACK {
                greatest = greatest.max(mean.abs() / (variance / n).sqrt());
            }
        }
    }
    greatest
}

/// The limit of [`greatest_t`] at a significance of 0.001 over so many designs, two traces and
/// seven depths each (Bonferroni).
fn t_limit(designs: usize) -> f64 {
    student_t(1.0 - 1e-3 / (designs as f64 * 14.0), SEEDS as usize)
}

#[test]
fn the_state_of_these_designs_tells() {
    let trace = trace(&header(4, 4, SAMPLES), &[]);
    let telling = |name: &&str| tells(&design(name), &trace);
    let names: Vec<&str> = DESIGNS.iter().map(|e| e.info.name).filter(telling).collect();
    // The others keep colours that are blended already, or sums without a depth.
    let silent = ["depth-peeling", "blend", "sorted-blend", "wboit"];
    let expected = DESIGNS.iter().map(|e| e.info.name).filter(|name| !silent.contains(name));
    assert_eq!(names, expected.collect::<Vec<_>>());
    // An error names those that do.
    let refused = design("wboit").visibility_map(&trace, SAMPLES, 0, &ReplayOptions::default());
    let text = refused.unwrap_err().to_string();
    assert!(names.iter().all(|name| text.contains(name)), "{text}");
}

/// How far a reconstruction of few numbers may be off where nothing is hidden, and may rise.
fn slack(design: &Configured) -> f64 {
    match design.info().name {
        "mboit" => 0.25,
        _ => SLACK,
    }
}

#[test]
fn all_light_comes_to_the_front_and_none_comes_back() {
    let wrong: Vec<String> = tellers()
        .par_iter()
        .flat_map_iter(|design| {
            let label = design.label();
            let found = malformed(&|trace, seed| drawn(design, trace, seed), slack(design));
            found.into_iter().take(2).map(move |what| format!("{label}: {what}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn opaque_surfaces_hide_what_is_behind_where_the_picture_of_them_is_exact() {
    let promised = |d: &Configured| d.promises().exact_opaque != OpaquePromise::Never;
    let designs: Vec<Configured> = tellers().into_iter().filter(promised).collect();
    assert!(designs.len() > 20);
    for design in designs {
        let wrong = wrong_of_opaque(&|trace, seed| drawn(&design, trace, seed));
        assert!(wrong.is_empty(), "{}: {wrong:#?}", design.label());
    }
}

#[test]
fn designs_without_bias_have_the_true_visibility_as_their_mean() {
    let unbiased = |d: &Configured| d.promises().unbiased == Promise::Always;
    let designs: Vec<Configured> = tellers().into_iter().filter(unbiased).collect();
    assert!(designs.iter().any(|d| d.info().name == "lk"));
    let limit = t_limit(designs.len());
    let wrong: Vec<String> = designs
        .par_iter()
        .filter_map(|design| {
            let t = greatest_t(&|trace, seed| drawn(design, trace, seed));
            (t >= limit).then(|| format!("{}: t {t:.1} of {limit:.1}", design.label()))
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn engines_tell_what_the_plain_text_tells() {
    let header = header(40, 20, SAMPLES);
    // Enough of a tile that engines draw many fragments at once.
    let trace = trace(&header, &mixed(&header));
    let mut random = Stream::new([9]);
    let mut place = || (random.below(40), random.below(20), Unorm32(random.word()));
    let places: Vec<(u32, u32, Unorm32)> = (0..500).map(|_| place()).collect();
    for design in tellers() {
        let answers = |implementation| -> Vec<u64> {
            let map = design.visibility_map(&trace, SAMPLES, 5, &options(implementation)).unwrap();
            places.iter().map(|(x, y, z)| map.pixel(*x, *y, *z).to_bits()).collect()
        };
        let [fast, plain] = [Implementation::Fast, Implementation::Reference].map(answers);
        assert!(fast == plain, "{}", design.label());
    }
}

/// A design that tells something else than it should.
struct Faulty {
    inner: Box<dyn TiledDesign>,
    fault: Fault,
}

/// Changes the depths that are asked for, and the answers.
#[derive(Clone, Copy)]
struct Fault {
    asked: fn(u32) -> u32,
    told: fn(f64) -> f64,
}

impl TiledDesign for Faulty {
    fn passes(&self) -> u32 {
        self.inner.passes()
    }
    fn layout(&self) -> Layout {
        self.inner.layout()
    }
    fn bytes_per_fragment(&self) -> Option<usize> {
        self.inner.bytes_per_fragment()
    }
    fn clear(&self, grid: TileGrid, tile: TileId) -> TileState {
        self.inner.clear(grid, tile)
    }
    fn draw(&self, pass: u32, state: &mut TileState, block: &Block, listener: Listener<'_>) {
        self.inner.draw(pass, state, block, listener);
    }
    fn end_pass(
        &self,
        pass: u32,
        grid: TileGrid,
        tile: TileId,
        state: &mut TileState,
        listener: Listener<'_>,
    ) {
        self.inner.end_pass(pass, grid, tile, state, listener);
    }
    fn resolve(
        &self,
        grid: TileGrid,
        tile: TileId,
        state: &TileState,
    ) -> screendoor::picture::TilePixels {
        self.inner.resolve(grid, tile, state)
    }
    fn contents(&self, state: &TileState, within: usize) -> Contents {
        self.inner.contents(state, within)
    }
    fn visibility(&self, state: &TileState, within: usize, at: &[Unorm32], to: &mut [f64]) -> bool {
        let at: Vec<Unorm32> = at.iter().map(|z| Unorm32((self.fault.asked)(z.0))).collect();
        let told = self.inner.visibility(state, within, &at, to);
        to.iter_mut().for_each(|v| *v = (self.fault.told)(*v));
        told
    }
}

#[test]
fn planted_faults_are_found() {
    let same = |z: u32| z;
    let faults: [(&str, Fault, [bool; 3]); 6] = [
        // Which of the three checks see it: form, opaque surfaces, expectation.
        ("none", Fault { asked: same, told: |v| v }, [false, false, false]),
        ("always lit", Fault { asked: same, told: |_| 1.0 }, [false, true, true]),
        ("shadow for light", Fault { asked: same, told: |v| 1.0 - v }, [true, true, true]),
        // What lies at the very depth hides it.
        (
            "one too deep",
            Fault { asked: |z| z.saturating_add(1), told: |v| v },
            [false, true, false],
        ),
        ("half as deep", Fault { asked: |z| z / 2, told: |v| v }, [false, true, true]),
        // The far quarter of the range is lit again.
        (
            "rises",
            Fault { asked: |z| if z >> 30 == 3 { 0 } else { z }, told: |v| v },
            [true, false, false],
        ),
    ];
    for (name, fault, expected) in faults {
        let draw = |trace: &Trace, seed: u32| {
            let lk = design("lk");
            let frame: Frame = lk.frame(trace, SAMPLES, seed).unwrap();
            let inner = lk.build(&frame, Implementation::Fast).unwrap();
            let faulty = Box::new(Faulty { inner, fault });
            VisibilityMap::draw(faulty, &frame, trace, &ReplayOptions::default()).unwrap()
        };
        let found = [
            !malformed(&draw, SLACK).is_empty(),
            !wrong_of_opaque(&draw).is_empty(),
            greatest_t(&draw) >= t_limit(100),
        ];
        assert_eq!(found, expected, "{name}");
    }
}
