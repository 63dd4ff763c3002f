//! A tree: opaque wood, and leaf cards cut out by their texture's alpha.

mod leaves;
mod wood;

use glam::Vec3;

use crate::scene::builtin::{Builtin, SEED, seed};
use crate::scene::{AlphaMode, Material, Scene, Shape, TextureUse, View};
use screendoor_trace::param::{Typed, Values};

const CARDS: Typed<i64> = Typed::integer("cards", "9000", (1, 20_000), "how many cards of leaves");

pub(super) const SCENE: Builtin = Builtin {
    name: "foliage",
    summary: "a tree of alpha-mapped leaf cards on opaque branches",
    params: &[CARDS.param, SEED.param],
    build,
};

fn build(values: &Values) -> Scene {
    let seed = seed(values);
    let tree = wood::grow(seed);
    let cards = leaves::cards(&tree.twigs, values.get(CARDS) as u32, seed, 1);
    let mut scene = Scene {
        materials: vec![
            Material::diffuse("bark", [0.17, 0.115, 0.075], 1.0),
            Material {
                base_texture: Some(TextureUse::plain(0)),
                alpha_mode: AlphaMode::Blend,
                unlit: true,
                ..Material::diffuse("leaves", [1.0; 3], 1.0)
            },
        ],
        textures: vec![leaves::paint(seed)],
        view: View { yaw: 25.0, pitch: 6.0, background: [0.55, 0.70, 0.88], ..View::default() },
        ..Scene::default()
    };
    let mut wood = tree.solid.mesh(0);
    wood.colours = wood.positions.iter().map(|p| wood::bark(seed, *p)).collect();
    scene.add("wood", Shape::Mesh(wood));
    scene.add("leaves", Shape::Mesh(cards));
    scene
}

/// A piece of a twig that bears leaves.
struct Twig {
    from: Vec3,
    to: Vec3,
}
