//! What designs that keep layers guarantee, and how they stand to one another.

use screendoor::metrics::{Ensemble, Region, errors};
use screendoor::picture::Picture;
use screendoor::random::{Stream, hash};
use screendoor::trace::{Fragment, SampleMask, Trace, Unorm32};

use crate::util::{design, header, layered, picture, random_fragments, trace};

/// Errors of this size, in 8-bit units, are those of sums in single precision.
const ROUNDING: f64 = 1e-3;

fn largest_error(a: &Picture, b: &Picture) -> f64 {
    errors(a, b, &Region::frame(a.grid())).max
}

/// Flat fragments with everything else random, some opaque, the deepest pixel of
/// which has 20 to 32.
fn flat(samples: u32) -> Trace {
    let header = header(12, 12, samples);
    let mut fragments = random_fragments(&header, 12 * 12 * 12, 77);
    for (i, f) in fragments.iter_mut().enumerate() {
        (f.depth.dzdx, f.depth.dzdy) = (0, 0);
        if i % 9 == 0 {
            f.alpha = 1.0;
        }
    }
    let depth = |x, y| fragments.iter().filter(|f| (f.x, f.y) == (x, y)).count();
    let deepest = (0..12).flat_map(|x| (0..12).map(move |y| depth(x, y))).max().unwrap();
    assert!((20..=32).contains(&deepest), "{deepest}");
    trace(&header, &fragments)
}

#[test]
fn with_room_for_all_layers_everyone_is_exact() {
    for samples in [1, 8] {
        let trace = flat(samples);
        let exact = picture(&design("exact"), &trace, samples, 0);
        let error = |spec: &str| largest_error(&picture(&design(spec), &trace, samples, 0), &exact);
        for name in ["kbuffer", "abuffer", "mlab", "hybrid", "adaptive", "depth-peeling"] {
            for opaque in ["first", "together"] {
                let spec = format!("{name}:layers=32,opaque={opaque}");
                assert!(error(&spec) < ROUNDING, "{spec} at {samples}: {}", error(&spec));
            }
            let few = format!("{name}:layers=4");
            assert!(error(&few) > 1.0, "{few} at {samples}");
        }
    }
}

#[test]
fn of_layers_at_equal_depths_the_later_lies_in_front() {
    let header = header(4, 4, 4);
    let colour = |i: u32| [i as f32 / 5.0; 3];
    let trace = trace(&header, &layered(&header, 6, |i| (i / 3 * 100, colour(i), 0.4)));
    let exact = picture(&design("exact"), &trace, 4, 0);
    for (spec, good) in [
        ("kbuffer", true),
        ("abuffer", true),
        ("mlab", true),
        ("hybrid", true),
        ("depth-peeling:ties=kept", true),
        // What these do not tell apart they lose, or let through each other.
        ("depth-peeling", false),
        ("adaptive", false),
    ] {
        let error = largest_error(&picture(&design(spec), &trace, 4, 0), &exact);
        assert_eq!(error < ROUNDING, good, "{spec}: {error}");
    }
}

#[test]
fn slab_without_bound_on_its_bits_is_the_k_buffer() {
    let header = header(16, 16, 8);
    let trace = trace(&header, &random_fragments(&header, 16 * 16 * 20, 3));
    for coverage in ["mask", "share"] {
        for layers in [1, 4, 32] {
            let hash = |spec: &str| {
                let spec = format!("{spec},layers={layers},coverage={coverage}");
                picture(&design(&spec), &trace, 8, 1).hash()
            };
            let k_buffer = hash("kbuffer:opaque=first");
            for opacity in ["discrete", "continuous"] {
                let slab = format!("slab:bits=0,normalise=none,opacity={opacity}");
                assert_eq!(hash(&slab), k_buffer);
            }
            assert_ne!(hash("slab:bits=64,normalise=none"), k_buffer);
        }
        assert_eq!(
            picture(
                &design(&format!("abuffer:overflow=furthest,coverage={coverage}")),
                &trace,
                8,
                0
            )
            .hash(),
            picture(&design(&format!("kbuffer:coverage={coverage}")), &trace, 8, 0).hash()
        );
    }
}

/// 24 whole flat layers, near to far, far to near, and at random.
fn orders(samples: u32) -> [Trace; 3] {
    let header = header(12, 12, samples);
    let colour =
        |i: u32| std::array::from_fn(|c| (hash([i, c as u32]) >> 8) as f32 / 2_f32.powi(24));
    let near_first = layered(&header, 24, |i| (i, colour(i), 0.05 + 0.4 * colour(i + 99)[0]));
    let far_first: Vec<Fragment> = near_first.iter().rev().copied().collect();
    let mut random = near_first.clone();
    Stream::new([5]).shuffle(&mut random);
    [near_first, far_first, random].map(|fragments| trace(&header, &fragments))
}

#[test]
fn slab_with_as_many_bits_as_layers_is_stochastic_transparency_in_this_sense() {
    for samples in [4, 8, 16] {
        // Discrete opacity and whole pixels, and hidden layers removed: the bits are the
        // samples of stochastic transparency, whatever the order.
        let same = |slab: &str, enderton: &str, trace| {
            let slab = format!(
                "slab:opacity=discrete,normalise=none,bits={samples},layers={samples},{slab}"
            );
            let slab = picture(&design(&slab), trace, samples, 3);
            largest_error(&slab, &picture(&design(enderton), trace, samples, 3)) < ROUNDING
        };
        let [near_first, far_first, random] = orders(samples);
        for trace in [&near_first, &far_first, &random] {
            assert!(same("hidden=removed", "enderton:among=covered", trace));
            let independent = "hidden=removed,insertion=independent";
            assert!(same(independent, "enderton:mask=naive", trace));
            assert!(!same("hidden=removed", "enderton:mask=naive", trace));
        }
        // As published only near to far: elsewhere hidden layers take room.
        assert!(same("hidden=kept", "enderton:among=covered", &near_first));
        assert!(!same("hidden=kept", "enderton:among=covered", &far_first));
        assert!(!same("hidden=kept", "enderton:among=covered", &random));
        // An alpha that is discretised only for the probabilities is something else.
        let continuous = format!("slab:normalise=none,bits={samples},layers={samples}");
        let continuous = picture(&design(&continuous), &near_first, samples, 3);
        let enderton = picture(&design("enderton"), &near_first, samples, 3);
        assert!(largest_error(&continuous, &enderton) > 1.0);
    }
}

/// Mean error over `seeds` in 8-bit units, and how many standard errors that is.
fn bias(spec: &str, trace: &Trace, samples: u32, seeds: u32) -> (f64, f64) {
    let exact = picture(&design("exact"), trace, samples, 0);
    let region = Region::frame(exact.grid());
    let mut ensemble = Ensemble::new(&exact, &[&region]);
    let design = design(spec);
    (0..seeds).for_each(|i| ensemble.add(&picture(&design, trace, samples, hash([i]))));
    let mean = ensemble.finish()[0].mean;
    (mean.value, mean.standard_errors(seeds as usize))
}

#[test]
fn what_is_unbiased_in_slab_where_no_layers_cross() {
    const DISCRETE: &str = "slab:opacity=discrete,normalise=none,bits=8";
    for trace in &orders(4) {
        for (spec, unbiased) in [
            (format!("{DISCRETE},layers=8,hidden=removed"), true),
            (format!("{DISCRETE},layers=8,hidden=removed,insertion=independent"), true),
            // Visible layers are dropped.
            (format!("{DISCRETE},layers=4,hidden=removed"), false),
            // No layer is dropped: they are no more than 24.
            (format!("{DISCRETE},layers=24"), true),
            ("slab:normalise=none,bits=8,layers=24,weigh=true".into(), true),
            ("slab:normalise=none,bits=8,layers=24,weigh=true,insertion=independent".into(), true),
            // As published, alpha is lost with what does not enter.
            ("slab:normalise=none,bits=8,layers=24".into(), false),
            // Bits also tell visibility without bias, alphas that did not enter do not:
            // everything behind them is too bright.
            (format!("{DISCRETE},layers=8,hidden=removed").replace("none", "depth"), true),
            ("slab:normalise=depth,bits=8,layers=24".into(), false),
            ("slab:normalise=alpha,bits=8,layers=24".into(), false),
            ("slab:bits=8,layers=24".into(), false),
        ] {
            let (value, errors) = bias(&spec, trace, 4, 200);
            // 33 tests: 5 standard errors leave 2e-5 for all.
            assert_eq!(errors < 5.0, unbiased, "{spec}: {value:+.3}, {errors:.1}");
        }
    }
}

#[test]
fn a_faint_layer_in_slab_is_lost_as_often_as_its_alpha_falls_short_of_a_bit() {
    let header = header(48, 48, 1);
    let trace = |alpha| trace(&header, &layered(&header, 1, |_| (1, [1.0; 3], alpha)));
    let mean = |spec: &str, alpha: f32| {
        let (value, _) = bias(spec, &trace(alpha), 1, 16);
        value / 255.0 / f64::from(alpha)
    };
    // Half a bit: half of the layers, which keep their alpha, half of what is due; one
    // bit and more: all.
    let printed = "slab:bits=8,normalise=none";
    assert!((mean(printed, 1.0 / 16.0) + 0.5).abs() < 0.02);
    assert_eq!(mean(printed, 1.0 / 8.0), 0.0);
    assert_eq!(mean("slab:bits=0,normalise=none", 1.0 / 16.0), 0.0);
    assert!(mean("slab:bits=8,normalise=none,weigh=true", 1.0 / 16.0).abs() < 0.04);
    assert!(mean("slab:bits=8,normalise=none,opacity=discrete", 1.0 / 16.0).abs() < 0.04);
    // By visibility every fragment counts, whether it entered or not.
    assert!(mean("slab:bits=8,normalise=both", 1.0 / 16.0).abs() < 1e-6);
}

#[test]
fn masks_keep_apart_what_shares_mix() {
    // Two opaque halves of a pixel over a third layer behind both.
    let header = header(1, 1, 2);
    let mut fragments = layered(&header, 3, |i| (i, [i as f32 / 2.0; 3], 1.0));
    fragments[0].coverage = SampleMask(1);
    fragments[1].coverage = SampleMask(2);
    fragments[1].depth.z = Unorm32(0);
    let trace = trace(&header, &fragments);
    let red = |spec: &str| picture(&design(spec), &trace, 2, 0).get(0, 0)[0];
    for name in ["kbuffer", "mlab", "hybrid", "abuffer", "adaptive"] {
        // 0 and 0.5 side by side.
        assert_eq!(red(&format!("{name}:opaque=together")), 0.25, "{name}");
    }
    // Half of 0.5, before half of 0, before all of white.
    assert_eq!(red("kbuffer:opaque=together,coverage=share"), 0.25 + 0.25);
}
