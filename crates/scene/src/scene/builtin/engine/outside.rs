//! What is bolted to the engine's outside: intake, exhaust, filter, starter.

use glam::{DAffine3, Vec3};

use super::head::{EXHAUST_PORT, INTAKE_PORT, PORT};
use super::{Engine, STAGGER, along, at, bank, z_to_x, z_up};
use crate::scene::builtin::outlines::{circle, curve, cut, radial};
use crate::scene::builtin::shapes::Solid;

pub(super) fn add(engine: &mut Engine) {
    add_intake(engine);
    add_exhaust(engine);
    add_fittings(engine);
}

/// A point of a bank's section in the engine's front view.
fn in_bank(side: f64, [x, z]: [f32; 2]) -> Vec3 {
    let place = bank(side);
    let local = Vec3::new(x, 0.0, z).as_dvec3();
    (place.matrix3 * local).as_vec3()
}

/// The height of the plenum's middle.
const PLENUM: f32 = 2.55;

fn add_intake(engine: &mut Engine) {
    for (name, side) in [("right intake runner", 1.0_f64), ("left intake runner", -1.0)] {
        let port = in_bank(side, INTAKE_PORT);
        let out = in_bank(side, [INTAKE_PORT[0] + 0.45, INTAKE_PORT[1] + 0.05]);
        let x = side as f32;
        let through =
            [port, out, Vec3::new(0.62 * x, PLENUM + 0.05, 0.0), Vec3::new(0.38 * x, PLENUM, 0.0)];
        let path = curve(&through, engine.sides(6));
        let runner = Solid::sweep(&path, false, Vec3::Z, |_| circle(engine.sides(24), PORT));
        engine.add(name, &runner, rows(engine, side));
    }
    let half = engine.half_length() - 0.1;
    let section = [
        [0.42, -0.3],
        [0.18, -0.3],
        [0.08, -0.26],
        [0.02, -0.2],
        [0.0, -0.1],
        [0.0, 0.1],
        [0.02, 0.2],
        [0.08, 0.26],
        [0.18, 0.3],
        [0.42, 0.3],
    ];
    let section = cut(&section, engine.step());
    let plenum = Solid::shell([0.42, half], 0.2, engine.sides(60), &section);
    let place = at(0.0, PLENUM, 0.0) * z_up();
    engine.add("plenum", &plenum, [place]);
    add_air_cleaner(engine, PLENUM + 0.1);
}

fn add_air_cleaner(engine: &mut Engine, bottom: f32) {
    let throat = [[0.30, 0.2], [0.26, 0.24], [0.26, 0.34], [0.3, 0.42]];
    let lower = [[0.3, 0.42], [0.8, 0.42], [0.98, 0.46], [1.0, 0.48], [1.0, 0.52]];
    let upper = [[1.0, 0.84], [1.0, 0.88], [0.98, 0.9], [0.75, 0.92], [0.35, 0.98], [0.0, 1.0]];
    let element = radial(engine.sides(54) * 4, |turn| {
        let phase = turn * engine.sides(54) as f32;
        0.86 + 0.08 * ((phase - phase.floor()) * 2.0 - 1.0).abs()
    });
    let element = Solid::wheel(&element, 0.0, &cut(&[[1.0, 0.46], [1.0, 0.9]], 0.22), false);
    let knob = [[0.0, 1.0], [0.05, 1.0], [0.05, 1.06], [0.12, 1.08], [0.12, 1.12], [0.0, 1.14]];
    let place = at(0.0, bottom, 0.0) * z_up();
    engine.add("carburettor throat", &engine.turned(48, &throat), [place]);
    engine.add("air cleaner pan", &engine.turned(72, &lower), [place]);
    engine.add("air cleaner lid", &engine.turned(72, &upper), [place]);
    engine.add("air filter", &element, [place]);
    engine.add("wing nut", &engine.turned(24, &knob), [place]);
}

/// A bank's cylinders along the engine.
fn rows(engine: &Engine, side: f64) -> Vec<DAffine3> {
    (0..engine.rows).map(|row| along(engine.row(row) + side * STAGGER)).collect()
}

fn add_exhaust(engine: &mut Engine) {
    let half = engine.half_length();
    for (name, side) in [("right", 1.0_f64), ("left", -1.0)] {
        let port = in_bank(side, EXHAUST_PORT);
        let out = in_bank(side, [EXHAUST_PORT[0] - 0.3, EXHAUST_PORT[1]]);
        let x = side as f32;
        let log = Vec3::new(2.2 * x, 0.42, 0.0);
        let through = [port, out, Vec3::new(2.42 * x, 0.72, -0.02), log];
        let path = curve(&through, engine.sides(6));
        let runner = Solid::sweep(&path, false, Vec3::Z, |_| circle(engine.sides(24), PORT));
        engine.add(&format!("{name} exhaust runner"), &runner, rows(engine, side));

        let z = |z: f32| log + Vec3::new(0.0, 0.0, z);
        let line = [
            z(half - 0.2),
            z(0.0),
            z(-half * 0.6),
            z(-half),
            z(-half - 0.35) + Vec3::new(-0.05 * x, -0.25, 0.0),
            z(-half - 0.5) + Vec3::new(-0.15 * x, -0.9, 0.0),
            z(-half - 0.5) + Vec3::new(-0.2 * x, -1.4, 0.0),
        ];
        let path = curve(&line, engine.sides(7));
        let last = path.len() - 1;
        let collector = Solid::sweep(&path, false, Vec3::X, |i| {
            // Closed at the front, a flange at the other end.
            let radius = match i {
                0 => 0.0,
                1 => 0.15,
                i if i + 1 >= last => 0.28,
                _ => 0.2,
            };
            circle(engine.sides(28), radius)
        });
        engine.add_here(&format!("{name} exhaust manifold"), &collector);
    }
}

fn add_fittings(engine: &mut Engine) {
    let half = engine.half_length();
    let filter = [
        [0.0, 0.0],
        [0.12, 0.0],
        [0.12, 0.06],
        [0.24, 0.08],
        [0.27, 0.12],
        [0.27, 0.6],
        [0.24, 0.68],
        [0.15, 0.71],
        [0.0, 0.71],
    ];
    engine.add("oil filter", &engine.turned(36, &filter), [at(0.92, -0.2, half * 0.4) * z_to_x()]);
    let starter = [
        [0.0, -0.2],
        [0.08, -0.2],
        [0.08, -0.05],
        [0.2, 0.0],
        [0.25, 0.05],
        [0.25, 0.75],
        [0.22, 0.8],
        [0.1, 0.84],
        [0.0, 0.84],
    ];
    engine.add("starter motor", &engine.turned(36, &starter), [at(-1.18, -0.2, -half - 0.2)]);
    add_pipes(engine);
}

fn add_pipes(engine: &mut Engine) {
    let half = engine.half_length();
    let dipstick = curve(
        &[
            Vec3::new(-0.85, -0.45, 0.4),
            Vec3::new(-1.3, 0.0, 0.45),
            Vec3::new(-1.75, 0.6, 0.5),
            Vec3::new(-2.6, 1.2, 0.52),
        ],
        engine.sides(8),
    );
    engine.add_here("dipstick tube", &Solid::tube(&dipstick, 0.03, engine.sides(10)));
    let pickup = curve(
        &[
            Vec3::new(0.0, -1.1, -half * 0.6),
            Vec3::new(0.0, -0.9, -half * 0.5),
            Vec3::new(0.1, -0.75, 0.0),
            Vec3::new(0.15, -0.6, half),
        ],
        engine.sides(10),
    );
    engine.add_here("oil pickup", &Solid::tube(&pickup, 0.06, engine.sides(14)));
    let strainer = [[0.0, -0.06], [0.24, -0.06], [0.22, 0.0], [0.0, 0.0]];
    let place = at(0.0, -1.08, -half * 0.6) * z_up();
    engine.add("oil strainer", &engine.turned(36, &strainer), [place]);
}
