//! LK table 1 on scenes that we have, and how its ratio depends on what is seen.

use serde::Serialize;

use crate::metrics::Estimate;
use crate::study::file::{SceneEntry, Study};
use crate::study::publications::Effort;
use crate::study::publications::experiment::{Frames, Lab, MeasuredScene, parse, studies};
use screendoor_scene::capture::Order;
use screendoor_trace::error::Result;

/// Sample counts of LK's table 1.
pub const COUNTS: [u32; 5] = [4, 8, 16, 32, 64];
/// The designs of our table: LK's own, the comparison as it describes it, and
/// sampling without any stratification.
pub const DESIGNS: [&str; 3] = ["lk", "enderton", "enderton:mask=naive"];

/// A scene of table 1: its name in the study file, where it comes from, and what it stands
/// beside.
const SCENES: [(&str, &str, Published); 4] = [
    ("cycloidal", "CAD motor, 376 520 triangles (trimesh repository, MIT)", Published::Motor),
    ("engine", "built-in", Published::Motor),
    (
        "drape",
        "multi-layer garment, 84 159 triangles, untextured (Codim-IPC repository, Apache-2.0)",
        Published::Cloth,
    ),
    ("cloth", "built-in", Published::Cloth),
];

/// Which column of the published table a scene stands beside.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub enum Published {
    /// White, untextured, α = 0.3.
    Motor,
    /// Textured, α = 0.4, triangles in random order.
    Cloth,
}

impl Published {
    /// RMSE of LK and of its comparison at [`COUNTS`] (LK table 1).
    pub fn rmse(self) -> [[f64; 2]; 5] {
        match self {
            Published::Motor => [[29.5, 36.3], [17.9, 25.3], [10.3, 17.2], [6.3, 12.1], [4.0, 8.7]],
            Published::Cloth => [[17.0, 19.3], [9.7, 12.3], [5.6, 8.4], [3.3, 5.8], [2.0, 4.1]],
        }
    }
}

/// Table 1 on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct Table1 {
    /// Where the scene comes from.
    pub origin: &'static str,
    /// What it stands beside.
    pub stands_for: Published,
    /// The scene with the runs of [`DESIGNS`].
    pub scene: MeasuredScene,
}

/// One way to see a scene, at 16 samples.
#[derive(Clone, Debug, Serialize)]
pub struct Variation {
    /// Which scene; a built-in one's name begins with `builtin:`.
    pub scene: String,
    /// What differs.
    #[serde(skip)]
    pub aspect: Aspect,
    /// How it is seen.
    pub what: String,
    /// Fragments per covered pixel.
    pub fragments_per_pixel: f64,
    /// Share of the covered pixels that an edge crosses.
    pub edge_share: f64,
    /// RMSE over the covered pixels of [`DESIGNS`].
    pub rmse: [Estimate; 3],
}

/// What a variation varies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Aspect {
    /// Nothing: the scene as the table has it, its triangles in this order.
    Nothing(Order),
    /// From where it is seen.
    Angle,
    /// The frame's side, in pixels.
    Size(u32),
    /// The order of the triangles.
    Order(Order),
    /// The colour behind.
    Background,
}

/// The study of the table. `brief` is without the scenes that need models.
pub(super) fn study_of(effort: Effort) -> Result<Study> {
    let study = parse(studies::TABLE_1)?.only(|scene| !effort.brief || scene.is_built_in());
    Ok(study.in_frames(Frames::new(effort.side, 64, effort.seeds)))
}

/// The table on every scene of its that is there, and which are not.
pub(super) fn tables(lab: &Lab<'_>, effort: Effort) -> Result<(Vec<Table1>, Vec<String>)> {
    let found = lab.measure(study_of(effort)?)?;
    let of_scene = |scene: MeasuredScene| {
        let (_, origin, stands_for) = SCENES.into_iter().find(|s| s.0 == scene.name)?;
        Some(Table1 { origin, stands_for, scene })
    };
    let scenes = found.scenes(|entry| entry.name.clone());
    Ok((scenes.into_iter().filter_map(of_scene).collect(), found.missing))
}

/// Every scene that there is, seen in several ways.
///
/// # Errors
/// As [`Lab`] measures.
pub(super) fn vary(lab: &Lab<'_>, effort: Effort) -> Result<Vec<Variation>> {
    let mut study =
        parse(studies::VIEWS)?.in_frames(Frames::new(effort.comparison_side, 32, effort.seeds));
    let mut ways = Vec::new();
    for entry in std::mem::take(&mut study.scenes) {
        for (i, way) in variations(&entry).into_iter().enumerate() {
            let name = format!("{}.{i}", entry.name);
            study.scenes.push(SceneEntry { name: name.clone(), ..way.entry.clone() });
            ways.push((name, entry.title(), way));
        }
    }
    let samples = study.samples[0];
    let results = lab.measure(study)?.results;
    let of_way = |(name, scene, way): (String, String, Way)| {
        let runs = DESIGNS.map(|design| results.record(&name, design, samples));
        let first = runs[0]?;
        let covered = first.covered.pixels.max(1) as f64;
        Some(Variation {
            scene,
            aspect: way.aspect,
            what: way.what,
            fragments_per_pixel: first.fragments as f64 / covered,
            edge_share: first.edges.pixels as f64 / covered,
            rmse: [first, runs[1]?, runs[2]?].map(|r| r.covered.rmse),
        })
    };
    Ok(ways.into_iter().filter_map(of_way).collect())
}

/// One way to see a scene.
struct Way {
    aspect: Aspect,
    what: String,
    entry: SceneEntry,
}

/// Other ways to see a scene: angles, sizes, orders, backgrounds.
fn variations(base: &SceneEntry) -> Vec<Way> {
    let mut list = Vec::new();
    let mut add = |aspect, what: &str, entry| {
        list.push(Way { aspect, what: what.to_string(), entry });
    };
    let side = base.frame()[0];
    add(Aspect::Nothing(base.order), &format!("{side}×{side} pixels, its order"), base.clone());
    for yaw in [120.0, 210.0, 300.0] {
        let angle = Some([yaw, 20.0]);
        add(Aspect::Angle, &format!("from {yaw}°"), SceneEntry { angle, ..base.clone() });
    }
    for side in [side * 2, side / 2] {
        let entry = SceneEntry { size: Some([side, side]), ..base.clone() };
        add(Aspect::Size(side), &format!("{side}×{side} pixels"), entry);
    }
    for (what, order) in [
        ("triangles in API order", Order::Api),
        ("triangles in random order", Order::Random),
        ("near to far", Order::NearToFar),
        ("far to near", Order::FarToNear),
    ] {
        if order != base.order {
            add(Aspect::Order(order), what, SceneEntry { order, ..base.clone() });
        }
    }
    let white = SceneEntry { background: Some([1.0; 3]), ..base.clone() };
    add(Aspect::Background, "white background", white);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_study_files_are_those_of_the_table() {
        let study = parse(studies::TABLE_1).unwrap();
        assert_eq!(
            (study.samples.as_slice(), study.designs),
            (&COUNTS[..], DESIGNS.map(String::from).to_vec())
        );
        let names: Vec<&str> = study.scenes.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, SCENES.map(|(name, ..)| name));
        let views = parse(studies::VIEWS).unwrap();
        assert_eq!(views.designs, DESIGNS);
        // Every order but its own, three angles, two sizes, white, and itself.
        let ways: Vec<usize> = views.scenes.iter().map(|s| variations(s).len()).collect();
        assert!(ways.iter().all(|n| *n == 10), "{ways:?}");
    }
}
