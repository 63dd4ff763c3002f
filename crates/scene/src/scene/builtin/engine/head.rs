//! The cylinder heads: chambers, ports, valves, camshafts and covers.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::{BORE, CAM, DECK, Engine, HEAD_TOP, PITCH, at, banks, bolt, rectangle, z_up};
use crate::scene::builtin::outlines::{circle, curve, cut, direction, radial};
use crate::scene::builtin::shapes::Solid;

/// Half of the heads' width.
pub(super) const HALF_WIDTH: f32 = 0.74;
/// Where the ports leave the heads: across and along the bank, on the intake side
/// and on the exhaust side.
pub(super) const INTAKE_PORT: [f32; 2] = [HALF_WIDTH, 2.46];
pub(super) const EXHAUST_PORT: [f32; 2] = [-HALF_WIDTH, 2.38];
/// Radius of the ports.
pub(super) const PORT: f32 = 0.15;
/// How far an open valve is off its seat.
const LIFT: f32 = 0.10;
/// Radius of the cams' round part.
const CAM_BASE: f32 = 0.11;
/// Length of the valves.
const VALVE: f32 = 0.70;
/// Length of a valve spring where the valve is closed.
const SPRING: f32 = 0.33;
/// Where the valves' middle lies on its seat, across and along the bank.
const SEAT: [f32; 2] = [0.19, 2.17];

pub(super) fn add(engine: &mut Engine) {
    add_heads(engine);
    add_ports_and_plugs(engine);
    add_valve_gear(engine);
    add_camshafts(engine);
    add_covers(engine);
}

fn add_heads(engine: &mut Engine) {
    let step = engine.step();
    let half = engine.half_length();
    let outline = rectangle([HALF_WIDTH, half], step);
    let section = cut(&[[1.0, DECK + 0.03], [1.0, HEAD_TOP]], step);
    engine.add("head wall", &Solid::wheel(&outline, 0.0, &section, false), banks());

    let frames = engine.cylinder_frames();
    let cell = rectangle([HALF_WIDTH, PITCH * 0.5], step);
    let z = DECK + 0.03;
    let face = Solid::wheel(&cell, BORE, &[[0.0, z], [0.5, z], [1.0, z]], false);
    engine.add("head face", &face, frames.clone());
    let dome = [[0.44, z], [0.40, z + 0.06], [0.30, z + 0.12], [0.16, z + 0.16], [0.0, z + 0.17]];
    engine.add("combustion chamber", &engine.turned(40, &dome), frames);

    let shank = 0.9;
    let bolts: Vec<_> = banks()
        .into_iter()
        .flat_map(|b| (0..=engine.rows).map(move |i| (b, i)))
        .flat_map(|(b, i)| [-0.56, 0.56].map(|x| (b, i, x)))
        .map(|(b, i, x)| {
            let y = (i as f32 - engine.rows as f32 * 0.5) * (PITCH - 0.08);
            b * at(x, y, HEAD_TOP)
        })
        .collect();
    engine.add("head bolt", &bolt(0.05, shank), bolts);
}

fn add_ports_and_plugs(engine: &mut Engine) {
    let frames = engine.cylinder_frames();
    for (name, [x, z], side) in
        [("intake port", INTAKE_PORT, 1.0), ("exhaust port", EXHAUST_PORT, -1.0)]
    {
        let bend = [
            Vec3::new(SEAT[0] * side, 0.0, SEAT[1] + 0.05),
            Vec3::new((SEAT[0] + 0.12) * side, 0.0, SEAT[1] + 0.18),
            Vec3::new(x * 0.75, 0.0, z - 0.02),
            Vec3::new(x, 0.0, z),
        ];
        let path = curve(&bend, engine.sides(4));
        let port = Solid::sweep(&path, false, Vec3::Y, |_| circle(engine.sides(20), PORT));
        engine.add(name, &port, frames.clone());
    }

    let plug = [
        [0.0, -0.06],
        [0.03, -0.05],
        [0.06, 0.0],
        [0.06, 0.16],
        [0.10, 0.17],
        [0.10, 0.26],
        [0.06, 0.30],
        [0.05, 0.5],
        [0.09, 0.52],
        [0.09, 1.15],
        [0.13, 1.17],
        [0.13, 1.33],
        [0.05, 1.36],
        [0.0, 1.36],
    ];
    let plug = engine.turned(18, &plug).moved(0.0, 0.0, DECK + 0.20);
    engine.add("spark plug", &plug, frames);
}

/// Where a valve stands in its cylinder's frame, closed: z along its stem.
fn valve_frame(side: f32) -> DAffine3 {
    let along = DVec3::new(f64::from((CAM[0] - SEAT[0]) * side), 0.0, f64::from(CAM[1] - SEAT[1]));
    let up = along.normalize();
    let axes = DMat3::from_cols(DVec3::Y.cross(up), DVec3::Y, up);
    DAffine3::from_mat3_translation(axes, Vec3::new(SEAT[0] * side, 0.0, SEAT[1]).as_dvec3())
}

/// The share of the full lift at `turns` from the cam's nose: a smooth bump over a
/// third of a turn.
fn bump(turns: f32) -> f32 {
    let from_nose = (turns - (turns + 0.5).floor()).abs() / 0.17;
    let rest = (1.0 - from_nose * from_nose).max(0.0);
    rest * rest
}

/// A valve's cylinder, on which side of it the valve is (1 for intake, −1 for
/// exhaust), and how far its cam has turned since its nose held the valve open, in
/// turns.
struct Valve {
    cylinder: DAffine3,
    side: f32,
    phase: f32,
}

/// All valves, two for each cylinder.
fn valves(engine: &Engine) -> Vec<Valve> {
    // Camshafts turn once in four strokes.
    let turn = (engine.crank / 720.0) as f32;
    let firing = [0.0, 0.25, 0.75, 0.5, 0.125, 0.875, 0.375, 0.625];
    let of_cylinder = |(i, cylinder): (usize, DAffine3)| {
        [1.0, -1.0].map(|side| Valve { cylinder, side, phase: turn + firing[i % 8] + 0.12 * side })
    };
    engine.cylinder_frames().into_iter().enumerate().flat_map(of_cylinder).collect()
}

fn add_valve_gear(engine: &mut Engine) {
    let valves = valves(engine);
    let lift = |v: &Valve| LIFT * bump(v.phase);
    let closed = |v: &Valve| v.cylinder * valve_frame(v.side);
    let open = |v: &Valve| closed(v) * at(0.0, 0.0, -lift(v));
    let valve = [
        [0.0, 0.0],
        [0.185, 0.0],
        [0.195, 0.02],
        [0.175, 0.05],
        [0.11, 0.09],
        [0.06, 0.15],
        [0.037, 0.24],
        [0.03, 0.36],
        [0.03, VALVE],
        [0.0, VALVE],
    ];
    engine.add("valve", &engine.turned(24, &valve), valves.iter().map(open));
    let bucket = [
        [0.12, 0.56],
        [0.14, 0.56],
        [0.14, VALVE + 0.03],
        [0.13, VALVE + 0.045],
        [0.0, VALVE + 0.045],
    ];
    engine.add("tappet", &engine.turned(24, &bucket), valves.iter().map(open));
    let squeezed = |v: &Valve| {
        let share = f64::from(1.0 - lift(v) / SPRING);
        closed(v) * at(0.0, 0.0, 0.36) * DAffine3::from_scale(DVec3::new(1.0, 1.0, share))
    };
    engine.add("valve spring", &spring(engine), valves.iter().map(squeezed));
    let guide = [[0.033, 0.2], [0.06, 0.2], [0.06, 0.44], [0.033, 0.44], [0.033, 0.2]];
    engine.add("valve guide", &engine.turned(14, &guide), valves.iter().map(closed));
}

/// A helical spring from the origin up.
fn spring(engine: &Engine) -> Solid {
    let (turns, per_turn) = (4.5, engine.sides(14));
    let count = (turns * per_turn as f32) as usize;
    let path: Vec<Vec3> = (0..=count)
        .map(|i| {
            let turn = i as f32 / per_turn as f32;
            (direction(turn) * 0.1).extend(SPRING * turn / turns)
        })
        .collect();
    Solid::tube(&path, 0.02, engine.sides(6))
}

fn add_camshafts(engine: &mut Engine) {
    let half = engine.half_length();
    let shaft = [[0.0, -half - 0.1], [0.07, -half - 0.1], [0.07, half + 0.1], [0.0, half + 0.1]];
    let lines: Vec<_> = banks()
        .into_iter()
        .flat_map(|b| [CAM[0], -CAM[0]].map(|x| b * at(x, 0.0, CAM[1]) * z_up()))
        .collect();
    engine.add("camshaft", &engine.turned(20, &shaft), lines.iter().copied());
    let journal = [[0.07, -0.07], [0.1, -0.06], [0.1, 0.06], [0.07, 0.07]];
    let between = engine.between();
    let journals = lines.iter().flat_map(|line| between.iter().map(move |place| *line * *place));
    engine.add("cam journal", &engine.turned(24, &journal), journals);

    let outline = radial(engine.sides(36), |turn| CAM_BASE + LIFT * bump(turn));
    let lobe = Solid::plate(&outline, 0.06, [-0.08, 0.08], 1);
    let place = |v: &Valve| {
        // The nose of a cam at phase 0 points down the valve's stem.
        let down = -valve_frame(v.side).matrix3.z_axis;
        let axes = DMat3::from_cols(down, DVec3::Y.cross(down), DVec3::Y);
        let turned = DMat3::from_rotation_z(f64::from(v.phase) * TAU);
        v.cylinder * at(CAM[0] * v.side, 0.0, CAM[1]) * DAffine3::from_mat3(axes * turned)
    };
    engine.add("cam", &lobe, valves(engine).iter().map(place));
}

fn add_covers(engine: &mut Engine) {
    let half = engine.half_length() + 0.04;
    let sides = engine.sides(80);
    let section = [
        [0.0, 0.0],
        [0.0, 0.05],
        [0.05, 0.06],
        [0.055, 0.2],
        [0.06, 0.36],
        [0.08, 0.5],
        [0.14, 0.6],
        [0.22, 0.65],
        [0.34, 0.67],
        [0.46, 0.67],
        [0.58, 0.67],
        [0.74, 0.67],
    ];
    let cover = Solid::shell([HALF_WIDTH, half], 0.12, sides, &section).moved(0.0, 0.0, HEAD_TOP);
    engine.add("cam cover", &cover, banks());
    let bolts: Vec<_> = banks()
        .into_iter()
        .flat_map(|b| (0..engine.rows * 2).map(move |i| (b, i)))
        .flat_map(|(b, i)| [-0.715, 0.715].map(|x| (b, i, x)))
        .map(|(b, i, x)| {
            b * at(x, (i as f32 + 0.5 - engine.rows as f32) * PITCH * 0.5, HEAD_TOP + 0.05)
        })
        .collect();
    engine.add("cover bolt", &bolt(0.03, 0.12), bolts);
}
