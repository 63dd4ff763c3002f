//! A V engine with everything inside it: many thin layers of CAD-like parts.
//!
//! The crankshaft lies along z with the front at +z; the distance between two
//! cylinders of a bank is 1.12.

mod bottom;
mod front;
mod head;
mod outside;

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};

use crate::scene::builtin::Builtin;
use crate::scene::builtin::outlines::{cut, direction};
use crate::scene::builtin::shapes::Solid;
use crate::scene::{Material, Object, Scene, Shape, View};
use screendoor_trace::param::{Typed, Values};

const ROWS: Typed<i64> = Typed::integer("rows", "4", (1, 6), "cylinders in each of the two banks");
const CRANK: Typed<f64> =
    Typed::real("crank", "50", (0.0, 720.0), "degrees that the crankshaft has turned");
const DETAIL: Typed<i64> =
    Typed::integer("detail", "3", (2, 5), "how finely round parts are cut into triangles");

pub(super) const SCENE: Builtin = Builtin {
    name: "engine",
    summary: "a V engine of over 100 thousand triangles, white, alpha 0.3",
    params: &[ROWS.param, CRANK.param, DETAIL.param],
    build,
};

fn build(values: &Values) -> Scene {
    let mut engine = Engine {
        rows: values.get(ROWS) as usize,
        crank: values.get(CRANK),
        detail: values.get(DETAIL) as usize,
        scene: Scene {
            materials: vec![Material::diffuse("white", [1.0; 3], 0.3)],
            view: View {
                yaw: 35.0,
                pitch: 22.0,
                background: [0.06, 0.08, 0.11],
                ..View::default()
            },
            ..Scene::default()
        },
    };
    bottom::add(&mut engine);
    head::add(&mut engine);
    front::add(&mut engine);
    outside::add(&mut engine);
    engine.scene
}

/// Between two cylinders of a bank.
const PITCH: f32 = 1.12;
/// Radius of the cylinders.
const BORE: f32 = 0.44;
/// From the crankshaft's axis to a crank pin.
const THROW: f64 = 0.38;
/// Between the two ends of a connecting rod.
const ROD: f64 = 1.30;
/// From the crankshaft's axis to the top of the block, along a bank.
const DECK: f32 = 2.08;
/// From the crankshaft's axis to the top of the heads, along a bank.
const HEAD_TOP: f32 = 2.64;
/// From the middle of a bank to its camshafts, across and along the bank.
const CAM: [f32; 2] = [0.44, 2.99];
/// Half of the angle between the banks, as its sine and cosine.
const HALF_VEE: f64 = FRAC_1_SQRT_2;
/// How far the banks are shifted along the crankshaft: two rods share a pin.
const STAGGER: f64 = 0.12;

/// The engine's two banks: on the right of its front and on the left.
const BANKS: [f64; 2] = [1.0, -1.0];

/// The engine as far as it is built.
struct Engine {
    rows: usize,
    crank: f64,
    detail: usize,
    scene: Scene,
}

impl Engine {
    /// Adds a part at each of the places, all of one shape.
    fn add(&mut self, name: &str, solid: &Solid, places: impl IntoIterator<Item = DAffine3>) {
        let shape = self.scene.shapes.len();
        self.scene.shapes.push(Shape::Mesh(solid.mesh(0)));
        for (i, place) in places.into_iter().enumerate() {
            self.scene.objects.push(Object { name: format!("{name} {}", i + 1), shape, place });
        }
    }

    /// Adds a part where it is.
    fn add_here(&mut self, name: &str, solid: &Solid) {
        self.add(name, solid, [DAffine3::IDENTITY]);
    }

    /// A number of sides for something round that has `at_three` at detail 3.
    fn sides(&self, at_three: usize) -> usize {
        (at_three * self.detail / 3).max(6)
    }

    /// The longest side of a triangle in something flat.
    fn step(&self) -> f32 {
        0.48 / self.detail as f32
    }

    /// Something round: `section` turned around z, with `at_three` sides at detail 3.
    fn turned(&self, at_three: usize, section: &[[f32; 2]]) -> Solid {
        Solid::lathe(self.sides(at_three), &cut(section, 1.3 * self.step()), false)
    }

    /// Where the cylinders of one bank lie along the crankshaft, from the middle.
    fn row(&self, row: usize) -> f64 {
        (row as f64 - (self.rows as f64 - 1.0) * 0.5) * f64::from(PITCH)
    }

    /// Half of the length of a bank.
    fn half_length(&self) -> f32 {
        self.rows as f32 * PITCH * 0.5
    }

    /// The places between the cylinders and at the ends of the rows.
    fn between(&self) -> Vec<DAffine3> {
        (0..=self.rows).map(|i| along(self.row(i) - f64::from(PITCH) * 0.5)).collect()
    }

    /// Each cylinder: its bank and its row.
    fn cylinders(&self) -> impl Iterator<Item = (f64, usize)> + use<> {
        let rows = self.rows;
        BANKS.into_iter().flat_map(move |bank| (0..rows).map(move |row| (bank, row)))
    }

    /// The frames of all cylinders: as [`bank`]'s, moved along to each.
    fn cylinder_frames(&self) -> Vec<DAffine3> {
        let frame = |(side, row)| along(self.row(row)) * bank(side);
        self.cylinders().map(frame).collect()
    }

    /// The angle of a row's crank pin, in radians from straight up towards +x: a
    /// cross-plane crankshaft.
    fn pin_angle(&self, row: usize) -> f64 {
        (self.crank + 90.0 * [0.0, 1.0, 3.0, 2.0][row % 4]).to_radians()
    }
}

/// The frame of a bank: x towards the valley between the banks, z up along the
/// cylinders.
fn bank(side: f64) -> DAffine3 {
    let valley = DVec3::new(-side * HALF_VEE, HALF_VEE, 0.0);
    let up = DVec3::new(side * HALF_VEE, HALF_VEE, 0.0);
    let axes = DMat3::from_cols(valley, up.cross(valley), up);
    DAffine3::from_mat3_translation(axes, DVec3::Z * (side * STAGGER))
}

/// Both banks' frames.
fn banks() -> [DAffine3; 2] {
    BANKS.map(bank)
}

/// A move along the crankshaft.
fn along(z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::Z * z)
}

/// A move.
fn at(x: f32, y: f32, z: f32) -> DAffine3 {
    DAffine3::from_translation(Vec3::new(x, y, z).as_dvec3())
}

/// Turns z downwards, to −y.
fn z_down() -> DAffine3 {
    DAffine3::from_rotation_x(FRAC_PI_2)
}

/// Turns z upwards, to y.
fn z_up() -> DAffine3 {
    DAffine3::from_rotation_x(-FRAC_PI_2)
}

/// Turns z to x.
fn z_to_x() -> DAffine3 {
    DAffine3::from_mat3(DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X))
}

/// A bolt whose head stands on the origin, its shank going down.
fn bolt(radius: f32, length: f32) -> Solid {
    let (wide, tall) = (radius * 1.7, radius * 1.3);
    let head = [[0.0, 0.0], [wide, 0.0], [wide, tall * 0.8], [wide * 0.8, tall], [0.0, tall]];
    let shank = [[radius, -length], [radius, -length * 0.5], [radius, 0.0]];
    Solid::lathe(6, &head, false).and(Solid::lathe(8, &shank, false))
}

/// A toothed ring around a round hole.
fn gear(teeth: usize, [hole, root, tip]: [f32; 3], half: f32) -> Solid {
    let radius = |i: usize| if matches!(i % 4, 1 | 2) { tip } else { root };
    let sides = teeth * 4;
    let point = |i: usize| direction((i as f32 + 0.5) / sides as f32) * radius(i);
    let outline: Vec<_> = (0..sides).map(point).collect();
    Solid::plate(&outline, hole, [-half, half], 1)
}

/// A rectangle around the origin whose sides are cut into pieces.
fn rectangle([x, y]: [f32; 2], step: f32) -> Vec<Vec2> {
    polygon(&[[x, -y], [x, y], [-x, y], [-x, -y]], step)
}

/// A closed outline whose sides are cut into pieces.
fn polygon(corners: &[[f32; 2]], step: f32) -> Vec<Vec2> {
    let closed: Vec<_> = corners.iter().chain(corners.first()).copied().collect();
    let mut outline: Vec<_> = cut(&closed, step).into_iter().map(Vec2::from_array).collect();
    outline.pop();
    outline
}
