//! Depths that lie where ties, clamps and narrow buffers decide.

use crate::study::stress::case::{Case, Group, at_depth, hue, layer, sloped};
use screendoor_trace::trace::Fragment;

/// Layers of alpha 0.5 at depths.
fn at(depths: impl IntoIterator<Item = u32>) -> impl Iterator<Item = Fragment> {
    let layers = depths.into_iter().enumerate();
    layers.map(|(i, z)| at_depth(z, layer(i as u32, hue(i as u32), 0.5)))
}

/// The same with slopes.
fn planes(list: impl IntoIterator<Item = (u32, i32, i32)>) -> impl Iterator<Item = Fragment> {
    let layers = list.into_iter().enumerate();
    layers.map(|(i, (z, dzdx, dzdy))| {
        sloped(dzdx, dzdy, at_depth(z, layer(i as u32, hue(i as u32), 0.5)))
    })
}

pub(super) fn cases() -> Vec<Case> {
    let new = |name: &str, what: &str| Case::new(Group::Depth, name, what);
    let middle = 1_u32 << 31;
    vec![
        new("equal", "three layers at one depth: the last lies in front").kind(at([middle; 3])),
        new("one unit apart", "three layers 2^-32 of the range apart, the last the nearest")
            .kind(at([middle + 2, middle + 1, middle])),
        new("z-fighting", "planes that cross within the pixel, and one that nearly coincides")
            .kind(planes([
                (middle, 1 << 20, -(1 << 19)),
                (middle, -(1 << 20), 1 << 19),
                (middle + 1, 1 << 20, -(1 << 19)),
            ])),
        new("before the near plane", "planes of which some samples lie before it: clamped")
            .kind(planes([(0, -(1 << 28), 0), (0, 0, 1 << 28), (1 << 20, -(1 << 24), 1 << 24)])),
        new("beyond the far plane", "planes of which some samples lie beyond it: clamped").kind(
            planes([
                (u32::MAX, 1 << 28, 0),
                (u32::MAX, 0, -(1 << 28)),
                (u32::MAX - (1 << 20), 1 << 24, 1 << 24),
            ]),
        ),
        new("infinite slopes", "slopes that saturate, with either sign").kind(planes([
            (middle, i32::MAX, i32::MIN),
            (middle, i32::MIN, i32::MAX),
            (middle, i32::MAX, i32::MAX),
        ])),
        new("near plane", "three layers at depth 0").kind(at([0; 3])),
        new("far plane", "three layers at depth 2^32 - 1, where a cleared buffer stands")
            .kind(at([u32::MAX; 3])),
        new("below 24 bits", "three layers that 24 bits of depth do not tell apart, far to near")
            .kind(at([middle + 192, middle + 128, middle + 64])),
        new("below 16 bits", "three layers that 16 bits do not, far to near").kind(at([
            middle + 0xc000,
            middle + 0x8000,
            middle + 0x4000,
        ])),
    ]
}
