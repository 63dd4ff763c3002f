//! Alphas at the ends of their range.

use crate::study::stress::case::{Case, Group, hue, layer};

pub(super) fn cases() -> Vec<Case> {
    let eighth = 1.0 / 8.0_f32;
    let list: [(&str, f32); 12] = [
        ("alpha 0", 0.0),
        ("alpha -0", -0.0),
        ("smallest denormal", f32::from_bits(1)),
        ("1e-9", 1e-9),
        ("2^-32", 2_f32.powi(-32)),
        ("2^-24", 2_f32.powi(-24)),
        ("1/2S", eighth / 2.0),
        ("1/S - 1 ulp", eighth.next_down()),
        ("1/S", eighth),
        ("1/S + 1 ulp", eighth.next_up()),
        ("1 - 1 ulp", 1.0_f32.next_down()),
        ("alpha 1", 1.0),
    ];
    let case = |(name, alpha): (&str, f32)| {
        let what = format!("one layer, and three, of alpha {alpha:e}");
        let layers = |n: u32| (0..n).map(move |i| layer(i, hue(i), alpha));
        Case::new(Group::Opacity, name, what).kind(layers(1)).kind(layers(3))
    };
    list.into_iter().map(case).collect()
}
