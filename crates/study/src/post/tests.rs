use super::*;
use crate::metrics::{PixelClasses, rmse};
use screendoor_designs::{REFERENCE, configure};
use screendoor_rop::ReplayOptions;
use screendoor_scene::capture::{Capture, CaptureOptions};
use screendoor_scene::scene;
use screendoor_trace::trace::Trace;

fn captured(name: &str) -> Trace {
    let options =
        CaptureOptions { width: 72, height: 64, samples: 64, ..CaptureOptions::default() };
    let scene = scene::load(&format!("builtin:{name}")).unwrap();
    Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap()
}

fn drawn(trace: &Trace, design: &str, samples: u32) -> Picture {
    let options = ReplayOptions::default();
    configure(design, &[]).unwrap().replay(trace, samples, 3, &options).unwrap().picture
}

fn filter(spec: &str) -> PostFilter {
    PostFilter::parse(spec).unwrap()
}

#[test]
fn total_alpha_is_one_minus_what_the_exact_design_lets_through() {
    // Of a scene that is painted black before white, what is seen is what comes through.
    let options = CaptureOptions {
        width: 40,
        height: 32,
        samples: 4,
        background: Some([1.0; 3]),
        ..CaptureOptions::default()
    };
    let mut scene = scene::load("builtin:cloth").unwrap();
    scene.whiten();
    let white = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    let options = CaptureOptions { background: Some([0.0; 3]), ..options };
    let black = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    let guides = Guides::of(&white, 4, 1 << 28).unwrap();
    let [white, black] = [&white, &black].map(|trace| drawn(trace, REFERENCE, 4));
    let mut seen = 0;
    for (x, y) in (0..40).flat_map(|x| (0..32).map(move |y| (x, y))) {
        let through = white.get(x, y)[0] - black.get(x, y)[0];
        assert!((guides.get(x, y).alpha - (1.0 - through)).abs() < 1e-5, "{x} {y}");
        seen += u32::from(guides.get(x, y).noisy);
    }
    assert!(seen > 300, "{seen}");
}

#[test]
fn guides_do_not_depend_on_the_order_and_depth_spans_its_range() {
    let trace = captured("glass");
    let guides = Guides::of(&trace, 8, 1 << 28).unwrap();
    let all = (0..72).flat_map(|x| (0..64).map(move |y| (x, y)));
    let depths: Vec<f64> = all.map(|(x, y)| guides.get(x, y).depth).collect();
    let most = depths.iter().copied().fold(0.0, f64::max);
    assert!((most - 1.0).abs() < 1e-9 && depths.iter().all(|d| (0.0..=1.0).contains(d)));
    let few = Guides::of(&trace, 8, 1000).unwrap_err().to_string();
    assert!(few.contains("post filters take more than"), "{few}");
}

#[test]
fn what_is_alike_is_kept_and_noise_is_averaged() {
    let trace = captured("cloth");
    let guides = Guides::of(&trace, 4, 1 << 28).unwrap();
    let covered = PixelClasses::of(&trace, 4).unwrap().covered;
    let exact = drawn(&trace, REFERENCE, 4);
    let noisy = drawn(&trace, "enderton:mask=naive", 4);
    let error = |picture: &Picture| rmse(picture, &exact, &covered);
    for spec in ["gaussian", "bilateral", "alpha", "depth"] {
        let filtered = filter(spec).apply(&noisy, &guides);
        assert!(error(&filtered) < 0.9 * error(&noisy), "{spec}");
    }
    // What is guided blurs the exact picture less.
    let blur = |spec: &str| error(&filter(spec).apply(&exact, &guides));
    // Cloth is textured, which its alpha does not tell.
    assert!(blur("alpha") < 0.95 * blur("gaussian"), "{} {}", blur("alpha"), blur("gaussian"));
    assert!(blur("depth") < blur("alpha"));
    // The narrower the Gaussian, the less it does.
    assert!(error(&filter("gaussian:sigma=0.1").apply(&noisy, &guides)) > 0.999 * error(&noisy));
    // A picture of one colour stays as it is, but for rounding.
    let plain = Picture::from_fn(exact.grid(), |_, _| [0.25, 0.5, 0.75]);
    let kept = filter("alpha").apply(&plain, &guides);
    for (x, y) in (0..72).flat_map(|x| (0..64).map(move |y| (x, y))) {
        assert!((kept.get(x, y)[2] - 0.75).abs() < 1e-12);
    }
}

#[test]
fn what_lets_no_light_through_is_left_alone() {
    let trace = captured("engine:rows=1,detail=2");
    let guides = Guides::of(&trace, 4, 1 << 28).unwrap();
    let noisy = drawn(&trace, "enderton", 4);
    let filtered = filter("gaussian:sigma=3").apply(&noisy, &guides);
    let (mut left, mut changed) = (0, 0);
    for (x, y) in (0..72).flat_map(|x| (0..64).map(move |y| (x, y))) {
        match guides.get(x, y).noisy {
            true => changed += u32::from(filtered.get(x, y) != noisy.get(x, y)),
            false => {
                assert_eq!(filtered.get(x, y), noisy.get(x, y));
                left += 1;
            }
        }
    }
    assert!(left > 100 && changed > 100, "{left} {changed}");
}

#[test]
fn filters_are_refused_by_name() {
    for (spec, word) in [
        ("median", "unknown filter 'median'"),
        ("alpha:rang=1", "did you mean 'range'?"),
        ("alpha:range=0", "range"),
        ("gaussian:sigma=17", "sigma"),
        ("gaussian:range=1", "range"),
    ] {
        let error = PostFilter::parse(spec).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}
