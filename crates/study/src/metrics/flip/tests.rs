//! Values of the published evaluator: `flip_evaluator` 1.7 from PyPI (C++ inside), given
//! the pictures of the same formulas, linear, as 32-bit floats.

use super::*;
use screendoor_trace::random::mix;

fn picture(width: u32, height: u32, pixel: impl FnMut(u32, u32) -> [f64; 3]) -> Picture {
    Picture::from_fn(TileGrid::new(width, height), pixel)
}

/// A random number in [0, 1) for a channel of a pixel.
fn noise(x: u32, y: u32, channel: u32) -> f64 {
    f64::from(mix(x + (y << 10) + (channel << 20)) >> 8) / f64::from(1 << 24)
}

/// A smooth picture, and with noise.
fn gradient() -> (Picture, Picture) {
    let colour =
        |x: u32, y: u32| [f64::from(x) / 39.0, f64::from(y) / 27.0, f64::from((x + y) % 16) / 15.0];
    let noisy = |x, y| {
        let c = colour(x, y);
        [0, 1, 2].map(|i| (c[i] + 0.2 * (noise(x, y, i as u32) - 0.5)).clamp(0.0, 1.0))
    };
    (picture(40, 28, colour), picture(40, 28, noisy))
}

/// Two colours with an oblique edge, and with that moved and a few white pixels.
fn edges() -> (Picture, Picture) {
    let side =
        |x: u32, y: u32, at| if 3 * x + 2 * y < at { [0.8, 0.1, 0.1] } else { [0.05, 0.2, 0.6] };
    let moved = |x, y| if noise(x, y, 7) < 0.02 { [1.0; 3] } else { side(x, y, 99) };
    (picture(33, 47, |x, y| side(x, y, 90)), picture(33, 47, moved))
}

/// From 1e-3 to 50 from left to right, and with each pixel up to half as dark or bright
/// again.
fn bright() -> (Picture, Picture) {
    let colour = |x: u32, y: u32| {
        let v = 1e-3 * libm::pow(50_000.0, f64::from(x) / 47.0);
        [v, v * (0.5 + f64::from(y) / 62.0), v * 0.7]
    };
    let noisy = |x, y| colour(x, y).map(|c| c * (0.5 + noise(x, y, 3)));
    (picture(48, 32, colour), picture(48, 32, noisy))
}

/// Holds a map to the evaluator's figures and to some of its pixels.
fn check(map: &FlipMap, mean: f64, quartiles: [f64; 3], pixels: &[(u32, u32, f32)]) {
    let found = map.figures();
    assert!((found.mean - mean).abs() < 1e-5, "{found:?}");
    for (a, b) in found.quartiles.iter().zip(quartiles) {
        assert!((a - b).abs() < 1e-4, "{found:?}");
    }
    for (x, y, value) in pixels {
        let at = map.values()[(y * map.width() + x) as usize];
        assert!((at - value).abs() < 1e-4, "({x}, {y}): {at}, not {value}");
    }
}

#[test]
fn ldr_is_the_evaluators() {
    let (reference, picture) = gradient();
    let map = Flip::new(&reference).ldr(&picture);
    check(
        &map,
        0.110_378,
        [0.093_615, 0.119_327, 0.153_302],
        &[
            (0, 0, 0.245_086),
            (7, 5, 0.116_500),
            (20, 14, 0.104_752),
            (31, 9, 0.120_683),
            (39, 27, 0.095_390),
        ],
    );
    let (reference, picture) = edges();
    let map = Flip::new(&reference).ldr(&picture);
    check(
        &map,
        0.235_097,
        [0.256_029, 0.383_368, 0.566_181],
        &[
            (0, 0, 0.002_722),
            (15, 25, 0.652_035),
            (20, 18, 0.609_186),
            (9, 35, 0.593_876),
            (32, 46, 0.005_765),
        ],
    );
}

#[test]
fn hdr_is_the_evaluators() {
    let (reference, picture) = bright();
    let flip = Flip::new(&reference);
    assert_eq!(flip.exposures(), 9);
    check(
        &flip.hdr(&picture),
        0.106_454,
        [0.093_764, 0.129_673, 0.173_977],
        &[
            (0, 0, 0.016_837),
            (10, 16, 0.064_510),
            (24, 8, 0.113_165),
            (40, 30, 0.039_683),
            (47, 31, 0.175_747),
        ],
    );
}

#[test]
fn equal_pictures_differ_nowhere() {
    for (reference, picture) in [gradient(), edges(), bright()] {
        for same in [&reference, &picture] {
            let flip = Flip::new(same);
            assert!(flip.ldr(same).values().iter().all(|v| *v == 0.0));
            assert!(flip.hdr(same).values().iter().all(|v| *v == 0.0));
        }
    }
}

#[test]
fn black_to_white_is_the_evaluators() {
    let all = |value| picture(8, 8, |_, _| [value; 3]);
    let map = Flip::new(&all(0.0)).ldr(&all(1.0));
    assert!(map.values().iter().all(|v| (v - 0.967_388_3).abs() < 1e-5), "{:?}", map.values());
    // A black reference is compared at no exposure of its own.
    let hdr = Flip::new(&all(0.0)).hdr(&all(1.0));
    assert_eq!(hdr, map);
    assert!(Flip::new(&all(0.0)).hdr(&all(0.0)).values().iter().all(|v| *v == 0.0));
}

#[test]
fn mirrored_pictures_have_the_mirrored_map() {
    let (reference, picture) = gradient();
    let mirror = |p: &Picture| self::picture(40, 28, |x, y| p.get(39 - x, y));
    let map = Flip::new(&reference).ldr(&picture);
    let mirrored = Flip::new(&mirror(&reference)).ldr(&mirror(&picture));
    for (row, other) in map.values().chunks(40).zip(mirrored.values().chunks(40)) {
        assert!(row.iter().zip(other.iter().rev()).all(|(a, b)| (a - b).abs() < 1e-5));
    }
    // Which of the two is the reference does not matter to LDR-FLIP.
    let swapped = Flip::new(&picture).ldr(&reference);
    assert!((map.figures().mean - swapped.figures().mean).abs() < 1e-7);
}

#[test]
fn a_planted_defect_is_seen_where_it_is() {
    let (reference, _) = edges();
    let grid = reference.grid();
    let mut defect = reference.clone();
    for c in &mut defect.tile_mut(grid.tile(20, 30))[TileGrid::within(20, 30)] {
        *c += 0.1;
    }
    let map = Flip::new(&reference).ldr(&defect);
    let worst = map.values().iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
    assert_eq!(worst.0, 30 * 33 + 20);
    assert!(*worst.1 > 0.01);
    assert!(map.values()[..33 * 15].iter().all(|v| *v == 0.0));
}

#[test]
fn values_out_of_range_are_clamped() {
    let plain = picture(9, 1, |x, _| [f64::from(x) / 8.0; 3]);
    let wild = picture(9, 1, |x, _| match x {
        0 => [-3.0, f64::NEG_INFINITY, f64::NAN],
        8 => [f64::INFINITY, 1e300, 2.0],
        _ => [f64::from(x) / 8.0; 3],
    });
    let flip = Flip::new(&wild);
    assert!(flip.ldr(&plain).values().iter().all(|v| *v == 0.0));
    for map in [flip.hdr(&plain), Flip::new(&plain).hdr(&wild), flip.hdr(&wild)] {
        assert!(map.values().iter().all(|v| (0.0..=1.0).contains(v)), "{map:?}");
    }
}

#[test]
fn one_pixel_is_a_picture() {
    let one = |v| picture(1, 1, |_, _| [v, v / 2.0, v]);
    let flip = Flip::new(&one(0.5));
    assert!(flip.ldr(&one(0.4)).values()[0] > 0.0);
    assert!(flip.hdr(&one(4.0)).values()[0] > 0.0);
}

/// `cargo test --release --lib flip::tests::times -- --ignored --nocapture`.
#[test]
#[ignore = "prints times"]
fn times() {
    let (reference, picture) = bright();
    let large = |p: &Picture| self::picture(256, 256, |x, y| p.get(x % 48, y % 32));
    let (reference, picture) = (large(&reference), large(&picture));
    let flip = Flip::new(&reference);
    for _ in 0..3 {
        let start = std::time::Instant::now();
        flip.ldr(&picture);
        let ldr = start.elapsed();
        flip.hdr(&picture);
        let hdr = start.elapsed() - ldr;
        println!("ldr {ldr:?}, hdr of {} exposures {hdr:?}", flip.exposures());
    }
}
