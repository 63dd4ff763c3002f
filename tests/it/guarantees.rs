//! What Laine and Karras 2011 guarantee, at every sample count.

use screendoor::capture::{Capture, CaptureOptions};
use screendoor::random::Stream;
use screendoor::trace::{DepthPlane, Fragment, Header, SampleMask, Trace, Unorm32};

use crate::util::{design, header, layered, picture, trace};

const COUNTS: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
const ALPHAS: [f32; 9] = [0.0, 0.1, 0.25, 0.3, 0.5, 0.61, 0.75, 0.999, 1.0];

/// How many of a pixel's samples are white, the rest being black.
fn white_samples(design_spec: &str, trace: &Trace, samples: u32) -> Vec<f64> {
    let picture = picture(&design(design_spec), trace, samples, 0);
    let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
    pixels.map(|(x, y)| picture.get(x, y)[0] * f64::from(samples)).collect()
}

#[test]
fn one_surface_covers_floor_or_ceiling_of_its_share_in_every_pixel() {
    for samples in COUNTS {
        for alpha in ALPHAS {
            let header = header(40, 24, samples);
            let trace = trace(&header, &layered(&header, 1, |_| (1000, [1.0; 3], alpha)));
            let share = f64::from(alpha) * f64::from(samples);
            let right = |n: &f64| *n == share.floor() || *n == share.ceil();
            for spec in ["lk", "lk:reference=radical-inverse", "lk:reference=sobol", "enderton"] {
                let counts = white_samples(spec, &trace, samples);
                assert!(counts.iter().all(right), "{spec}: {samples} samples, alpha {alpha}");
                // Spatial stratification: over the frame the share is kept too.
                if spec.starts_with("lk") {
                    let mean = counts.iter().sum::<f64>() / counts.len() as f64;
                    assert!((mean - share).abs() < 0.05, "{spec}: {samples}, {alpha}: {mean}");
                }
            }
            // The check can fail: independent reference values keep no share.
            if samples >= 8 && (0.2..0.8).contains(&alpha) {
                let counts = white_samples("lk:reference=white", &trace, samples);
                assert!(!counts.iter().all(right));
            }
        }
    }
}

/// Two surfaces of alpha 0.5: the far one is white, the near one black.
fn two_surfaces(samples: u32, near_first: bool) -> Trace {
    let header = header(40, 24, samples);
    let near = |i: u32| (i == 0) == near_first;
    trace(
        &header,
        &layered(
            &header,
            2,
            |i| {
                if near(i) { (1000, [0.0; 3], 0.5) } else { (2000, [1.0; 3], 0.5) }
            },
        ),
    )
}

#[test]
fn two_half_transparent_surfaces_leave_the_far_one_exactly_a_quarter_in_both_orders() {
    // LK figure 5, at 16 samples and at every other count that has a quarter.
    for samples in COUNTS.into_iter().filter(|n| *n >= 4) {
        let quarter = f64::from(samples / 4);
        let exactly = |spec: &str, near_first| {
            let counts = white_samples(spec, &two_surfaces(samples, near_first), samples);
            counts.iter().all(|n| *n == quarter)
        };
        assert!(exactly("lk", true) && exactly("lk", false), "{samples}");
        // Compaction alone settles the near-to-far order (figure 5b), not the other (5c).
        assert!(exactly("lk:sort=false", true), "{samples}");
        assert!(!exactly("lk:sort=false", false), "{samples}");
        // Without either, neither order is settled (figure 5a).
        assert!(!exactly("lk:sort=false,compact=false", true), "{samples}");
        assert!(!exactly("lk:sort=false,compact=false", false), "{samples}");
    }
}

/// Every pixel's samples cut at random into disjoint fragments of one surface.
fn in_pieces(header: &Header, alpha: f32, pieces: u32) -> Vec<Fragment> {
    let samples = header.pattern.samples();
    let mut random = Stream::new([0x91ece5, samples, pieces]);
    let mut fragments = Vec::new();
    for y in 0..header.height as u16 {
        for x in 0..header.width as u16 {
            let mut masks = vec![SampleMask::NONE; pieces as usize];
            for s in 0..samples as usize {
                masks[random.below(pieces) as usize].insert(s);
            }
            for (i, coverage) in masks.into_iter().enumerate().filter(|(_, m)| !m.is_empty()) {
                fragments.push(Fragment {
                    x,
                    y,
                    coverage,
                    depth: DepthPlane { z: Unorm32(1000), dzdx: 0, dzdy: 0 },
                    colour: [1.0; 3],
                    alpha,
                    primitive: i as u32,
                    object: 0,
                    ..Fragment::default()
                });
            }
        }
    }
    fragments
}

#[test]
fn a_surface_in_many_pieces_occupies_as_many_samples_as_in_one() {
    for samples in COUNTS {
        for alpha in [0.3, 0.5, 0.61] {
            let header = header(40, 24, samples);
            let whole = trace(&header, &in_pieces(&header, alpha, 1));
            for count in [2, 3, 5] {
                let pieces = trace(&header, &in_pieces(&header, alpha, count));
                let same = |spec: &str| {
                    white_samples(spec, &whole, samples) == white_samples(spec, &pieces, samples)
                };
                assert!(same("lk"), "{samples} samples, alpha {alpha}, {count} pieces");
                assert!(same("lk:track=covered"));
                if samples >= 4 {
                    // Whoever stratifies within fragments shows the edges.
                    assert!(!same("enderton") && !same("lk:surfaces=every-fragment"));
                }
            }
        }
    }
}

#[test]
fn the_five_quads_of_figure_1_leave_no_trace() {
    let scene = screendoor::scene::load("builtin:ramps").unwrap();
    for samples in [4, 8, 16] {
        let options =
            CaptureOptions { width: 160, height: 160, samples, ..CaptureOptions::default() };
        let capture = Capture::new(&scene, &options).unwrap();
        let trace = capture.to_memory(|_, _| ()).unwrap();
        // Well within the lowest band, which is drawn as five quads of alpha 0.75.
        let off = |spec: &str| {
            let picture = picture(&design(spec), &trace, samples, 0);
            let inside = (114..150).flat_map(|y| (10..150).map(move |x| (x, y)));
            inside.filter(|(x, y)| picture.get(*x, *y)[0] != 0.75).count()
        };
        assert_eq!(off("lk"), 0, "{samples}");
        assert!(off("enderton") > 20, "{samples}: {}", off("enderton"));
    }
}
