//! Patterns of cloth, each one repeat of it.

use glam::{Vec2, Vec3, Vec4};

use crate::scene::Texture;

const SIDE: u32 = 256;

/// A pattern: its colour at a point of the unit square.
type Pattern = fn(Vec2) -> Vec3;

/// The patterns and how often each repeats along a sheet's side.
const FABRICS: [(Pattern, f32); 8] = [
    (tartan, 5.0),
    (dots, 9.0),
    (stripes, 8.0),
    (diamonds, 7.0),
    (gingham, 12.0),
    (basket, 14.0),
    (zigzag, 9.0),
    (rings, 6.0),
];

/// Fabric `index` as a texture, and how often it repeats along a sheet's side.
pub(super) fn fabric(index: usize) -> (Texture, f32) {
    let (pattern, repeats) = FABRICS[index % FABRICS.len()];
    // Four points of each texel, so that edges at an angle are not jagged.
    let texture = Texture::from_fn(SIDE, SIDE, |x, y| {
        let at = |dx: f32, dy: f32| {
            pattern((Vec2::new(x as f32, y as f32) + Vec2::new(dx, dy)) / SIDE as f32)
        };
        let sum = at(0.25, 0.25) + at(0.75, 0.25) + at(0.25, 0.75) + at(0.75, 0.75);
        Vec4::from((sum * 0.25, 1.0))
    });
    (texture, repeats)
}

const WHITE: Vec3 = Vec3::new(0.86, 0.85, 0.82);
const RED: Vec3 = Vec3::new(0.62, 0.03, 0.04);
const NAVY: Vec3 = Vec3::new(0.02, 0.05, 0.20);
const GREEN: Vec3 = Vec3::new(0.02, 0.20, 0.09);
const GOLD: Vec3 = Vec3::new(0.85, 0.52, 0.05);
const SKY: Vec3 = Vec3::new(0.16, 0.45, 0.80);
const ROSE: Vec3 = Vec3::new(0.85, 0.25, 0.35);
const TEAL: Vec3 = Vec3::new(0.02, 0.36, 0.38);

/// Warp or weft of a tartan: broad bands with thin lines.
fn sett(at: f32) -> Vec3 {
    let within = |low: f32, high: f32| (low..high).contains(&at);
    if within(0.05, 0.40) {
        RED
    } else if within(0.20, 0.23) || within(0.70, 0.73) {
        WHITE
    } else if within(0.47, 0.50) {
        GOLD
    } else if within(0.55, 0.88) {
        GREEN
    } else {
        NAVY
    }
}

fn tartan(p: Vec2) -> Vec3 {
    // In a twill, warp and weft show by turns along diagonals.
    let twill = ((p.x + p.y) * 32.0).fract();
    let share = if twill < 0.5 { 0.35 } else { 0.65 };
    sett(p.x).lerp(sett(p.y), share)
}

fn dots(p: Vec2) -> Vec3 {
    let near = |centre: Vec2| p.distance(centre) < 0.17;
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE, Vec2::splat(0.5)];
    if corners.into_iter().any(near) { WHITE } else { SKY }
}

fn stripes(p: Vec2) -> Vec3 {
    match (p.x * 16.0) as u32 {
        0..6 => WHITE,
        6 | 9 => NAVY,
        10..15 => WHITE * 0.96,
        _ => ROSE,
    }
}

fn diamonds(p: Vec2) -> Vec3 {
    let q = (p - 0.5).abs();
    let thin = ((p.x - p.y).abs() - 0.5).abs().min((p.x + p.y - 1.0).abs()).min((p.x - p.y).abs());
    match q.x + q.y {
        _ if thin < 0.012 => WHITE,
        reach if reach < 0.5 => GOLD,
        _ => TEAL,
    }
}

fn gingham(p: Vec2) -> Vec3 {
    let dark = u32::from(p.x < 0.5) + u32::from(p.y < 0.5);
    WHITE.lerp(RED, dark as f32 * 0.5)
}

fn basket(p: Vec2) -> Vec3 {
    let over = (p.x < 0.5) == (p.y < 0.5);
    let q = (p * 2.0).fract();
    let across = if over { q.y } else { q.x };
    // Three threads side by side, each round.
    let thread = (across * 3.0).fract() - 0.5;
    let colour = if over { GOLD.lerp(WHITE, 0.4) } else { GREEN.lerp(WHITE, 0.25) };
    colour * (1.0 - 1.8 * thread * thread)
}

fn zigzag(p: Vec2) -> Vec3 {
    let bend = (p.x - 0.5).abs();
    if (p.y + bend).fract() < 0.5 { TEAL } else { WHITE }
}

fn rings(p: Vec2) -> Vec3 {
    match p.distance(Vec2::splat(0.5)) {
        d if d < 0.14 => ROSE,
        d if d < 0.26 => WHITE,
        d if d < 0.38 => NAVY,
        _ => WHITE,
    }
}
