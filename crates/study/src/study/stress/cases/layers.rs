//! Many layers, and transmittances that no float holds.

use crate::study::stress::case::{Case, Group, at_depth, hue, layer};
use screendoor_trace::random::Stream;
use screendoor_trace::trace::Fragment;

/// `count` layers of one alpha, evenly through the depth range, in random order.
fn stack(count: u32, alpha: f32, colour: impl Fn(u32) -> [f32; 3]) -> Vec<Fragment> {
    let step = u32::MAX / (count + 1);
    let one = |i| at_depth((i + 1) * step, layer(0, colour(i), alpha));
    let mut layers: Vec<Fragment> =
        (0..count).map(|i| Fragment { primitive: i, object: i, ..one(i) }).collect();
    Stream::new([0x57ac, count]).shuffle(&mut layers);
    layers
}

pub(super) fn cases() -> Vec<Case> {
    let new = |name: &str, what: &str| Case::new(Group::Layers, name, what);
    let deep = |name: &str, count, side| {
        let what = format!("{name} of alpha 0.5 in random order");
        Case { side, ..new(name, &what).kind(stack(count, 0.5, hue)) }
    };
    let black = |count, alpha| stack(count, alpha, |_| [0.0; 3]);
    // What comes through is no number; the picture is black.
    let white = |case: Case| Case { background: [1.0; 3], floor: 1.0, ..case };
    let together = |z: fn(u32) -> u32| (0..16).map(move |i| at_depth(z(i), layer(i, hue(i), 0.3)));
    vec![
        deep("1 layer", 1, 16),
        deep("2 layers", 2, 16),
        deep("64 layers", 64, 16),
        deep("1,000 layers", 1000, 8),
        deep("100,000 layers", 100_000, 2),
        Case {
            side: 4,
            ..new("10,000 of 0.001", "10,000 layers of alpha 0.001 in random order")
                .kind(stack(10_000, 0.001, hue))
        },
        Case {
            background: [1e30; 3],
            ..new("through 1e-30", "30 black layers of alpha 0.9 before 1e30: together 1")
                .kind(black(30, 0.9))
        },
        white(
            new(
                "through 1e-200",
                "200 black layers of alpha 0.9 before white; off in units of white",
            )
            .kind(black(200, 0.9)),
        ),
        white(Case {
            side: 8,
            ..new("through 1e-435", "1,000 black layers of alpha 1 - 1/e before white; as before")
                .kind(black(1000, 0.632_120_56))
        }),
        new("one depth", "16 layers of alpha 0.3 at one depth: one moment problem, no variance")
            .kind(together(|_| 1 << 31)),
        new("2^-32 apart", "the same, each a unit of 32 bits behind the last")
            .kind(together(|i| (1 << 31) + i)),
        new("two ends", "the same, half at the near plane and half at the far plane")
            .kind(together(|i| if i % 2 == 0 { 0 } else { u32::MAX })),
        new("opaque among", "16 layers, every fifth of alpha 1: infinite optical depth")
            .kind((0..16).map(|i| layer(i, hue(i), if i % 5 == 4 { 1.0 } else { 0.3 }))),
    ]
}
