//! The bust that carries the hair.

use glam::{Vec2, Vec3, Vec4};

use crate::scene::builtin::noise::smooth;
use crate::scene::builtin::outlines::{curve, direction};
use crate::scene::builtin::shapes::Solid;

/// Half-extents of the skull around the origin; the face looks along +z.
pub(super) const SKULL: Vec3 = Vec3::new(0.74, 0.98, 0.88);
/// The middle of the neck, and its half-extents.
pub(super) const NECK: Vec3 = Vec3::new(0.0, -1.35, -0.12);
pub(super) const NECK_HALF: Vec3 = Vec3::new(0.44, 1.0, 0.44);
/// The middle of the shoulders, and their half-extents.
pub(super) const SHOULDERS: Vec3 = Vec3::new(0.0, -2.30, -0.12);
pub(super) const SHOULDERS_HALF: Vec3 = Vec3::new(1.38, 0.50, 0.55);

const SIDES: usize = 120;
const RINGS: usize = 90;

/// Head, neck and shoulders.
pub(super) fn bust() -> Solid {
    ball(face).and(torso())
}

/// How high hair begins in a direction from the skull's middle: from the forehead
/// over the ears down to the nape.
pub(super) fn hairline(direction: Vec3) -> f32 {
    0.10 + 0.62 * direction.z - 0.25 * direction.x.abs()
}

/// The bust's colour at a point: the scalp is as dark as the hair's shade.
pub(super) fn colour(p: Vec3) -> Vec4 {
    let d = (p / SKULL).normalize_or(Vec3::Y);
    let hairy = smooth(0.02, 0.16, d.y - hairline(d)) * smooth(-1.1, -0.9, p.y);
    Vec3::new(0.62, 0.57, 0.52).lerp(Vec3::new(0.12, 0.05, 0.025), hairy).extend(1.0)
}

/// A ball whose surface is where `place` puts each direction.
fn ball(place: impl Fn(Vec3) -> Vec3) -> Solid {
    let rings: Vec<Vec<Vec3>> = (0..=RINGS)
        .map(|ring| {
            // Down to up: counter-clockwise rings seen from the next.
            let turn = direction(ring as f32 / RINGS as f32 * 0.5 - 0.25);
            let radius = if ring == 0 || ring == RINGS { 0.0 } else { turn.x };
            let point = |side: usize| {
                let around = direction(side as f32 / SIDES as f32) * radius;
                place(Vec3::new(around.x, turn.y, -around.y))
            };
            (0..SIDES).map(point).collect()
        })
        .collect();
    Solid::loft(&rings, false)
}

/// A face's surface in a direction: the jaw narrows, with a nose, a brow and
/// hollow eyes.
fn face(d: Vec3) -> Vec3 {
    let jaw = smooth(0.1, -0.95, d.y);
    let mut p = d * SKULL;
    p.x *= 1.0 - 0.34 * jaw;
    p.z += jaw * 0.10 * smooth(-0.3, 0.9, d.z) - jaw * 0.22 * smooth(0.2, -0.8, d.z);
    p.y -= 0.10 * jaw * smooth(0.0, 0.9, d.z);
    // A soft bump of a size around a point of the face.
    let bump = |x: f32, y: f32, wide: f32, tall: f32| {
        let (x, y) = ((d.x.abs() - x) / wide, (d.y - y) / tall);
        smooth(1.0, 0.0, (x * x + y * y).sqrt()) * smooth(0.0, 0.3, d.z)
    };
    let nose = bump(0.0, -0.20, 0.19, 0.34) + 0.5 * bump(0.0, -0.32, 0.24, 0.18);
    let eyes = bump(0.36, 0.02, 0.34, 0.26);
    let lips = bump(0.0, -0.62, 0.34, 0.16);
    let chin = bump(0.0, -0.90, 0.40, 0.18);
    p.z += 0.18 * nose - 0.10 * eyes + 0.05 * lips + 0.06 * chin;
    p
}

/// Neck, shoulders and chest, from below: height, half-width, half-depth.
const TORSO: [[f32; 3]; 14] = [
    [-2.80, 0.0, 0.0],
    [-2.80, 0.60, 0.24],
    [-2.80, 0.98, 0.38],
    [-2.76, 1.05, 0.43],
    [-2.55, 1.20, 0.50],
    [-2.30, 1.32, 0.53],
    [-2.10, 1.33, 0.50],
    [-1.95, 1.20, 0.46],
    [-1.82, 0.86, 0.44],
    [-1.72, 0.60, 0.41],
    [-1.60, 0.44, 0.39],
    [-1.40, 0.37, 0.37],
    [-1.10, 0.35, 0.36],
    [-0.50, 0.36, 0.36],
];

fn torso() -> Solid {
    let sections = curve(&TORSO.map(Vec3::from_array), 4);
    let ring = |section: &Vec3| {
        let point = |side: usize| {
            let around = direction(side as f32 / SIDES as f32) * Vec2::new(section.y, -section.z);
            Vec3::new(around.x, section.x, around.y - 0.12)
        };
        (0..SIDES).map(point).collect()
    };
    Solid::loft(&sections.iter().map(ring).collect::<Vec<_>>(), false)
}
