//! The block and what turns and slides in it.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2, Vec3};

use super::{
    BORE, DECK, Engine, PITCH, ROD, THROW, along, at, bank, banks, bolt, gear, polygon, rectangle,
    z_down, z_up,
};
use crate::scene::builtin::outlines::{band, circle, cut};
use crate::scene::builtin::shapes::Solid;

pub(super) fn add(engine: &mut Engine) {
    add_crankshaft(engine);
    add_pistons(engine);
    add_banks(engine);
    add_crankcase(engine);
    add_pan(engine);
}

/// Radius of the main journals, and of the crank pins.
const JOURNAL: f32 = 0.20;

fn add_crankshaft(engine: &mut Engine) {
    let half = engine.half_length();
    let throws: Vec<_> = (0..engine.rows)
        .map(|row| along(engine.row(row)) * DAffine3::from_rotation_z(-engine.pin_angle(row)))
        .collect();
    let throw = THROW as f32;

    // A web holds the pin on one side and a counterweight on the other.
    let outline = band(&[[0.0, throw, 0.25], [0.0, -0.12, 0.46]], engine.sides(45));
    let web = Solid::plate(&outline, 0.0, [-0.075, 0.075], engine.sides(3));
    let webs = throws.iter().flat_map(|place| [-0.345, 0.345].map(|z| *place * along(z)));
    engine.add("crank web", &web, webs);
    let pin = engine.turned(40, &journal(0.27)).moved(0.0, throw, 0.0);
    engine.add("crank pin", &pin, throws);

    engine.add("main journal", &engine.turned(40, &journal(0.14)), engine.between());

    let snout = [[0.16, half + 0.1], [0.16, half + 0.9], [0.14, half + 0.95], [0.0, half + 0.95]];
    engine.add_here("crank snout", &engine.turned(40, &snout));
    let back = -half - 0.14;
    let flange = [
        [0.0, back - 0.2],
        [0.32, back - 0.2],
        [0.32, back - 0.08],
        [0.2, back - 0.05],
        [0.2, back],
    ];
    engine.add_here("crank flange", &engine.turned(40, &flange));
    add_flywheel(engine, back - 0.2);
}

/// The section of a journal with fillets at its ends.
fn journal(half: f32) -> [[f32; 2]; 6] {
    let (r, f) = (JOURNAL, JOURNAL + 0.03);
    [
        [f, -half],
        [r + 0.01, -half + 0.02],
        [r, -half + 0.04],
        [r, half - 0.04],
        [r + 0.01, half - 0.02],
        [f, half],
    ]
}

fn add_flywheel(engine: &mut Engine, front: f32) {
    let section = [
        [0.0, -0.13],
        [0.22, -0.13],
        [0.34, -0.10],
        [0.50, -0.10],
        [0.55, -0.17],
        [1.08, -0.17],
        [1.08, -0.03],
        [0.62, -0.03],
        [0.50, 0.0],
        [0.0, 0.0],
    ];
    engine.add("flywheel", &engine.turned(72, &section), [at(0.0, 0.0, front)]);
    let ring = gear(90, [1.08, 1.13, 1.2], 0.045);
    engine.add("ring gear", &ring, [at(0.0, 0.0, front - 0.095)]);
    let bolts = (0..8).map(|i| {
        DAffine3::from_rotation_z(f64::from(i) * std::f64::consts::FRAC_PI_4)
            * at(0.24, 0.0, front - 0.13)
            * DAffine3::from_rotation_y(std::f64::consts::PI)
    });
    engine.add("flywheel bolt", &bolt(0.035, 0.2), bolts);
}

fn add_pistons(engine: &mut Engine) {
    let motions: Vec<Motion> =
        engine.cylinders().map(|(side, row)| Motion::new(engine, side, row)).collect();
    let pistons = || motions.iter().map(|m| m.piston);

    engine.add("piston", &engine.turned(45, &piston()), pistons());
    let ring = [[0.395, -0.016], [0.437, -0.016], [0.437, 0.016], [0.395, 0.016]];
    let ring = Solid::lathe(engine.sides(40), &ring, true);
    let rings = pistons().flat_map(|p| [0.13, 0.21, 0.29].map(|z| p * at(0.0, 0.0, z)));
    engine.add("piston ring", &ring, rings);
    let pin = [[0.05, -0.34], [0.09, -0.34], [0.09, 0.34], [0.05, 0.34], [0.05, -0.34]];
    engine.add("wrist pin", &engine.turned(20, &pin).placed(&z_up()), pistons());
    engine.add("connecting rod", &rod(engine), motions.iter().map(|m| m.rod));
}

/// Where a cylinder's moving parts are.
struct Motion {
    piston: DAffine3,
    rod: DAffine3,
}

impl Motion {
    fn new(engine: &Engine, side: f64, row: usize) -> Self {
        let frame = along(engine.row(row)) * bank(side);
        let angle = engine.pin_angle(row);
        let (sin, cos) = libm::sincos(angle);
        let pin = DVec3::new(sin, cos, 0.0) * THROW;
        // The pin in the bank's frame: across the cylinder and along it.
        let pin = DVec2::new(pin.dot(frame.matrix3.x_axis), pin.dot(frame.matrix3.z_axis));
        let height = pin.y + (ROD * ROD - pin.x * pin.x).sqrt();
        let up = DVec3::new(-pin.x, 0.0, height - pin.y) / ROD;
        let axes = DMat3::from_cols(DVec3::Y.cross(up), DVec3::Y, up);
        let rod = DAffine3::from_mat3_translation(axes, DVec3::new(pin.x, 0.0, pin.y));
        Motion { piston: frame * DAffine3::from_translation(DVec3::Z * height), rod: frame * rod }
    }
}

/// A piston's section around its wrist pin's centre: the inside, the skirt, three
/// grooves, the dished crown.
fn piston() -> Vec<[f32; 2]> {
    let mut section = vec![
        [0.0, 0.25],
        [0.28, 0.25],
        [0.35, 0.17],
        [0.375, -0.28],
        [0.41, -0.28],
        [0.425, -0.25],
    ];
    for groove in [0.13, 0.21, 0.29] {
        let (low, high) = (groove - 0.018, groove + 0.018);
        section.extend([[0.425, low], [0.395, low], [0.395, high], [0.425, high]]);
    }
    section.extend([[0.425, 0.36], [0.41, 0.375], [0.30, 0.375], [0.24, 0.345], [0.0, 0.345]]);
    section
}

/// A connecting rod: its big end around the origin, its small end up along z, the
/// pins' axes along y.
fn rod(engine: &Engine) -> Solid {
    let length = ROD as f32;
    let eye = |outer: f32, inner: f32, half: f32, sides: usize| {
        Solid::plate(&circle(engine.sides(sides), outer), inner, [-half, half], 2).placed(&z_up())
    };
    let path: Vec<_> =
        cut(&[[0.26, 0.13], [0.5, 0.10], [length - 0.13, 0.075]], engine.step() * 0.8);
    let shank =
        path.iter().map(|[z, half]| i_section(*half, 0.075).iter().map(|p| p.extend(*z)).collect());
    let shoulder = [[0.0, -0.17], [0.055, -0.17], [0.055, 0.14], [0.0, 0.14]];
    let shoulder = Solid::lathe(engine.sides(12), &cut(&shoulder, 0.16), false);
    eye(0.285, JOURNAL + 0.005, 0.11, 36)
        .and(eye(0.155, 0.095, 0.10, 28).moved(0.0, 0.0, length))
        .and(Solid::loft(&shank.collect::<Vec<_>>(), false))
        .and(shoulder.clone().moved(0.28, 0.0, 0.0))
        .and(shoulder.moved(-0.28, 0.0, 0.0))
}

/// The outline of an I-beam: half its height along x, half its width along y.
fn i_section(x: f32, y: f32) -> Vec<Vec2> {
    let (flange, web) = (x - 0.03, 0.022);
    let corner = [
        [x, -y],
        [x, 0.0],
        [x, y],
        [flange, y],
        [flange, web],
        [-flange, web],
        [-flange, y],
        [-x, y],
        [-x, 0.0],
        [-x, -y],
        [-flange, -y],
        [-flange, -web],
        [flange, -web],
        [flange, -y],
    ];
    corner.map(Vec2::from_array).to_vec()
}

fn add_banks(engine: &mut Engine) {
    let step = engine.step();
    let half = engine.half_length();
    let low = 0.86;
    let width = 0.62;
    let outline = rectangle([width, half], step);
    let wall = Solid::wheel(&outline, 0.0, &cut(&[[1.0, low], [1.0, DECK]], step), false);
    engine.add("bank wall", &wall, banks());

    let cell = rectangle([width, PITCH * 0.5], step);
    let frames = engine.cylinder_frames();
    let deck = |z: f32| {
        let profile = [[0.0, z], [0.5, z], [1.0, z]];
        Solid::wheel(&cell, BORE + 0.03, &profile, false)
    };
    engine.add("deck", &deck(DECK), frames.clone());
    engine.add("bank floor", &deck(low), frames.clone());
    let liner = [
        [BORE, low - 0.1],
        [BORE + 0.03, low - 0.1],
        [BORE + 0.03, DECK],
        [BORE, DECK],
        [BORE, low - 0.1],
    ];
    engine.add("cylinder liner", &engine.turned(42, &liner), frames);
}

/// A hexagonal tunnel without the sides that the banks stand on.
fn add_crankcase(engine: &mut Engine) {
    let step = engine.step();
    let reach = engine.half_length() + 0.12;
    let side = [[0.80, -0.52], [1.0, 0.12]];
    for (name, sign) in [("right", 1.0_f32), ("left", -1.0)] {
        let across = cut(&side.map(|[x, y]| [x * sign, y]), step);
        engine.add_here(&format!("{name} crankcase wall"), &extruded(&across, reach, step));
    }
    let valley = [[0.18, 1.05], [-0.18, 1.05]];
    engine.add_here("valley floor", &extruded(&cut(&valley, step), reach, step));

    let corners =
        [[0.76, -0.5], [0.97, 0.1], [0.16, 1.0], [-0.16, 1.0], [-0.97, 0.1], [-0.76, -0.5]];
    let outline = polygon(&corners, step * 1.3);
    let bulkhead = Solid::plate(&outline, JOURNAL + 0.02, [-0.06, 0.06], engine.sides(4));
    let places = engine.between();
    engine.add("main bulkhead", &bulkhead, places.clone());
    let bolts = places.iter().flat_map(|p| [-0.3, 0.3].map(|x| *p * at(x, -0.38, 0.0) * z_down()));
    engine.add("main cap bolt", &bolt(0.045, 0.6), bolts);
}

/// A line in the plane drawn out along z to both sides.
fn extruded(line: &[[f32; 2]], half: f32, step: f32) -> Solid {
    let row = |[z]: [f32; 1]| line.iter().map(|[x, y]| Vec2::new(*x, *y).extend(z)).collect();
    let rows: Vec<_> = cut(&[[-half], [half]], step).into_iter().map(row).collect();
    Solid::sheet(&rows)
}

fn add_pan(engine: &mut Engine) {
    let half = engine.half_length() + 0.12;
    // The flange, the wall and the bottom: how far within, and how far down.
    let section = [
        [-0.10, 0.0],
        [-0.10, 0.04],
        [0.0, 0.05],
        [0.02, 0.2],
        [0.06, 0.45],
        [0.10, 0.6],
        [0.18, 0.66],
        [0.30, 0.68],
        [0.45, 0.69],
        [0.62, 0.69],
        [0.80, 0.69],
    ];
    // The sump hangs deeper at the back.
    let deeper = |z: f32| 1.0 + 0.25 * (-z / half).clamp(-1.0, 1.0);
    let pan = Solid::shell([0.80, half], 0.2, engine.sides(72), &section)
        .bent(|p| Vec3::new(p.x, -0.52 - p.z * deeper(p.y), p.y));
    engine.add_here("oil pan", &pan);
    let spacing = f64::from(PITCH) * 0.5;
    let bolts: Vec<_> = (0..=engine.rows * 2)
        .flat_map(|i| [-0.86, 0.86].map(|x| (i, x)))
        .map(|(i, x)| {
            let z = (i as f64 - engine.rows as f64) * spacing;
            along(z) * at(x, -0.56, 0.0) * z_down()
        })
        .collect();
    engine.add("pan bolt", &bolt(0.03, 0.1), bolts);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn pistons_stay_in_their_cylinders_and_rods_keep_their_length() {
        for crank in 0..48 {
            let crank = f64::from(crank) * 15.0;
            let engine = Engine { rows: 4, crank, detail: 2, scene: Scene::default() };
            for (side, row) in engine.cylinders() {
                let motion = Motion::new(&engine, side, row);
                let up = bank(side).matrix3.z_axis;
                let height = motion.piston.translation.dot(up);
                assert!(height + 0.375 < f64::from(DECK), "{crank} {side} {row}: {height}");
                let rod = motion.piston.translation - motion.rod.translation;
                assert!((rod.length() - ROD).abs() < 1e-9);
                let pin = motion.rod.translation.truncate().length();
                assert!((pin - THROW).abs() < 1e-9);
            }
        }
    }
}
