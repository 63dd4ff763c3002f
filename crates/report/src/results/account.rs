//! The account of where our LK table 1 differs from the paper's, and why.

use crate::document::{Section, code};
use crate::results::ratio;
use crate::results::ratios::{Holding, OnScenes, above, holding};
use crate::results::table_1::runs;
use screendoor_study::metrics::Estimate;
use screendoor_study::study::publications::{
    Aspect, COUNTS, Order, Publications, Published, Table1, Variation,
};

/// The account; what was not measured is left out.
pub(super) fn part(p: &Publications) -> Section {
    let mut part = Section::new("Where this differs from the paper, and why");
    let published: Vec<String> = [Published::Motor, Published::Cloth]
        .iter()
        .map(|column| {
            let rmse = column.rmse();
            let fall = |i: usize| rmse[0][i] / rmse[4][i];
            format!("{:.1} and {:.1}", fall(0), fall(1))
        })
        .collect();
    part.numbered(
        1,
        [format!(
            "**How the error falls.** From 4 to 64 samples the paper's error falls by {} (LK and \
             its comparison, MOTOR), {} (CLOTH). Ours:",
            published[0], published[1]
        )],
    );
    let falls = |table: &Table1| {
        let (few, many) = (runs(table, 4), runs(table, 64));
        let fall = |i: usize| few[i].covered.rmse.value / many[i].covered.rmse.value;
        let mut row = vec![table.scene.name.to_string()];
        row.extend((0..3).map(|i| format!("{:.1}", fall(i))));
        row
    };
    part.table(["error at 4 ÷ at 64", "lk", "enderton", "naive"], p.table_1.iter().map(falls));
    part.numbered(
        2,
        [format!(
            "**Whether the paper's comparison method stratifies.** N^−½, without stratification, \
             falls by {:.1} from 4 to 64 samples. `enderton` as the paper describes it (depth test \
             first, then ⌊αn+ξ⌋ of the n survivors) stratifies whole fragments. \
             The largest difference between the published ratio and ours over all counts:",
            f64::from(COUNTS[COUNTS.len() - 1] / COUNTS[0]).sqrt()
        )],
    );
    let mut nearer = Vec::new();
    let rows = p.table_1.iter().map(|table| {
        let mut worst = [0.0_f64; 2];
        for (n, [a, b]) in COUNTS.iter().zip(table.stands_for.rmse()) {
            let [lk, e, naive] = runs(table, *n).map(|r| r.fine.value);
            for (worst, other) in worst.iter_mut().zip([e, naive]) {
                *worst = worst.max((lk / other - a / b).abs());
            }
        }
        nearer.push((table.scene.name.as_str(), worst[1] < worst[0]));
        [table.scene.name.to_string(), format!("{:.2}", worst[0]), format!("{:.2}", worst[1])]
    });
    part.table(["scene", "lk ÷ enderton", "lk ÷ naive"], rows);
    part.paragraph(format!(
        "The published ratios lie nearer to `lk ÷ naive` than to `lk ÷ enderton` {}.",
        holding(nearer.into_iter()).words()
    ));
    if !p.variations.is_empty() {
        views(&mut part, p);
    }
    part
}

/// How edges, order, view and background change the ratio.
fn views(part: &mut Section, p: &Publications) {
    let (seen, side) = (&p.variations, p.effort.comparison_side);
    let order = |order| in_order(seen, order).words();
    let edges = format!(
        "**Edges.** Of a fragment that covers one sample or two `enderton` stratifies nothing; LK \
         stratifies over the surface. In smaller frames triangles stay and pixels grow. \
         `enderton` ÷ `naive` at {SAMPLES} samples is {} in frames of {} × {} pixels and {} in those \
         of {} × {}; it is greater in the smaller frame {}.",
        sized(seen, 2 * side, enderton_to_naive).range(),
        2 * side,
        2 * side,
        sized(seen, side / 2, enderton_to_naive).range(),
        side / 2,
        side / 2,
        more_in_small_frames(seen, side).words(),
    );
    let orders = format!(
        "**Order.** LK's tracking counts on a surface's fragments coming one after the other. \
         `lk` ÷ `enderton` at {SAMPLES} samples, {side} × {side} pixels: with the triangles near to \
         far {}; far to near {}; in random order {}; in the scenes' own {}. The paper's CLOTH is \
         in random order; its MOTOR's order is not stated.",
        order(Order::NearToFar),
        order(Order::FarToNear),
        order(Order::Random),
        order(Order::Api),
    );
    let views = format!(
        "**View and background.** From other angles and before white `lk` ÷ `enderton` changes \
         by {} at {side} × {side} pixels. Shading here is diffuse with a key and a fill light; the \
         paper does not describe its lights.",
        change_of_view(seen),
    );
    part.numbered(3, [edges, orders, views]);
    part.paragraph(format!(
        "At {SAMPLES} samples, against the exact picture of the same samples, {} seeds ([?]: too few \
         seeds for an interval):",
        p.effort.seeds
    ));
    let row = |v: &Variation| {
        let [lk, e, naive] = v.rmse;
        [
            v.scene.clone(),
            v.what.clone(),
            format!("{:.1}", v.fragments_per_pixel),
            format!("{:.0} %", 100.0 * v.edge_share),
            format!("{:.2}", lk.value),
            format!("{:.2}", e.value),
            format!("{:.2}", naive.value),
            ratio(lk, e),
            ratio(lk, naive),
        ]
    };
    let header = [
        "scene",
        "seen",
        "fragments/pixel",
        "edge pixels",
        "lk",
        "enderton",
        "naive",
        "lk ÷ enderton",
        "lk ÷ naive",
    ];
    part.table(header, seen.iter().map(row));
}

/// Samples of the variations.
const SAMPLES: u32 = 16;

fn lk_to_enderton(v: &Variation) -> Estimate {
    v.rmse[0].ratio(v.rmse[1])
}

fn enderton_to_naive(v: &Variation) -> Estimate {
    v.rmse[1].ratio(v.rmse[2])
}

/// A ratio of the designs' RMSE on the scenes that are seen in some way.
fn seen_as(
    seen: &[Variation],
    which: impl Fn(Aspect) -> bool,
    of: fn(&Variation) -> Estimate,
) -> OnScenes {
    let chosen = seen.iter().filter(|v| which(v.aspect));
    OnScenes(chosen.map(|v| (v.scene.clone(), of(v))).collect())
}

/// The same in frames of a size other than the rest has.
fn sized(seen: &[Variation], side: u32, of: fn(&Variation) -> Estimate) -> OnScenes {
    seen_as(seen, |aspect| aspect == Aspect::Size(side), of)
}

/// On which scenes `enderton` gains less on `naive` in frames of half the side than in those
/// of twice the side.
fn more_in_small_frames(seen: &[Variation], side: u32) -> Holding {
    let large = sized(seen, 2 * side, enderton_to_naive);
    let small = sized(seen, side / 2, enderton_to_naive);
    let pairs = large.0.iter().filter_map(|(name, large)| {
        let (_, small) = small.0.iter().find(|(other, _)| other == name)?;
        Some((name.as_str(), small.value > large.value))
    });
    holding(pairs)
}

/// `lk` ÷ `enderton` with the triangles in some order.
struct InOrder(OnScenes);

fn in_order(seen: &[Variation], order: Order) -> InOrder {
    let which = |a| [Aspect::Nothing(order), Aspect::Order(order)].contains(&a);
    InOrder(seen_as(seen, which, lk_to_enderton))
}

impl InOrder {
    /// The range, and on how many scenes `lk` has the smaller error, and on which the greater.
    fn words(&self) -> String {
        let InOrder(list) = self;
        if list.0.is_empty() {
            return "not measured".to_string();
        }
        let worse = list.holding(|e| !above(e, 1.0)).but;
        let worse = match worse.len() {
            0 => "above it on none".to_string(),
            n => format!("above it on {n}: {}", worse.join(", ")),
        };
        let (below, all) = (list.below(1.0), list.0.len());
        format!(
            "{}, below 1 by more than its interval on {below} of {all} scenes, {worse}",
            list.range()
        )
    }
}

/// The largest relative change of `lk ÷ enderton` with angle and background, and where.
fn change_of_view(seen: &[Variation]) -> String {
    let ratio = |v: &Variation| lk_to_enderton(v).value;
    let changes = seen.iter().filter_map(|v| {
        let base = |b: &&Variation| b.scene == v.scene && matches!(b.aspect, Aspect::Nothing(_));
        let base = seen.iter().find(base)?;
        let counts = matches!(v.aspect, Aspect::Angle | Aspect::Background);
        counts.then(|| ((ratio(v) / ratio(base) - 1.0).abs(), v))
    });
    let most = changes.max_by(|a, b| a.0.total_cmp(&b.0));
    most.map_or("an amount that was not measured".to_string(), |(change, v)| {
        format!("{:.0} % at most ({}, {})", 100.0 * change, code(&v.scene), v.what)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(scene: &'static str, aspect: Aspect, rmse: [f64; 3]) -> Variation {
        let known = |v: f64| Estimate { value: v, low: v * 0.999, high: v * 1.001 };
        Variation {
            scene: scene.to_string(),
            aspect,
            what: "made up".to_string(),
            fragments_per_pixel: 1.0,
            edge_share: 0.5,
            rmse: rmse.map(known),
        }
    }

    #[test]
    fn an_orders_rule_names_the_scenes_on_which_lk_is_worse() {
        let near = Aspect::Order(Order::NearToFar);
        let list = [
            seen("a", near, [0.8, 1.0, 2.0]),
            seen("b", near, [1.1, 1.0, 2.0]),
            seen("a", Aspect::Nothing(Order::Api), [0.5, 1.0, 2.0]),
        ];
        assert_eq!(
            in_order(&list, Order::NearToFar).words(),
            "0.80 (`a`) to 1.10 (`b`), below 1 by more than its interval on 1 of 2 scenes, above it \
             on 1: `b`"
        );
        let own = in_order(&list, Order::Api).words();
        assert!(own.ends_with("on 1 of 1 scenes, above it on none"), "{own}");
        assert_eq!(in_order(&list, Order::Random).words(), "not measured");
    }

    #[test]
    fn small_frames_and_other_views_are_held_against_the_scene_itself() {
        let list = [
            seen("a", Aspect::Nothing(Order::Api), [0.8, 1.0, 2.0]),
            seen("a", Aspect::Angle, [0.88, 1.0, 2.0]),
            seen("a", Aspect::Background, [0.8, 1.0, 2.0]),
            seen("a", Aspect::Size(256), [0.8, 1.0, 2.0]),
            seen("a", Aspect::Size(64), [0.8, 1.5, 2.0]),
            seen("b", Aspect::Size(256), [0.8, 1.0, 2.0]),
            seen("b", Aspect::Size(64), [0.8, 0.9, 2.0]),
        ];
        assert_eq!(more_in_small_frames(&list, 128).words(), "on 1 of 2 scenes (not on `b`)");
        assert!(
            change_of_view(&list).starts_with("10 % at most (`a`"),
            "{}",
            change_of_view(&list)
        );
    }
}
