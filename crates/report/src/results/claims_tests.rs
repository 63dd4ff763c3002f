//! Verdicts on made-up numbers, both ways.

use super::*;
use screendoor_study::study::analysis::made_up;

/// An estimate known to a thousandth of it.
fn known(value: f64) -> Estimate {
    let half = 1e-3 * value.abs().max(1e-3);
    Estimate::around(value, half)
}

/// A variant with an RMSE, the same over blocks, and a mean error.
pub(in crate::results) fn variant(design: &str, rmse: f64, blocks: f64, mean: f64) -> Record {
    let mut record = made_up::record("", design, 8, known(rmse));
    record.covered.mean = Estimate::around(mean, 0.1);
    record.covered.variance = Some(rmse * rmse - mean * mean);
    record.covered.bias_squared = Some(known(mean * mean));
    record.blocks = Some(known(blocks));
    record
}

/// A trial of two scenes, its variants from `each(design, scene)`: RMSE, blocks, mean.
pub(in crate::results) fn made_up(
    designs: &[&str],
    each: impl Fn(usize, usize) -> [f64; 3],
) -> Trial {
    let scene = |(i, name)| {
        let variant = |(d, design): (usize, &&str)| {
            let [rmse, blocks, mean] = each(d, i);
            variant(design, rmse, blocks, mean)
        };
        made_up::scene(name, designs.iter().enumerate().map(variant).collect())
    };
    let scenes = [(0, "a"), (1, "b")].map(scene).to_vec();
    Trial { samples: 8, side: 64, seeds: 4, antialiased: true, scenes }
}

#[test]
fn a_table_is_acceptable_without_noise_and_bias_and_not_with_either() {
    let trial = |noise: f64, mean: f64| {
        made_up(&TABLE, |d, _| if d == 1 { [10.0 * noise, 5.0, mean] } else { [10.0, 5.0, 0.0] })
    };
    let verdict = |with, without, mean| table_of_masks([&trial(with, mean), &trial(without, mean)]);
    assert_eq!(verdict(1.0, 1.0, 0.0).agreement, Agreement::Confirmed);
    // Noise with antialiasing alone: its masks are of whole pixels.
    let partly = verdict(1.21, 1.0, 0.0);
    assert_eq!(partly.agreement, Agreement::InPart);
    assert!(partly.measured.contains("1.21 in the geometric mean"), "{}", partly.measured);
    assert!(partly.remark.contains("on none of 2 scenes with"), "{}", partly.remark);
    assert_eq!(verdict(1.21, 1.21, 3.0).agreement, Agreement::Differs);
}

#[test]
fn the_cause_of_a_tables_noise_follows_from_the_ratios() {
    let list = |value| OnScenes(vec![("a".to_string(), known(value))]);
    let of = |with, without, larger| cause(&list(with), &list(without), &list(larger));
    assert!(of(1.21, 1.0, 1.0).contains("masks are of whole pixels"));
    assert!(of(1.21, 1.0, 1.2).contains("its size is what"));
    assert!(of(1.21, 1.2, 1.0).contains("as noisy"));
    assert!(of(1.0, 1.0, 1.0).contains("neither"));
}

#[test]
fn dither_pays_where_less_is_left_over_blocks() {
    let trial = |blocks: f64, noise: f64| {
        made_up(&DITHERED, |d, _| {
            if d == 0 { [10.0, 5.0, 0.0] } else { [10.0 * noise, 5.0 * blocks, 0.0] }
        })
    };
    assert_eq!(dithered(&trial(0.5, 1.0)).agreement, Agreement::Confirmed);
    assert_eq!(dithered(&trial(1.0, 1.0)).agreement, Agreement::Differs);
    let worse = dithered(&trial(1.1, 1.1));
    assert_eq!(worse.agreement, Agreement::Differs);
    assert!(worse.remark.contains("noisier") && worse.remark.contains("on some scenes"));
}

#[test]
fn rounds_together_are_confirmed_unless_they_are_worse() {
    let designs: Vec<&str> = STRATIFIED.into_iter().flatten().collect();
    let trial = |together: f64| {
        made_up(&designs, |d, scene| {
            let worse = d % 2 == 1 && (scene == 0 || together > 1.1);
            [if worse { 4.0 * together } else { 4.0 }, 1.0, 0.0]
        })
    };
    assert_eq!(rounds_together(&trial(0.9)).agreement, Agreement::Confirmed);
    let partly = rounds_together(&trial(1.05));
    assert_eq!(partly.agreement, Agreement::InPart);
    assert!(partly.remark.contains("on 1 of 2 scenes (not on `a`)"), "{}", partly.remark);
    assert_eq!(rounds_together(&trial(1.16)).agreement, Agreement::Differs);
}

#[test]
fn rounds_of_hashing_suffice_without_noise_blocks_and_bias() {
    // The first rounds are worse in one way each; `flaw` is of how many rounds.
    let trial = |flawed: usize, noise: f64, blocks: f64, mean: f64| {
        made_up(&HASH_ROUNDS, |d, _| {
            if d < flawed { [8.0 * noise, 2.0 * blocks, mean] } else { [8.0, 2.0, 0.0] }
        })
    };
    for (noise, blocks, mean) in [(1.1, 1.0, 0.0), (1.0, 1.5, 0.0), (1.0, 1.0, 3.0)] {
        let found = rounds_of_hashing(&trial(2, noise, blocks, mean));
        assert_eq!(found.agreement, Agreement::Confirmed);
        assert!(found.remark.ends_with("The fewest that suffice on all: 3."), "{}", found.remark);
    }
    // One round is enough: not what is printed. Four rounds are biased: neither.
    assert_eq!(rounds_of_hashing(&trial(0, 1.0, 1.0, 0.0)).agreement, Agreement::InPart);
    let biased = rounds_of_hashing(&trial(4, 1.0, 1.0, 3.0));
    assert_eq!(biased.agreement, Agreement::InPart);
    assert!(biased.remark.ends_with("No number of them suffices on all."), "{}", biased.remark);
}
