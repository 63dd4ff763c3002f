//! Techniques that blend and sum, where their answer is known.

use screendoor::capture::{Capture, CaptureOptions, Order};
use screendoor::design::Configured;
use screendoor::metrics::{Region, errors};
use screendoor::rop::ReplayOptions;
use screendoor::trace::{DepthPlane, Fragment, Header, SampleMask, Trace, Unorm32};

use crate::util::{design, header, layered, picture, random_fragments, trace, variants};

/// Errors of this size, in 8-bit units, are those of sums in single precision.
const ROUNDING: f64 = 1e-3;

/// The largest error of `design` against the exact picture, in 8-bit units.
fn worst(design: &Configured, trace: &Trace, samples: u32) -> f64 {
    let exact = picture(&self::design("exact"), trace, samples, 0);
    errors(&picture(design, trace, samples, 0), &exact, &Region::frame(exact.grid())).max
}

/// The variants of a design of the registry that draw all of what lies in a pixel.
fn of(name: &str) -> Vec<Configured> {
    let entry = screendoor::design::DESIGNS.iter().find(|e| e.info.name == name).unwrap();
    variants(entry).into_iter().filter(|d| !d.label().contains("stop=")).collect()
}

fn all() -> Vec<Configured> {
    ["blend", "sorted-blend", "wboit", "mboit"].into_iter().flat_map(of).collect()
}

/// Fragments of partial coverage without slopes, on a background, some opaque.
fn flat(samples: u32) -> (Header, Vec<Fragment>) {
    let mut header = header(16, 16, samples);
    header.background = [0.2, 0.4, 0.6];
    let mut fragments = random_fragments(&header, 3000, 3);
    for f in &mut fragments {
        (f.depth.dzdx, f.depth.dzdy) = (0, 0);
        if f.primitive % 16 == 0 {
            f.alpha = 1.0;
        }
    }
    (header, fragments)
}

#[test]
fn blending_far_to_near_is_exact() {
    for samples in [1, 4, 8] {
        let (header, mut fragments) = flat(samples);
        fragments.sort_by_key(|f| std::cmp::Reverse(f.depth.z));
        let sorted = trace(&header, &fragments);
        fragments.reverse();
        let reversed = trace(&header, &fragments);
        for design in of("blend") {
            assert!(worst(&design, &sorted, samples) < ROUNDING, "{}", design.label());
            assert!(worst(&design, &reversed, samples) > 1.0, "{}", design.label());
        }
    }
}

#[test]
fn primitives_that_do_not_cross_are_sorted_from_any_order() {
    for samples in [1, 8] {
        let (header, fragments) = flat(samples);
        let trace = trace(&header, &fragments);
        for design in of("sorted-blend") {
            assert!(worst(&design, &trace, samples) < ROUNDING, "{}", design.label());
        }
        assert!(worst(&design("blend"), &trace, samples) > 1.0);
    }
    // Layers of triangles, drawn in random order: each has one depth.
    let scene = screendoor::scene::load("builtin:layers:count=5,alpha=0.4,coloured=true").unwrap();
    let options = CaptureOptions {
        width: 40,
        height: 40,
        samples: 8,
        order: Order::Random,
        ..CaptureOptions::default()
    };
    let trace = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    // A capture stores halves, and would have them blended.
    assert!(worst(&design("sorted-blend:colour=32"), &trace, 8) < ROUNDING);
}

#[test]
fn blending_stops_where_little_light_is_left() {
    // Front to back: 0.8, 0.16, 0.032 and 0.0064 of the light are left by turns.
    let header = header(8, 8, 4);
    let alphas = [0.2, 0.8, 0.8, 0.8, 0.5_f64];
    let layers =
        layered(&header, 5, |i| (i << 24, [(1 << i) as f32, 0.0, 1.0], alphas[i as usize] as f32));
    let red = |stop: &str, fragments: &[Fragment]| {
        let design = design(&format!("sorted-blend:stop={stop}"));
        picture(&design, &trace(&header, fragments), 4, 0).get(3, 4)[0]
    };
    let expected = |drawn: usize| {
        let shares = alphas[..drawn].iter().scan(1.0, |left, alpha| {
            let share = *left * alpha;
            *left *= 1.0 - alpha;
            Some(share)
        });
        shares.enumerate().map(|(i, share)| share * f64::from(1 << i)).sum::<f64>()
    };
    for (stop, drawn) in [("0", 5), ("0.003", 5), ("0.004", 4), ("0.02", 3), ("0.1", 2), ("0.5", 1)]
    {
        let found = red(stop, &layers);
        assert!((found - expected(drawn)).abs() < 1e-5, "{stop}: {found}, {}", expected(drawn));
    }
    // What is opaque is drawn, and nothing behind it.
    let opaque: Vec<Fragment> = layers
        .iter()
        .map(|f| Fragment { alpha: if f.primitive == 1 { 1.0 } else { f.alpha }, ..*f })
        .collect();
    assert!((red("0.1", &opaque) - (0.2 + 0.8 * 2.0)).abs() < 1e-5);
}

#[test]
fn no_order_of_primitives_sorts_those_that_cross() {
    // Two planes through the middle of the frame, one falling and one rising.
    let header = header(16, 16, 4);
    let mut fragments = layered(&header, 2, |i| (0, [i as f32, 1.0 - i as f32, 0.5], 0.5));
    for f in &mut fragments {
        let slope = if f.primitive == 0 { 1 << 24 } else { -(1 << 24) };
        let z = (1_i64 << 31) + i64::from(slope) * (2 * i64::from(f.x) - 15) / 2;
        f.depth = DepthPlane { z: Unorm32(z as u32), dzdx: slope, dzdy: 0 };
    }
    let trace = trace(&header, &fragments);
    let error = |spec: &str| {
        let exact = picture(&design("exact"), &trace, 4, 0);
        let found = picture(&design(spec), &trace, 4, 0);
        let half = |x: std::ops::Range<u32>| {
            let wrong = |x: &u32| (found.get(*x, 8)[0] - exact.get(*x, 8)[0]).abs() > 0.1;
            x.filter(wrong).count()
        };
        (half(0..8), half(8..16))
    };
    // One half is right and the other wrong.
    assert!([(0, 8), (8, 0)].contains(&error("sorted-blend")), "{:?}", error("sorted-blend"));
}

#[test]
fn a_primitives_number_costs_no_memory() {
    let (header, mut fragments) = flat(4);
    for f in &mut fragments {
        f.primitive = f.primitive.wrapping_mul(0x9e37_79b9) | 0x8000_0000;
    }
    fragments[0].primitive = u32::MAX;
    let trace = trace(&header, &fragments);
    let replayed = design("sorted-blend").replay(&trace, 4, 0, &ReplayOptions::default()).unwrap();
    // The pass that finds the depths is none of the design's.
    assert_eq!(replayed.passes, 2);
    assert!(worst(&design("sorted-blend"), &trace, 4) < ROUNDING);
}

#[test]
fn one_layer_is_exact_over_parts_of_pixels_where_sums_are_per_sample() {
    let mut header = header(16, 16, 8);
    header.background = [0.2, 0.4, 0.6];
    let mut fragments = layered(&header, 1, |_| (1 << 30, [0.9, 0.1, 0.3], 0.4));
    for (f, r) in fragments.iter_mut().zip(random_fragments(&header, 256, 2)) {
        f.coverage = r.coverage;
    }
    let whole = trace(&header, &fragments);
    // The same layer in two pieces a pixel.
    let rest = fragments.clone().into_iter().filter_map(|f| {
        let rest = SampleMask(f.coverage.0 ^ 0xff);
        (!rest.is_empty()).then_some(Fragment { coverage: rest, primitive: 9, ..f })
    });
    fragments.extend(rest);
    let pieces = trace(&header, &fragments);
    for design in all() {
        let shared =
            design.values().iter().any(|(k, v)| (k, v.to_string()) == ("coverage", "share".into()));
        assert!(worst(&design, &whole, 8) < ROUNDING, "{}", design.label());
        // Where sums are shared, the pieces count as layers.
        let seams = worst(&design, &pieces, 8) > 1.0;
        assert_eq!(seams, shared, "{}", design.label());
    }
}

#[test]
fn layers_of_one_colour_need_no_order() {
    let mut header = header(8, 8, 4);
    header.background = [0.0, 0.5, 1.0];
    let fragments =
        layered(&header, 12, |i| ((i * 5 % 12) << 28, [0.5, 0.25, 0.75], 0.1 * (i % 9) as f32));
    let trace = trace(&header, &fragments);
    for design in all() {
        assert!(
            worst(&design, &trace, 4) < ROUNDING,
            "{}: {}",
            design.label(),
            worst(&design, &trace, 4)
        );
    }
}

#[test]
fn two_layers_far_apart_are_told_apart_by_moments() {
    let header = header(8, 8, 4);
    let fragments =
        layered(&header, 2, |i| ((1 + 2 * i) << 30, [1.0 - i as f32, i as f32, 0.0], 0.6));
    let trace = trace(&header, &fragments);
    for count in [4, 6, 8] {
        let error =
            |settings: &str| worst(&design(&format!("mboit:moments={count}{settings}")), &trace, 4);
        // Layers of one mass: what counts as before itself dims both alike.
        assert!(error("") < 0.5 && error(",overestimation=1") < 0.5, "{count}");
    }
}

#[test]
fn more_moments_are_nearer_on_many_layers() {
    for scene in ["builtin:glass", "builtin:cloth:sheets=3,cells=24"] {
        let scene = screendoor::scene::load(scene).unwrap();
        let options =
            CaptureOptions { width: 64, height: 64, samples: 4, ..CaptureOptions::default() };
        let trace = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
        let exact = picture(&design("exact"), &trace, 4, 0);
        let region = Region::frame(exact.grid());
        let rmse = |spec: &str| errors(&picture(&design(spec), &trace, 4, 0), &exact, &region).rmse;
        let all = ["mboit:moments=8", "mboit:moments=6", "mboit", "wboit", "wboit:weight=one"];
        let all = all.map(rmse);
        assert!(all.is_sorted_by(|a, b| a * 1.1 < *b), "{all:?}");
    }
}

#[test]
fn thousands_of_almost_opaque_layers_give_a_colour() {
    let mut header = header(4, 4, 4);
    header.background = [1.0; 3];
    // At one depth, over the whole range, and at its ends.
    let depths: [fn(u32) -> u32; 3] =
        [|_| 7, |i| i.wrapping_mul(0x9e37_79b9), |i| (i % 2) * u32::MAX];
    for depth in depths {
        for alpha in [1e-30, 0.999_999_9] {
            let fragments =
                layered(&header, 2000, |i| (depth(i), [(i % 5) as f32 / 4.0; 3], alpha));
            let trace = trace(&header, &fragments);
            for design in all() {
                let colour = picture(&design, &trace, 4, 0).get(1, 2);
                let range = -1e-5..=1.0 + 1e-5;
                assert!(colour.iter().all(|c| range.contains(c)), "{} {colour:?}", design.label());
            }
        }
    }
}
