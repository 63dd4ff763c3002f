//! Sheets of coloured acrylic that stand through one another.

use glam::{DAffine3, Vec2, Vec3};

use crate::scene::builtin::outlines::direction;
use crate::scene::builtin::shapes::Solid;
use crate::scene::builtin::{Builtin, SEED, seed};
use crate::scene::{Material, Object, Scene, Shape, View};
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::Stream;

const PANES: Typed<i64> = Typed::integer("panes", "7", (1, 24), "how many panes");

pub(super) const SCENE: Builtin = Builtin {
    name: "glass",
    summary: "large overlapping panes in saturated colours, alpha 0.5",
    params: &[PANES.param, SEED.param],
    build,
};

/// The panes' colours, in turn; neighbours are far apart in hue.
const COLOURS: [[f32; 3]; 7] = [
    [0.90, 0.02, 0.05],
    [0.00, 0.35, 0.85],
    [0.98, 0.72, 0.00],
    [0.00, 0.55, 0.20],
    [0.75, 0.00, 0.55],
    [0.00, 0.62, 0.68],
    [0.95, 0.28, 0.00],
];
/// Half of a pane's width, its height, and half of its thickness.
const HALF_WIDTH: f32 = 0.95;
const HEIGHT: f32 = 2.1;
const HALF_THICKNESS: f32 = 0.012;

fn build(values: &Values) -> Scene {
    let mut scene = Scene {
        view: View { yaw: 18.0, pitch: 14.0, background: [0.82, 0.83, 0.84], ..View::default() },
        ..Scene::default()
    };
    let count = values.get(PANES) as u32;
    for i in 0..count {
        let colour = COLOURS[i as usize % COLOURS.len()];
        let acrylic = Material::diffuse("acrylic", colour, 0.5);
        scene.materials.push(Material { unlit: true, ..acrylic });
        let mut random = Stream::new([0x61a55, seed(values), i]);
        let size = random.range(0.8, 1.1);
        scene.objects.push(Object {
            name: format!("pane {}", i + 1),
            shape: scene.shapes.len(),
            place: place(i, HEIGHT * size, &mut random),
        });
        let half = [HALF_WIDTH * random.range(0.8, 1.1), HEIGHT * 0.5 * size];
        scene.shapes.push(Shape::Mesh(pane(half).mesh(i as usize)));
    }
    scene
}

/// A pane around the origin that faces z: its face and the wall of its rim.
fn pane(half: [f32; 2]) -> Solid {
    let outline = outline(Vec2::from_array(half), 0.07);
    let n = outline.len();
    // Upright chords from the right to the left: no point where many triangles meet.
    let chord = |i: usize| [n - 1 - i, i].map(|k| outline[k].extend(0.0)).to_vec();
    let face: Vec<_> = (0..n / 2).map(chord).collect();
    let rim = [[1.0, -HALF_THICKNESS], [1.0, HALF_THICKNESS]];
    Solid::sheet(&face).and(Solid::wheel(&outline, 0.0, &rim, false))
}

/// A rectangle with rounded corners, from the end of its right side on.
fn outline(half: Vec2, radius: f32) -> Vec<Vec2> {
    const STEPS: u32 = 8;
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let corner = |(turns, side): (usize, (f32, f32))| {
        let middle = (half - radius) * Vec2::from(side);
        (0..=STEPS).map(move |step| {
            middle + direction((turns as f32 + step as f32 / STEPS as f32) * 0.25) * radius
        })
    };
    corners.into_iter().enumerate().flat_map(corner).collect()
}

/// Where pane `i` stands: turned by turns to the left and to the right, so that
/// neighbours cut through each other.
fn place(i: u32, height: f32, random: &mut Stream) -> DAffine3 {
    let turn = |degrees: f32| DAffine3::from_rotation_y(f64::from(degrees).to_radians());
    // Multiples of irrational numbers spread any count of panes evenly.
    let spread = |step: f32| (0.5 + i as f32 * step).fract() - 0.5;
    let x = 2.0 * spread(0.618_034) + random.range(-0.1, 0.1);
    let z = 1.7 * spread(0.754_878) + random.range(-0.1, 0.1);
    let side = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    let lean = f64::from(random.range(-5.0, 5.0)).to_radians();
    DAffine3::from_translation(Vec3::new(x, height * 0.5, z).as_dvec3())
        * turn(side * random.range(12.0, 48.0))
        * DAffine3::from_rotation_z(lean)
}
