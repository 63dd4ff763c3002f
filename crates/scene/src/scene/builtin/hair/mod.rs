//! A head with long wavy hair: thin ribbons over an opaque surface.

mod head;
mod locks;

use crate::scene::builtin::{Builtin, SEED, seed};
use crate::scene::{Material, Scene, Shape, View};
use screendoor_trace::param::{Param, Values};

pub(super) const SCENE: Builtin = Builtin {
    name: "hair",
    summary: "long wavy hair of thin ribbons, alpha 0.5, on an opaque head",
    params: &[
        Param::integer("strands", "10000", (1, 20_000), "how many hairs"),
        Param::integer("points", "20", (4, 24), "points along each hair"),
        Param::real("width", "0.0036", (0.0005, 0.05), "a hair's width; the head is 2 high"),
        SEED,
    ],
    build,
};

fn build(values: &Values) -> Scene {
    let mut scene = Scene {
        materials: vec![
            Material::diffuse("clay", [1.0; 3], 1.0),
            Material::diffuse("hair", [1.0; 3], 0.5),
        ],
        view: View { yaw: 32.0, pitch: 5.0, background: [0.70, 0.72, 0.74], ..View::default() },
        ..Scene::default()
    };
    let mut bust = head::bust().mesh(0);
    bust.colours = bust.positions.iter().map(|p| head::colour(*p)).collect();
    scene.add("bust", Shape::Mesh(bust));
    let count = values.integer("strands") as u32;
    let points = values.integer("points") as usize;
    let strands = locks::hair(count, points, values.real("width") as f32, seed(values), 1);
    scene.add("hair", Shape::Strands(strands));
    scene
}
