//! What `docs/RESIDUAL.md` derives, by enumeration and by many seeds.

use screendoor_rop::{
    Blueprint, Design, Frame, NoProbe, SampleList, Site, Threshold, draw_pixel, in_sample_order,
    sort_by_stored_depth,
};
use screendoor_trace::random::Stream;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

use super::choice::paired;
use super::draw::{ResidualAt, ResidualPixel};
use super::{Residual, errors::Errors};
use crate::configure;

const SITE: Site = Site { x: 0, y: 0 };

fn frame(samples: u32, seed: u32) -> Frame {
    Frame {
        grid: TileGrid::new(1, 1),
        positions: (0..samples as i8).map(|s| [s % 8 * 2 - 8, s / 8 * 2 - 8]).collect(),
        background: [0.25; 3],
        seed,
        colour_bits: 96,
        opaque: true,
        primitive_depths: None,
        columns: Default::default(),
    }
}

fn design<const N: usize>(spec: &str, seed: u32) -> ResidualAt<N> {
    let design = configure(spec, &[]).unwrap();
    Residual::at::<N>(design.values(), &frame(N as u32, seed)).unwrap()
}

fn fragment(primitive: u32, z: u32, mask: u64, colour: f32, alpha: f32) -> Fragment {
    Fragment {
        x: 0,
        y: 0,
        coverage: SampleMask(mask),
        depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
        colour: [colour, 1.0 - colour, 0.5],
        alpha,
        primitive,
        object: 0,
        ..Fragment::default()
    }
}

/// The exact colour: what is sorted, composited sample by sample.
fn exact(samples: usize, fragments: &[Fragment]) -> [f64; 3] {
    let mut mean = [0.0; 3];
    for s in 0..samples {
        let mut own: Vec<(usize, &Fragment)> =
            fragments.iter().enumerate().filter(|(_, f)| f.coverage.contains(s)).collect();
        // Of equal depths the later lies in front.
        own.sort_by_key(|(i, f)| (f.depth.z, std::cmp::Reverse(*i)));
        let mut through = 1.0;
        for (_, f) in own {
            for (m, c) in mean.iter_mut().zip(f.colour) {
                *m += through * f64::from(f.alpha) * f64::from(c);
            }
            through *= 1.0 - f64::from(f.alpha);
        }
        mean.iter_mut().for_each(|m| *m += through * 0.25);
    }
    mean.map(|m| m / samples as f64)
}

/// Draws with ξ given, in place of a hash of the seed.
fn draw_with<const N: usize>(
    design: &ResidualAt<N>,
    pixel: &mut ResidualPixel<N>,
    fragment: &Fragment,
    xi: u32,
) {
    let z: [Unorm32; N] = design.frame.depths(fragment, 32);
    let passed = pixel.samples.depth_test(fragment.coverage, &z);
    let mut order: SampleList<N> = in_sample_order(passed);
    sort_by_stored_depth(&mut order, &pixel.samples.depth);
    let opacity = Threshold::of(fragment.alpha);
    let hit = |(n, _): &(usize, &u8)| opacity.passes(paired(xi, opacity, *n as u32));
    let written = order.iter().enumerate().filter(hit).map(|(_, s)| usize::from(*s)).collect();
    design.write(pixel, fragment, &z, [passed, written], 0);
}

/// All ξ that differ for alphas of quarters: two upper bits, and one for each pair exchanged.
fn every_xi() -> impl Iterator<Item = u32> + Clone {
    (0..4_u32).flat_map(|top| (0..4_u32).map(move |exchanged| top << 30 | exchanged))
}

/// The sums over all choices of what three fragments leave: of the accumulators, and of what
/// the pixel shows; and over how many choices.
fn enumerated(spec: &str, fragments: &[Fragment; 3]) -> ([i64; 4], [f64; 3], f64) {
    let design = design::<4>(spec, 0);
    let (mut sums, mut shown, mut count) = ([0_i64; 4], [0.0; 3], 0.0);
    for a in every_xi() {
        for b in every_xi() {
            for c in every_xi() {
                let mut pixel = design.clear(SITE);
                for (fragment, xi) in fragments.iter().zip([a, b, c]) {
                    draw_with(&design, &mut pixel, fragment, xi);
                }
                for quad in &pixel.errors.sums {
                    sums.iter_mut().zip(quad).for_each(|(sum, d)| *sum += i64::from(*d));
                }
                let colour = design.resolve(SITE, &pixel);
                shown.iter_mut().zip(colour).for_each(|(sum, c)| *sum += c);
                count += 1.0;
            }
        }
    }
    (sums, shown, count)
}

/// Alphas and colours of quarters, whose products have no more bits than are kept: nothing is
/// rounded, and what must be 0 is 0.
fn small_cases() -> Vec<[Fragment; 3]> {
    let mut random = Stream::new([0x5ca1]);
    let mut cases = Vec::new();
    for _ in 0..12 {
        let mut one = |i| {
            let quarters = [0.25, 0.5, 0.75, 1.0];
            let alpha = quarters[random.below(4) as usize];
            let colour = quarters[random.below(4) as usize];
            let mask = [0b1111, 0b1111, 0b0110, 0b1010, 0b0001][random.below(5) as usize];
            fragment(i, (1 + random.below(3)) << 28, mask, colour, alpha)
        };
        cases.push([one(0), one(1), one(2)]);
    }
    cases
}

#[test]
fn over_all_choices_the_accumulator_is_nothing_and_the_picture_exact() {
    for spec in
        ["residual", "residual:per=sample", "residual:layers=3", "residual:layers=8,per=sample"]
    {
        for case in small_cases() {
            let (sums, shown, count) = enumerated(spec, &case);
            assert_eq!(sums, [0; 4], "{spec} {case:?}");
            for (sum, right) in shown.iter().zip(exact(4, &case)) {
                // Double precision rounds the sum of so many.
                assert!(
                    (sum / count - right).abs() < 1e-9,
                    "{spec} {case:?}: {} {right}",
                    sum / count
                );
            }
        }
    }
}

#[test]
fn twenty_layers_in_either_sorted_order_leave_no_noise() {
    let layers: Vec<Fragment> = (0..20)
        .map(|i| fragment(i, (i + 1) << 26, 0xff, i as f32 / 20.0, 0.1 + 0.03 * i as f32))
        .collect();
    let backwards: Vec<Fragment> = layers.iter().rev().copied().collect();
    for spec in ["residual", "residual:layers=4", "residual:per=sample", "residual:drawn=hashed"] {
        for order in [&layers, &backwards] {
            let right = exact(8, order);
            for seed in 0..50 {
                let design = design::<8>(spec, seed);
                let shown = design.resolve(SITE, &draw_pixel(&design, SITE, order));
                for (shown, right) in shown.iter().zip(right) {
                    // Each of the products of a fragment is rounded by half a step of 2^-20.
                    assert!((shown - right).abs() < 1e-4, "{spec} {seed}: {shown} {right}");
                }
            }
        }
    }
}

/// Fragments at random, in random order, of any coverage.
fn mixed(case: u32) -> Vec<Fragment> {
    let mut random = Stream::new([0x313, case]);
    (0..10)
        .map(|i| {
            let mask = if random.below(2) == 0 { 0xff } else { 1 + u64::from(random.below(255)) };
            fragment(i, random.word(), mask, random.unit(), random.unit())
        })
        .collect()
}

/// Mean error over seeds and its standard error, for the first channel.
fn bias(spec: &str, fragments: &[Fragment], seeds: u32) -> (f64, f64) {
    let right = exact(8, fragments)[0];
    let errors: Vec<f64> = (0..seeds)
        .map(|seed| {
            let design = design::<8>(spec, seed);
            design.resolve(SITE, &draw_pixel(&design, SITE, fragments))[0] - right
        })
        .collect();
    let n = f64::from(seeds);
    let mean = errors.iter().sum::<f64>() / n;
    let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// 42 tests at a significance of 0.01 together: 3.9 standard errors, two-sided.
const SIGMAS: f64 = 3.9;

#[test]
fn the_mean_is_right_whatever_the_format() {
    let specs = [
        "residual",
        "residual:sort=false",
        "residual:drawn=hashed",
        "residual:layers=4",
        "residual:per=sample,layers=2",
        "residual:errors=8,per=sample",
        "residual:errors=8",
    ];
    for case in 0..6 {
        let fragments = mixed(case);
        for spec in specs {
            let (mean, error) = bias(spec, &fragments, 4000);
            // Rounding alone: a few steps of 2^-20 a fragment.
            assert!(mean.abs() < SIGMAS * error + 3e-5, "{spec}, case {case}: {mean} ± {error}");
        }
    }
}

/// To the nearest of 16 bits, a fragment's error is off by half a step of 2^-13 of the mean at
/// most, in each entry: this bounds the bias.
#[test]
fn sixteen_bits_are_biased_by_no_more_than_they_round() {
    for case in 0..6 {
        let fragments = mixed(case);
        let (mean, error) = bias("residual:errors=16", &fragments, 4000);
        let bound = fragments.len() as f64 * 0.5 / f64::from(1 << 13);
        assert!(mean.abs() < SIGMAS * error + bound, "case {case}: {mean} ± {error}");
    }
}

/// Squared errors with and without what the accumulators say, at the same samples.
#[test]
fn noise_is_less_than_of_the_samples_alone() {
    for (spec, most) in [("residual", 0.65), ("residual:per=sample", 0.45)] {
        let (mut with, mut without) = (0.0, 0.0);
        for case in 0..6 {
            let fragments = mixed(case);
            let right = exact(8, &fragments);
            for seed in 0..200 {
                let design = design::<8>(spec, seed);
                let mut pixel = draw_pixel(&design, SITE, &fragments);
                with += (design.resolve(SITE, &pixel)[0] - right[0]).powi(2);
                pixel.errors = Errors::default();
                without += (design.resolve(SITE, &pixel)[0] - right[0]).powi(2);
            }
        }
        println!("{spec}: {with} of {without}");
        assert!(with < most * without, "{spec}: {with} of {without}");
    }
}

#[test]
fn colours_beyond_all_bounds_are_no_more_than_noisy() {
    let bright = fragment(0, 1 << 30, 0xff, 60000.0, 0.5);
    let design = design::<8>("residual", 3);
    let mut pixel = design.clear(SITE);
    for i in 0..1000 {
        let fragment = Fragment { primitive: i, ..bright };
        Design::draw(&design, 0, SITE, &mut pixel, &fragment, &mut NoProbe);
        let shown = design.resolve(SITE, &pixel);
        assert!(shown.iter().all(|c| c.is_finite() && c.abs() < 2e5), "{shown:?}");
    }
}
