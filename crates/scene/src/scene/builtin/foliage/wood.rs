//! The trunk and its branches.

use glam::{Vec3, Vec4};

use super::Twig;
use crate::scene::builtin::noise::fractal;
use crate::scene::builtin::outlines::{circle, direction};
use crate::scene::builtin::shapes::Solid;
use screendoor_trace::random::Stream;

/// A tree without its leaves.
pub(super) struct Tree {
    pub solid: Solid,
    pub twigs: Vec<Twig>,
}

/// The kinds of branches from the trunk on: how many each bears, how much shorter
/// they are, pieces and sides of their tubes.
const LEVELS: [Level; 4] = [
    Level { bears: 11, shorter: 0.62, pieces: 36, sides: 28 },
    Level { bears: 7, shorter: 0.55, pieces: 12, sides: 10 },
    Level { bears: 6, shorter: 0.55, pieces: 5, sides: 6 },
    Level { bears: 0, shorter: 0.0, pieces: 4, sides: 4 },
];

struct Level {
    bears: u32,
    shorter: f32,
    pieces: usize,
    sides: usize,
}

/// A branch to be grown.
struct Bud {
    level: usize,
    from: Vec3,
    heading: Vec3,
    length: f32,
    radius: f32,
}

/// Grows a tree from the origin.
pub(super) fn grow(seed: u32) -> Tree {
    let mut tree = Tree { solid: Solid::default(), twigs: Vec::new() };
    let mut random = Stream::new([0x7eee, seed]);
    let trunk = Bud { level: 0, from: Vec3::ZERO, heading: Vec3::Y, length: 2.6, radius: 0.13 };
    branch(&trunk, &mut random, &mut tree);
    tree
}

fn branch(bud: &Bud, random: &mut Stream, tree: &mut Tree) {
    let level = &LEVELS[bud.level];
    let path = path(bud, level.pieces, random);
    let radius = |i: usize| {
        let along = i as f32 / level.pieces as f32;
        // The trunk's foot spreads.
        let foot = if bud.level == 0 { 0.5 * (1.0 - along * 8.0).max(0.0) } else { 0.0 };
        bud.radius * (1.0 - 0.8 * along + foot)
    };
    let section = |i: usize| circle(level.sides, radius(i));
    let tube = Solid::sweep(&path, false, Vec3::X, section);
    tree.solid = std::mem::take(&mut tree.solid).and(tube);
    if bud.level + 2 >= LEVELS.len() {
        tree.twigs.extend(path.windows(2).skip(1).map(|p| Twig { from: p[0], to: p[1] }));
    }
    let around = random.unit();
    for i in 0..level.bears {
        // From a third of the way to the tip, each turned by the golden angle.
        let along = 0.32 + 0.68 * (i as f32 + 0.5 * random.unit()) / level.bears as f32;
        let at = along * level.pieces as f32;
        let piece = (at as usize).min(level.pieces - 1);
        let parent = (path[piece + 1] - path[piece]).normalize_or(Vec3::Y);
        let turn = direction(around + 0.381_966 * i as f32 + random.range(-0.05, 0.05));
        let x = parent.any_orthonormal_vector();
        let aside = x * turn.x + parent.cross(x) * turn.y;
        let lean = 0.45 + 0.5 * along * along;
        let heading = (aside + parent * lean).normalize_or(aside);
        let reach = if bud.level == 0 { 1.15 - 0.75 * along * along } else { 1.1 - 0.5 * along };
        branch(
            &Bud {
                level: bud.level + 1,
                from: path[piece].lerp(path[piece + 1], at - piece as f32),
                heading,
                length: bud.length * level.shorter * reach * random.range(0.8, 1.15),
                radius: radius(piece) * 0.55,
            },
            random,
            tree,
        );
    }
}

/// A branch's middle line: it wanders and turns towards the light.
fn path(bud: &Bud, pieces: usize, random: &mut Stream) -> Vec<Vec3> {
    let step = bud.length / pieces as f32;
    let wander = if bud.level == 0 { 0.03 } else { 0.16 };
    let mut heading = bud.heading;
    let mut path = vec![bud.from];
    for _ in 0..pieces {
        let mut aside = || random.range(-wander, wander);
        heading =
            (heading + Vec3::new(aside(), aside() + 0.45 * step, aside())).normalize_or(Vec3::Y);
        path.push(path[path.len() - 1] + heading * step);
    }
    path
}

/// Bark, lighter and darker along the grain.
pub(super) fn bark(seed: u32, p: Vec3) -> Vec4 {
    let grain = fractal(seed, p * Vec3::new(14.0, 3.0, 14.0), 3);
    Vec3::splat(0.85 + 0.6 * grain).extend(1.0)
}
