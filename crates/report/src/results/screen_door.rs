//! Object-space screen-door transparency (2003).

use crate::document::{Against, Agreement, Section};
use crate::results::figures::show;
use crate::results::ratios::yes;
use screendoor_study::study::publications::screen_door::{
    ALPHA, ANGLES, BINS, ByAngle, DISTANCES, Layers, PARTS, ScreenDoors,
};

const SOURCE: &str = "Object-space screen-door transparency 2003";

/// Opacities that differ by less are the same: of 40,000 pixels, ten times what chance leaves.
const SAME: f64 = 0.025;

fn door<'a>(s: &'a ScreenDoors, name: &str) -> Option<&'a ByAngle> {
    s.angles.iter().find(|by| by.door == name)
}

/// The opacity of a screen door's square that faces the viewer, and turned by 75 degrees.
fn ends(s: &ScreenDoors, name: &str) -> [f64; 2] {
    let turned = ANGLES.iter().position(|angle| *angle == 75.0);
    door(s, name).map_or([f64::NAN; 2], |by| [by.square[0], by.square[turned.unwrap_or_default()]])
}

fn by_angle_against(s: &ScreenDoors) -> Against {
    let [points, mask, most] = ["points", "mask", "mask-max"].map(|name| ends(s, name));
    let ordered = s.ordered.iter().all(|(_, same)| *same);
    let cut = s.sizes.iter().find(|(door, _)| door == "mask").map(|(_, of)| of);
    let [whole, cut] = cut.map_or([f64::NAN; 2], |of| [of[0], of[of.len() - 1]]);
    let statements = [
        points[1] > points[0] + SAME,
        (mask[1] - mask[0]).abs() < SAME,
        most[1] > most[0] + SAME,
        ordered,
    ];
    let said = |[front, turned]: [f64; 2]| format!("{front:.3} to {turned:.3}");
    Against {
        section: "Object-space screen door".to_string(),
        source: format!("{SOURCE}, sections 3 and 5, figure 1"),
        printed: "Points that are spread evenly in object space make silhouettes more opaque; with masks \
                  and nearest lookup silhouettes are lost, and a max filter would bring them back; no order of \
                  drawing changes the picture."
            .to_string(),
        measured: format!(
            "Opacity of a square of α = {ALPHA} that faces the viewer to one that is turned by 75°: points {}, \
             mask {}, with the max filter {}.",
            said(points),
            said(mask),
            said(most)
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Points rise towards silhouettes: {}; masks do not: {}; with the max filter they do: {}; all \
             screen doors give the same fragments in another order: {}. Points keep α where a surface faces \
             the viewer if their even grid lies on the pixels; one that does not leaves some without a point: on the \
             ball up to {near}° {ball:.3} is opaque. \
             Masks keep it on large triangles alone: of a square in {triangles} triangles, which all begin at the \
             same texel, {cut:.3} is opaque in place of {whole:.3}.",
            yes(statements[0]),
            yes(statements[1]),
            yes(statements[2]),
            yes(statements[3]),
            near = BINS[1],
            ball = door(s, "points").map_or(f64::NAN, |by| by.ball[0]),
            triangles = 2 * PARTS[PARTS.len() - 1].pow(2),
        ),
    }
}

/// The section of opacity by angle.
pub(super) fn by_angle(s: &ScreenDoors) -> Option<Section> {
    let mut section = Section::answering(by_angle_against(s));
    show(&mut section, &s.pictures, &["screen-doors"]);
    section.paragraph(format!(
        "Share of the pixels that are opaque, of those that the surface covers: a square of α = {ALPHA}, seen \
         along parallel lines and turned by so many degrees, one sample a pixel; beside it the laws of evenly \
         spread points, 1 − (1 − α)^(1/cos θ), and of independent ones, 1 − e^(−α/cos θ)."
    ));
    let header = |first: &str, values: &mut dyn Iterator<Item = String>| -> Vec<String> {
        std::iter::once(first.to_string()).chain(values).collect()
    };
    let law = |name: &str, of: &dyn Fn(f64) -> f64| {
        let at = ANGLES.iter().map(|angle| of(angle.to_radians().cos()));
        row(name, at)
    };
    let mut rows: Vec<Vec<String>> = s
        .angles
        .iter()
        .map(|by| row(&format!("`{}`", by.door), by.square.iter().copied()))
        .collect();
    rows.push(law("evenly spread", &|cos| 1.0 - (1.0 - ALPHA).powf(1.0 / cos)));
    rows.push(law("independent", &|cos| 1.0 - (-ALPHA / cos).exp()));
    let angles = header("screen door", &mut ANGLES.iter().map(|angle| format!("{angle}°")));
    section.table(angles, rows);
    section.paragraph(
        "The same of a ball, by the angle between its surface and the way to the viewer.",
    );
    let bins = &mut BINS.windows(2).map(|bin| format!("{}° to {}°", bin[0], bin[1]));
    let rows = s.angles.iter().map(|by| row(&format!("`{}`", by.door), by.ball.iter().copied()));
    section.table(header("screen door", bins), rows.collect::<Vec<_>>());
    section.paragraph(
        "By the size of triangles: the square that faces the viewer, each side cut into so many parts.",
    );
    let rows = s.sizes.iter().map(|(door, of)| row(&format!("`{door}`"), of.iter().copied()));
    let parts = header("screen door", &mut PARTS.iter().map(|parts| format!("{parts}")));
    section.table(parts, rows.collect::<Vec<_>>());
    Some(section)
}

fn row(first: &str, values: impl Iterator<Item = f64>) -> Vec<String> {
    std::iter::once(first.to_string()).chain(values.map(|v| format!("{v:.3}"))).collect()
}

fn layers_of<'a>(s: &'a ScreenDoors, name: &str) -> Option<&'a Layers> {
    s.layers.iter().find(|layers| layers.door == name)
}

fn layers_against(s: &ScreenDoors) -> Against {
    let of = |name: &str| {
        layers_of(s, name).map_or([f64::NAN; 2], |layers| [layers.alike, layers.turned])
    };
    let [one, several, mask] = ["stipple", "stipple-random", "mask"].map(of);
    let right = 1.0 - (1.0 - ALPHA) * (1.0 - ALPHA);
    let is_right = |found: f64| (found - right).abs() < SAME;
    // Of eight patterns two polygons have the same one at times.
    let better = |found: f64| right - found < (right - ALPHA) / 4.0;
    let statements =
        [(one[1] - ALPHA).abs() < SAME, better(several[1]), is_right(mask[1]), is_right(mask[0])];
    Against {
        section: "One mask for an alpha".to_string(),
        source: format!("{SOURCE}, section 3.1"),
        printed: "In the image plane one mask for all objects of an alpha hides one behind the other, \
                  which a random choice among several avoids; in object space a single mask for each alpha \
                  does not face this problem."
            .to_string(),
        measured: format!(
            "Two squares of α = {ALPHA}, together {right} if independent: one stipple {:.3}, one of eight \
             {:.3}, a mask in object space {:.3} where one of them is turned by 20° and {:.3} where they are alike.",
            one[1], several[1], mask[1], mask[0]
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "One stipple hides what is behind: {}; one of eight nearly does not: {}; masks in object space do \
             not where surfaces differ: {}, nor where they are alike: {}: triangles of the same shape have \
             their masks in the same place.",
            yes(statements[0]),
            yes(statements[1]),
            yes(statements[2]),
            yes(statements[3])
        ),
    }
}

/// The section of layers.
pub(super) fn layers(s: &ScreenDoors) -> Option<Section> {
    let mut section = Section::answering(layers_against(s));
    section.paragraph(
        "Opacity of two squares that face the viewer, one behind the other, over 32 seeds: both alike, \
         and the farther one turned.",
    );
    let rows =
        s.layers.iter().map(|l| row(&format!("`{}`", l.door), [l.alike, l.turned].into_iter()));
    section.table(["screen door", "alike", "turned by 20°"], rows.collect::<Vec<_>>());
    Some(section)
}

fn distance_against(s: &ScreenDoors) -> Against {
    let of =
        |name: &str| s.distances.iter().find(|(door, _)| door == name).map(|(_, of)| of.clone());
    let [own, fixed] = ["points", "points-static"].map(|name| of(name).unwrap_or_default());
    let spread = |of: &[f64]| {
        of.iter().copied().fold(0.0, f64::max) - of.iter().copied().fold(1.0, f64::min)
    };
    let [near, far] = [fixed.first(), fixed.last()].map(|v| v.copied().unwrap_or_default());
    let statements = [near < far / 2.0, spread(&own) < 2.0 * SAME];
    Against {
        section: "Points by distance".to_string(),
        source: format!("{SOURCE}, sections 3.1 and 4.1.1"),
        printed: "A fixed number of points fails near the viewer; their number has to follow the distance."
            .to_string(),
        measured: format!(
            "From {} to {} radii the opacity of a square of α = {ALPHA} goes from {near:.3} to {far:.3} with a \
             fixed number, and differs by {:.3} at most where it follows the distance.",
            DISTANCES[0],
            DISTANCES[DISTANCES.len() - 1],
            spread(&own)
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "A fixed number leaves less than half near by: {}; one that follows the distance does not: {}.",
            yes(statements[0]),
            yes(statements[1])
        ),
    }
}

/// The section of distances.
pub(super) fn distances(s: &ScreenDoors) -> Option<Section> {
    let mut section = Section::answering(distance_against(s));
    section.paragraph(
        "Opacity of a square that faces the viewer, by their distance in radii of the scene.",
    );
    let header = std::iter::once("screen door".to_string());
    let header: Vec<String> = header.chain(DISTANCES.iter().map(f64::to_string)).collect();
    let rows = s.distances.iter().map(|(door, of)| row(&format!("`{door}`"), of.iter().copied()));
    section.table(header, rows.collect::<Vec<_>>());
    Some(section)
}
