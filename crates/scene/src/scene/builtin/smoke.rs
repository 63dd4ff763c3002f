//! A plume of smoke: soft puffs that face the camera, dozens deep (as in Laine and
//! Karras 2011, figure 8).

use glam::{Vec2, Vec3, Vec4};

use crate::scene::builtin::noise::{curl, fractal, smooth};
use crate::scene::builtin::{Builtin, SEED, seed};
use crate::scene::{AlphaMode, Material, Particles, Scene, Shape, Texture, TextureUse, View, Wrap};
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::{Stream, hash};

const PUFFS: Typed<i64> = Typed::integer("puffs", "1500", (1, 4000), "how many puffs");

pub(super) const SCENE: Builtin = Builtin {
    name: "smoke",
    summary: "a plume of soft puffs that face the camera, dozens of layers, alpha 0.05 at most",
    params: &[PUFFS.param, SEED.param],
    build,
};

/// No puff is more opaque than this anywhere.
const ALPHA: f32 = 0.05;
/// How many different puffs are painted.
const VARIANTS: u32 = 4;
/// The oldest puff's age.
const LIFE: f32 = 3.2;
const TEXTURE_SIDE: u32 = 256;

fn build(values: &Values) -> Scene {
    let seed = seed(values);
    let mut scene = Scene {
        view: View { yaw: 0.0, pitch: 8.0, background: [0.02, 0.035, 0.06], ..View::default() },
        ..Scene::default()
    };
    let puffs: Vec<Puff> = (0..values.get(PUFFS) as u32).map(|i| puff(i, values, seed)).collect();
    let colours = shade(&puffs);
    for variant in 0..VARIANTS {
        scene.textures.push(paint(hash([seed, variant])));
        scene.materials.push(Material {
            name: "smoke".into(),
            base: Vec4::new(1.0, 1.0, 1.0, ALPHA),
            base_texture: Some(TextureUse::plain(variant as usize)),
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..Material::default()
        });
        let mut particles = Particles { material: variant as usize, ..Particles::default() };
        let own = puffs.iter().zip(&colours).filter(|(p, _)| p.variant == variant);
        for (puff, colour) in own {
            particles.centres.push(puff.centre);
            particles.sizes.push(puff.size);
            particles.angles.push(puff.angle);
            particles.colours.push(*colour);
        }
        if !particles.centres.is_empty() {
            scene.add(format!("puffs {}", variant + 1), Shape::Particles(particles));
        }
    }
    scene
}

/// One puff.
struct Puff {
    centre: Vec3,
    size: f32,
    angle: f32,
    variant: u32,
}

/// Puff `i`: it left the source some time ago and has drifted with the air since.
fn puff(i: u32, values: &Values, seed: u32) -> Puff {
    const STEPS: u32 = 40;
    let mut random = Stream::new([0x5a0e, seed, i]);
    let age = (i as f32 + random.unit()) / values.get(PUFFS) as f32;
    // More are old than young: they fill a wider plume.
    let age = libm::powf(age, 0.7);
    let mut centre = 0.10 * in_ball(&mut random);
    // What eddies too small to follow have done to it.
    let strewn = in_ball(&mut random) * (0.12 + 0.55 * age);
    for step in 0..STEPS {
        let left = age * (1.0 - step as f32 / STEPS as f32);
        centre += (air(seed, centre, left * LIFE) + strewn / LIFE) * (age * LIFE / STEPS as f32);
    }
    Puff {
        centre,
        size: 0.06 + 0.26 * age * random.range(0.6, 1.4),
        angle: random.range(0.0, std::f32::consts::TAU),
        variant: random.below(VARIANTS),
    }
}

/// A random point of the unit ball.
fn in_ball(random: &mut Stream) -> Vec3 {
    loop {
        let mut side = || random.range(-1.0, 1.0);
        let p = Vec3::new(side(), side(), side());
        if p.length_squared() <= 1.0 {
            return p;
        }
    }
}

/// The air's velocity some time before now: upwards and, higher up, aside and in
/// eddies that rise with it.
fn air(seed: u32, p: Vec3, ago: f32) -> Vec3 {
    let high = smooth(0.0, 3.0, p.y);
    let rise = Vec3::Y * (1.3 - 0.5 * high);
    let now = p + Vec3::Y * ago;
    let large = curl(hash([seed, 1]), now * 1.0) * (0.06 + 0.13 * high);
    let small = curl(hash([seed, 2]), now * 2.4) * (0.04 + 0.08 * high);
    rise + Vec3::new(0.40, 0.0, 0.1) * high + large + small
}

/// The puffs' colours: lit from the upper right, where the smoke between a puff
/// and the light takes its share.
fn shade(puffs: &[Puff]) -> Vec<Vec4> {
    let light = Vec3::new(0.62, 0.70, 0.35).normalize();
    let (lit, dark) = (Vec3::new(1.0, 0.97, 0.92), Vec3::new(0.14, 0.16, 0.20));
    let between = |from: &Puff, other: &Puff| {
        let way = other.centre - from.centre;
        let ahead = way.dot(light);
        let aside = (way - light * ahead).length_squared() / (other.size * other.size);
        let cover = (1.0 - aside).max(0.0);
        cover * cover * smooth(0.0, other.size, ahead)
    };
    let colour = |puff: &Puff| {
        let depth: f32 = puffs.iter().map(|other| between(puff, other)).sum();
        dark.lerp(lit, libm::expf(-0.08 * depth)).extend(1.0)
    };
    puffs.iter().map(colour).collect()
}

/// A puff that fades to nothing before its square's edge.
fn paint(seed: u32) -> Texture {
    Texture::from_fn(TEXTURE_SIDE, TEXTURE_SIDE, |x, y| {
        let p = (Vec2::new(x as f32, y as f32) + 0.5) / (TEXTURE_SIDE as f32 * 0.5) - 1.0;
        let ragged = p.length() + 0.45 * fractal(seed, (p * 2.4).extend(0.5), 5);
        let wisps = 0.7 + 0.3 * fractal(seed ^ 1, (p * 4.0).extend(0.5), 4);
        let alpha = smooth(0.75, 0.25, ragged) * smooth(0.97, 0.7, p.length()) * wisps;
        Vec3::splat(0.88 + 0.12 * wisps).extend(alpha)
    })
    .wrapped([Wrap::Clamp; 2])
}
