//! A head with long wavy hair: thin ribbons over an opaque surface.

mod head;
mod locks;

use crate::scene::builtin::{Builtin, SEED, seed};
use crate::scene::{Material, Scene, Shape, View};
use screendoor_trace::param::{Typed, Values};

const STRANDS: Typed<i64> = Typed::integer("strands", "10000", (1, 20_000), "how many hairs");
const POINTS: Typed<i64> = Typed::integer("points", "20", (4, 24), "points along each hair");
const WIDTH: Typed<f64> =
    Typed::real("width", "0.0036", (0.0005, 0.05), "a hair's width; the head is 2 high");

pub(super) const SCENE: Builtin = Builtin {
    name: "hair",
    summary: "long wavy hair of thin ribbons, alpha 0.5, on an opaque head",
    params: &[STRANDS.param, POINTS.param, WIDTH.param, SEED.param],
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
    let count = values.get(STRANDS) as u32;
    let points = values.get(POINTS) as usize;
    let strands = locks::hair(count, points, values.get(WIDTH) as f32, seed(values), 1);
    scene.add("hair", Shape::Strands(strands));
    scene
}
