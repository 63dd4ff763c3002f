//! Colours of every size and sign.

use crate::study::stress::case::{Case, Group, at_depth, layer};
use screendoor_trace::trace::ColourFormat;

pub(super) fn cases() -> Vec<Case> {
    let new = |name: &str, what: &str| Case {
        background: [0.0; 3],
        ..Case::new(Group::Colour, name, what)
    };
    let grey = |i, value: f32, alpha| layer(i, [value, value / 2.0, value / 4.0], alpha);
    let pair = |case: Case, value: f32| case.kind([grey(0, value, 0.5), grey(1, value, 0.5)]);
    let ladder = [1e-8, 6e-8, 1e-4, 1.0, 1e4, 65504.0];
    let beside = |case: Case, list: &[f32]| list.iter().fold(case, |case, v| pair(case, *v));
    vec![
        beside(new("1e-8 to 65504", "pixels of each beside each other, single precision"), &ladder),
        Case {
            colour: ColourFormat::F16,
            ..beside(
                new("the same in 16 bits", "stored as half floats, whose smallest is 6e-8"),
                &ladder,
            )
        },
        beside(
            new("beyond 65504", "pixels of 1e10, 1e30 and the largest float"),
            &[1e10, 1e30, f32::MAX],
        ),
        beside(
            new("denormal", "pixels of 1e-40 and of the smallest number; off in units of 2^-126"),
            &[1e-40, f32::from_bits(1)],
        ),
        new("in one pixel", "1e-8, 1 and 65504 over each other").kind([
            grey(2, 65504.0, 0.25),
            grey(0, 1e-8, 0.5),
            grey(1, 1.0, 0.5),
        ]),
        Case {
            background: [1.0, -2.0, 0.5],
            ..new("negative", "colours of both signs that cancel")
                .kind([layer(0, [-1.0, 2.0, -0.5], 0.5), layer(1, [1.0, -2.0, 0.5], 0.25)])
        },
        new("firefly", "one layer of 1e10 and alpha 1/16 in a dark pixel").kind([
            grey(0, 1e-3, 0.5),
            grey(1, 1e10, 0.0625),
            grey(2, 1e-3, 0.5),
        ]),
        new("large sums", "eight layers of the largest float: sums that overflow")
            .kind((0..8).map(|i| layer(i, [f32::MAX, -f32::MAX, f32::MAX / 2.0], 0.9))),
        new("near and bright", "64 layers of 65504 at the near plane: weights that overflow")
            .kind((0..64).map(|i| at_depth(i, grey(i, 65504.0, 1.0_f32.next_down())))),
    ]
}
