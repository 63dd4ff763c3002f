//! The leaf cards and their texture.

use glam::{Vec2, Vec3, Vec4};

use super::Twig;
use crate::scene::builtin::noise::smooth;
use crate::scene::builtin::outlines::direction;
use crate::scene::{Mesh, Texture, Wrap};
use screendoor_trace::random::Stream;

/// Where the middle of the crown is: leaves within are in shade.
const CROWN: Vec3 = Vec3::new(0.0, 2.0, 0.0);
/// Pieces that a card is bent into.
const BENDS: usize = 3;

/// `count` cards along the twigs.
pub(super) fn cards(twigs: &[Twig], count: u32, seed: u32, material: usize) -> Mesh {
    let mut mesh = Mesh { material, ..Mesh::default() };
    for i in 0..count {
        let mut random = Stream::new([0x1eaf, seed, i]);
        let twig = &twigs[random.below(twigs.len() as u32) as usize];
        card(twig, &mut random, &mut mesh);
    }
    mesh
}

fn card(twig: &Twig, random: &mut Stream, mesh: &mut Mesh) {
    let foot = twig.from.lerp(twig.to, random.unit());
    let along = (twig.to - twig.from).normalize_or(Vec3::Y);
    let turn = direction(random.unit());
    let x = along.any_orthonormal_vector();
    let aside = x * turn.x + along.cross(x) * turn.y;
    let heading = (along * 0.7 + aside + Vec3::Y * 0.15).normalize_or(aside);
    // The upper side looks up and outwards, but not all alike.
    let mut tilt = || random.range(-0.6, 0.6);
    let upwards = Vec3::new(tilt(), 1.0 + tilt(), tilt()) + (foot - CROWN) * 0.5;
    let across = heading.cross(upwards).normalize_or(along.cross(heading));
    let up = across.cross(heading);

    let size = random.range(0.13, 0.21);
    let bend = random.range(0.05, 0.22);
    let colour = colour(foot, up, random);
    let first = mesh.positions.len() as u32;
    for i in 0..=BENDS {
        let t = i as f32 / BENDS as f32;
        // A parabola that droops towards the tip.
        let spine = foot + heading * (t * size) - up * (bend * size * t * t);
        for side in [-0.5, 0.5] {
            mesh.positions.push(spine + across * (side * size));
            mesh.uvs.push(Vec2::new(side + 0.5, 1.0 - t));
            mesh.colours.push(colour);
        }
    }
    for i in 0..BENDS as u32 {
        let [a, b, c, d] = [0, 1, 3, 2].map(|k| first + 2 * i + k);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
}

/// Greens from blueish to yellow in the light that gets there: leaves let much of
/// it through, so both sides are lit alike.
fn colour(at: Vec3, up: Vec3, random: &mut Stream) -> Vec4 {
    let sun = Vec3::new(0.48, 0.75, 0.46);
    let green = Vec3::new(0.75, 1.0, 0.8).lerp(Vec3::new(1.5, 1.15, 0.5), random.unit());
    let from_middle = at - CROWN;
    let open = smooth(0.3, 1.4, from_middle.length());
    let towards = 0.5 + 0.5 * from_middle.normalize_or(sun).dot(sun);
    let facing = 0.55 + 0.45 * up.dot(sun).abs();
    let light = 0.18 + 1.0 * open * towards * facing;
    (green * light * random.range(0.85, 1.15)).extend(1.0)
}

const SIDE: u32 = 512;

/// One leaf of the texture: where it begins, which way it points, its length.
struct Leaf {
    foot: Vec2,
    heading: Vec2,
    length: f32,
    tone: f32,
}

/// A sprig: leaves by turns on either side of a stem from the bottom up.
pub(super) fn paint(seed: u32) -> Texture {
    let mut random = Stream::new([0x5917, seed]);
    let mut leaves = Vec::new();
    const PAIRS: u32 = 4;
    for i in 0..PAIRS * 2 {
        let up = (i as f32 + 0.6) / (PAIRS * 2) as f32;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let lean = 0.25 - side * (0.155 - 0.06 * up + random.range(-0.015, 0.015));
        leaves.push(Leaf {
            foot: stem(0.08 + 0.62 * up),
            heading: direction(lean),
            length: 0.40 - 0.12 * up + random.range(-0.02, 0.02),
            tone: random.range(0.85, 1.15),
        });
    }
    leaves.push(Leaf { foot: stem(0.68), heading: direction(0.245), length: 0.31, tone: 1.0 });
    Texture::from_fn(SIDE, SIDE, |x, y| {
        let p = (Vec2::new(x as f32, y as f32) + 0.5) / SIDE as f32;
        let p = Vec2::new(p.x, 1.0 - p.y);
        let mut texel = twig(p);
        for leaf in &leaves {
            let over = leaf.colour(p);
            let alpha = over.w + texel.w * (1.0 - over.w);
            let mixed = over * over.w + texel * (texel.w * (1.0 - over.w));
            texel = if alpha > 0.0 { (mixed / alpha).truncate().extend(alpha) } else { over };
        }
        texel
    })
    .wrapped([Wrap::Clamp; 2])
}

/// A point of the stem.
fn stem(up: f32) -> Vec2 {
    Vec2::new(0.5 + 0.03 * (up - 0.3) * up, up)
}

fn twig(p: Vec2) -> Vec4 {
    let beside = (p.x - stem(p.y).x).abs();
    let alpha = smooth(0.009, 0.005, beside) * smooth(0.72, 0.70, p.y) * smooth(0.0, 0.01, p.y);
    Vec3::new(0.10, 0.09, 0.03).extend(alpha)
}

impl Leaf {
    /// Pointed, widest below its middle, with a light rib and fainter veins.
    fn colour(&self, p: Vec2) -> Vec4 {
        let from = p - self.foot;
        let along = from.dot(self.heading) / self.length;
        let across = from.perp_dot(self.heading).abs() / self.length;
        let t = along.clamp(0.0, 1.0);
        let half = 0.92 * t.sqrt() * (1.0 - t) * (0.75 + 0.25 * (1.0 - t));
        let inside = (half - across) * self.length * SIDE as f32;
        let alpha = if (0.0..=1.0).contains(&along) { smooth(-0.7, 0.7, inside) } else { 0.0 };
        let rib = smooth(0.022, 0.006, across);
        let vein_phase = ((along - across * 0.9) * 9.0).fract();
        let vein = smooth(0.16, 0.04, (vein_phase - 0.5).abs()) * smooth(0.0, 0.05, half - across);
        let green = Vec3::new(0.10, 0.29, 0.035) * self.tone;
        let light = Vec3::new(0.22, 0.42, 0.10);
        green.lerp(light, (0.6 * rib + 0.22 * vein).min(1.0)).extend(alpha)
    }
}
