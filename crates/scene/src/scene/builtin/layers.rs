//! Layers over the whole frame: the simplest scene that has overlap, and a load
//! of any size for measuring.

use glam::Vec3;

use crate::scene::builtin::{Builtin, SEED, seed};
use crate::scene::{AlphaMode, Material, Mesh, Scene, Shape, View};
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::Stream;

const COUNT: Typed<i64> = Typed::integer("count", "8", (1, 100_000), "how many layers");
const ALPHA: Typed<f64> = Typed::real("alpha", "0.1", (0.0, 1.0), "opacity of each");
const COLOURED: Typed<bool> = Typed::flag("coloured", false, "random colours in place of white");
const NEAR_FIRST: Typed<bool> =
    Typed::flag("near-first", false, "drawn from the nearest on, not from the furthest");

pub(super) const SCENE: Builtin = Builtin {
    name: "layers",
    summary: "parallel layers over the whole frame (LK figure 3 with count=8,alpha=0.1)",
    params: &[COUNT.param, ALPHA.param, COLOURED.param, NEAR_FIRST.param, SEED.param],
    build,
};

fn build(values: &Values) -> Scene {
    let count = values.get(COUNT);
    let mut scene = Scene { view: View::FRONT, ..Scene::default() };
    for i in 0..count {
        let place = if values.get(NEAR_FIRST) { count - 1 - i } else { i };
        let mut random = Stream::new([0x1a7e5, seed(values), place as u32]);
        let colour = if values.get(COLOURED) {
            [random.unit(), random.unit(), random.unit()]
        } else {
            [1.0; 3]
        };
        scene.materials.push(Material {
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..Material::diffuse("layer", colour, values.get(ALPHA) as f32)
        });
        // One triangle that holds any frame: no edge is in sight.
        let z = place as f32 / count as f32;
        let corner = |x: f32, y: f32| Vec3::new(x * 1e3, y * 1e3, z);
        let mesh = Mesh {
            positions: vec![corner(-3.0, -1.0), corner(3.0, -1.0), corner(0.0, 3.0)],
            triangles: vec![[0, 1, 2]],
            material: scene.materials.len() - 1,
            ..Mesh::default()
        };
        scene.add(format!("layer {i}"), Shape::Mesh(mesh));
    }
    scene
}
