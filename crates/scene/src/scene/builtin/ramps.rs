//! The test picture of Laine and Karras 2011, figure 1, left of each pair.

use glam::{Vec2, Vec3, Vec4};

use crate::scene::builtin::Builtin;
use crate::scene::{AlphaMode, Material, Mesh, Scene, Shape, View};
use screendoor_trace::param::Values;

pub(super) const SCENE: Builtin = Builtin {
    name: "ramps",
    summary: "an alpha ramp, a quad of alpha 0.61, and one of 0.75 drawn as five; white on black",
    params: &[],
    build,
};

fn build(_: &Values) -> Scene {
    let mut scene = Scene {
        materials: vec![Material {
            name: "white".into(),
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..Material::default()
        }],
        view: View::FRONT,
        ..Scene::default()
    };
    // Three bands across the frame; the edges of the last band's five quads slant,
    // so that they cross pixels in many ways.
    let band = |top: f32| (top, top - 0.56);
    scene.add("ramp", quad([-0.94, 0.94], [-0.94, 0.94], band(0.94), [0.0, 1.0]));
    scene.add("constant", quad([-0.94, 0.94], [-0.94, 0.94], band(0.28), [0.61; 2]));
    let cuts = [-0.94, -0.61, -0.17, 0.21, 0.55, 0.94];
    let slants = [0.0, 0.09, -0.06, 0.03, -0.11, 0.0];
    for i in 0..5 {
        let top = [cuts[i] + slants[i], cuts[i + 1] + slants[i + 1]];
        let bottom = [cuts[i] - slants[i], cuts[i + 1] - slants[i + 1]];
        scene.add(format!("part {}", i + 1), quad(top, bottom, band(-0.38), [0.75; 2]));
    }
    scene
}

/// A quad between two heights: its ends at the top and at the bottom, and its
/// alpha at the left and at the right.
fn quad(top: [f32; 2], bottom: [f32; 2], (high, low): (f32, f32), alpha: [f32; 2]) -> Shape {
    Shape::Mesh(Mesh {
        positions: vec![
            Vec3::new(bottom[0], low, 0.0),
            Vec3::new(bottom[1], low, 0.0),
            Vec3::new(top[1], high, 0.0),
            Vec3::new(top[0], high, 0.0),
        ],
        colours: [0, 1, 1, 0].map(|i| Vec4::new(1.0, 1.0, 1.0, alpha[i])).to_vec(),
        uvs: vec![Vec2::ZERO; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    })
}
