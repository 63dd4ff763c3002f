//! Large numbers and small masks.

use crate::study::stress::case::{Case, Group, at_depth, hue, layer, over};
use screendoor_trace::trace::{Fragment, SampleMask};

/// Three layers whose primitives and objects are numbered from `first` on.
fn numbered(first: u32) -> impl Iterator<Item = Fragment> {
    (0..3).map(move |i| {
        let number = first.wrapping_add(i);
        Fragment { primitive: number, object: number, ..layer(i, hue(i), 0.4) }
    })
}

pub(super) fn cases() -> Vec<Case> {
    let new = |name: &str, what: &str| Case::new(Group::Frame, name, what);
    let ids = |name: &str, first| {
        new(name, "three layers whose objects and primitives are numbered there")
            .kind(numbered(first))
    };
    let full = |f: Fragment| Fragment { coverage: SampleMask::first(64), ..f };
    vec![
        ids("objects past 2^8", (1 << 8) - 1),
        ids("objects past 2^16", (1 << 16) - 1),
        ids("objects at 2^32", u32::MAX - 2),
        Case {
            side: 2,
            ..new("surfaces past 2^16", "70,000 layers of alpha 0.3, far to near: as many surfaces")
                .kind((0..70_000).rev().map(|i| {
                    let number = 70_000 - i;
                    let f = at_depth(i << 15, layer(0, hue(i), 0.3));
                    Fragment { primitive: number, object: number, ..f }
                }))
        },
        Case {
            samples: 64,
            frame: Some(16384),
            ..new("16384 x 16384 at 64", "the last pixels, whose samples are numbered up to 2^34")
                .kind((0..3).map(|i| full(layer(i, hue(i), 0.4))))
        },
        new("one sample", "each layer covers one sample of its own, or all cover the last")
            .kind((0..8).map(|i| over(1 << i, layer(i, hue(i), 0.5))))
            .kind((0..8).map(|i| over(1 << 7, layer(i, hue(i), 0.5)))),
        Case {
            samples: 1,
            ..new("one sample in all", "pixels of a single sample")
                .kind((0..3).map(|i| over(1, layer(i, hue(i), 0.4))))
        },
        Case {
            samples: 64,
            ..new("sample 63", "layers that cover the last of 64 samples alone")
                .kind((0..3).map(|i| over(1 << 63, layer(i, hue(i), 0.4))))
        },
    ]
}
