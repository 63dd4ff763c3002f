//! Hairs grown from the scalp, gathered into wavy locks.

use std::f32::consts::TAU;

use glam::{Vec3, Vec4};

use super::head::{NECK, NECK_HALF, SHOULDERS, SHOULDERS_HALF, SKULL, hairline};
use crate::scene::Strands;
use crate::scene::builtin::noise::{smooth, vector};
use screendoor_trace::random::Stream;

/// How many locks the hairs gather into.
const LOCKS: u32 = 260;
/// Where the hair parts, to the left of the middle.
const PARTING: f32 = -0.16;

/// `count` hairs of `points` points each and one `width`.
pub(super) fn hair(count: u32, points: usize, width: f32, seed: u32, material: usize) -> Strands {
    let locks: Vec<Lock> = (0..LOCKS).map(|i| Lock::new(i, points, seed)).collect();
    let mut strands = Strands { starts: vec![0], material, ..Strands::default() };
    for i in 0..count {
        let mut random = Stream::new([0x4a12, seed, i]);
        let root = root(&mut random);
        let lock = locks.iter().min_by(|a, b| a.away(root).total_cmp(&b.away(root)));
        let lock = lock.expect("there are locks");
        let own = grow(
            root,
            random.range(0.03, 0.16),
            lock.length * random.range(0.86, 1.0),
            points,
            seed,
        );
        let gather = random.range(0.55, 0.95);
        // Where in the lock's cross-section the hair runs.
        let aside =
            Vec3::new(random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(-1.0, 1.0));
        for (k, (own, guide)) in own.iter().zip(&lock.points).enumerate() {
            let along = k as f32 / (points - 1) as f32;
            // A lock does not hold hairs that have fallen elsewhere.
            let near = smooth(0.55, 0.25, own.distance(*guide));
            let share = gather * near * smooth(0.05, 0.75, along);
            let spread = aside * (0.075 * smooth(0.1, 0.5, along) * (1.0 - 0.5 * along));
            let wave = lock.wave(along) * smooth(0.12, 0.7, along);
            strands.points.push(own.lerp(*guide + spread, share) + wave);
            // Thinner towards the tip.
            strands.radii.push(0.5 * width * (1.0 - 0.55 * smooth(0.6, 1.0, along)));
        }
        strands.starts.push(strands.points.len() as u32);
        strands.colours.push(lock.colour(&mut random));
    }
    strands
}

/// A lock's middle hair, and what its hairs share.
struct Lock {
    root: Vec3,
    points: Vec<Vec3>,
    length: f32,
    phase: f32,
    waves: f32,
    tone: f32,
}

impl Lock {
    fn new(i: u32, points: usize, seed: u32) -> Self {
        let mut random = Stream::new([0x10c5, seed, i]);
        let root = root(&mut random);
        let length = random.range(2.5, 3.0);
        Lock {
            root,
            points: grow(root, random.range(0.05, 0.16), length, points, seed),
            length,
            // Neighbours wave nearly together.
            phase: 1.5 * vector(seed, root * 1.3).x + random.range(-0.12, 0.12),
            waves: random.range(2.0, 2.8),
            tone: random.unit(),
        }
    }

    /// How far a hair's root is from this lock's; the parting keeps them apart.
    fn away(&self, root: Vec3) -> f32 {
        let across = if side(root) == side(self.root) { 0.0 } else { 2.0 * parted(root) };
        self.root.distance(root) + across
    }

    /// How far a wave carries a hair aside, at a share of its length.
    fn wave(&self, along: f32) -> Vec3 {
        let (sin, cos) = libm::sincosf(TAU * (self.phase + self.waves * along));
        Vec3::new(sin, 0.0, cos) * (0.045 + 0.03 * along)
    }

    /// Chestnut, from dark to light, with single hairs that differ.
    fn colour(&self, random: &mut Stream) -> Vec4 {
        let tone = (0.7 * self.tone + 0.3 * random.unit()).clamp(0.0, 1.0);
        let dark = Vec3::new(0.070, 0.022, 0.010);
        let light = Vec3::new(0.52, 0.235, 0.085);
        let colour = dark.lerp(light, tone * tone);
        (colour * random.range(0.8, 1.2)).extend(1.0)
    }
}

/// On which side of the parting a root is: 1 or −1.
fn side(root: Vec3) -> f32 {
    if root.x > PARTING { 1.0 } else { -1.0 }
}

/// How much the parting matters at a root: not at all on the back of the head.
fn parted(root: Vec3) -> f32 {
    smooth(-0.1, 0.45, root.z)
}

/// A random point of the scalp.
fn root(random: &mut Stream) -> Vec3 {
    loop {
        let mut side = || random.range(-1.0, 1.0);
        let d = Vec3::new(side(), side(), side());
        let direction = d.normalize_or(Vec3::Y);
        if (0.01..=1.0).contains(&d.length_squared()) && direction.y > hairline(direction) {
            return direction * SKULL;
        }
    }
}

/// A hair from its root: combed away from the parting, then falling over the head
/// and the shoulders at a distance of up to `lift`.
fn grow(root: Vec3, lift: f32, length: f32, points: usize, seed: u32) -> Vec<Vec3> {
    // Finer steps than the hair's own keep it outside of what it falls over.
    const FINE: usize = 4;
    let steps = (points - 1) * FINE;
    let step = length / steps as f32;
    let out = (root / (SKULL * SKULL)).normalize_or(Vec3::Y);
    let aside = side(root) * parted(root) + 0.5 * root.x * (1.0 - parted(root));
    let combed = Vec3::new(aside, 0.0, -0.35 - 0.5 * root.z.max(0.0));
    let mut heading = (combed - out * (combed.dot(out) - 0.15)).normalize_or(out);
    let mut p = root;
    let mut hair = Vec::with_capacity(points);
    for k in 0..=steps {
        if k % FINE == 0 {
            hair.push(p);
        }
        let stray = vector(seed ^ 0x51, p * 1.7) * 0.45;
        heading = (heading + (Vec3::NEG_Y * 2.8 + stray) * step).normalize_or(Vec3::NEG_Y);
        let free = p + heading * step;
        // Never so low that a straight piece would cut through the scalp.
        let lift = 0.02 + lift * smooth(0.0, 0.25, k as f32 / steps as f32);
        let held = outside(free, Vec3::ZERO, SKULL, lift);
        let held = outside(held, NECK, NECK_HALF, 0.0);
        let held = beside_face(outside(held, SHOULDERS, SHOULDERS_HALF, lift * 0.5), root);
        if held != free {
            heading = (held - p).normalize_or(heading);
        }
        p = held;
    }
    hair
}

/// The point itself, or where it is `lift` above an ellipsoid that holds it.
fn outside(p: Vec3, middle: Vec3, half: Vec3, lift: f32) -> Vec3 {
    let scaled = (p - middle) / (half + lift);
    let distance = scaled.length();
    if distance >= 1.0 { p } else { middle + scaled / distance.max(1e-6) * (half + lift) }
}

/// The point itself, or where it hangs beside the face: a parted hair on its own
/// side, others where they are.
fn beside_face(p: Vec3, root: Vec3) -> Vec3 {
    const MIDDLE: Vec3 = Vec3::new(0.0, -0.50, 0.75);
    const HALF: Vec3 = Vec3::new(0.80, 1.20, 1.0);
    let scaled = (p - MIDDLE) / HALF;
    let room = 1.0 - scaled.y * scaled.y - scaled.z * scaled.z;
    let reach = HALF.x * room.max(0.0).sqrt();
    let side = if parted(root) > 0.5 { side(root) } else { 1.0_f32.copysign(p.x) };
    if p.x * side < reach { Vec3::new(reach * side, p.y, p.z) } else { p }
}
