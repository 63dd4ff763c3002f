//! The timing drive and the belt drive at the engine's front.

use glam::{DVec3, Vec2, Vec3};

use super::{CAM, Engine, STAGGER, at, bank, gear};
use crate::scene::builtin::outlines::{band, cut};
use crate::scene::builtin::shapes::Solid;

pub(super) fn add(engine: &mut Engine) {
    add_timing(engine);
    add_belt(engine);
}

/// Where a bank's camshafts lie in the engine's front view.
fn cams(side: f64) -> [[f32; 2]; 2] {
    [1.0, -1.0].map(|sign: f64| {
        let local = DVec3::new(f64::from(CAM[0]) * sign, 0.0, f64::from(CAM[1]));
        let p = bank(side).transform_point3(local);
        [p.x as f32, p.y as f32]
    })
}

fn add_timing(engine: &mut Engine) {
    let front = engine.half_length() + STAGGER as f32 + 0.08;
    let small = gear(20, [0.1, 0.18, 0.21], 0.04);
    let hub = [
        [0.07, -0.07],
        [0.12, -0.07],
        [0.14, -0.015],
        [0.32, -0.015],
        [0.32, 0.015],
        [0.14, 0.015],
        [0.12, 0.07],
        [0.07, 0.07],
    ];
    let hub = Solid::lathe(engine.sides(36), &cut(&hub, engine.step()), true);
    let large = gear(40, [0.32, 0.37, 0.40], 0.04).and(hub);
    let mut sprockets = Vec::new();
    for (side, z) in [(1.0, front), (-1.0, front + 0.14)] {
        engine.add("crank sprocket", &small, [at(0.0, 0.0, z)]);
        let centres = cams(side);
        sprockets.extend(centres.map(|[x, y]| at(x, y, z)));
        let [[ax, ay], [bx, by]] = centres;
        let around = [[0.0, 0.0, 0.21], [ax, ay, 0.40], [bx, by, 0.40]];
        let line = band(&around, 64 * engine.detail);
        // Alternating widths show the chain's links.
        let width = |i: usize| if i % 4 < 2 { 0.055 } else { 0.03 };
        engine.add("timing chain", &ribbon(&line, 0.028, width), [at(0.0, 0.0, z)]);
    }
    engine.add("cam sprocket", &large, sprockets);

    // The cover's outline holds both chains.
    let around: Vec<[f32; 3]> = [[0.0, -0.05, 0.5]]
        .into_iter()
        .chain([1.0, -1.0].into_iter().flat_map(cams).map(|[x, y]| [x, y, 0.5]))
        .map(|[x, y, r]| [x, y - COVER_MIDDLE, r])
        .collect();
    let outline = band(&around, engine.sides(96));
    // Cut open: the chains show.
    let section = [
        [1.03, -0.06],
        [1.03, 0.0],
        [1.0, 0.0],
        [1.0, 0.12],
        [0.99, 0.22],
        [0.96, 0.28],
        [0.9, 0.3],
    ];
    let cover = Solid::wheel(&outline, 0.0, &section, false);
    engine.add("timing cover", &cover, [at(0.0, COVER_MIDDLE, front)]);
}

/// The height of the middle of the timing cover.
const COVER_MIDDLE: f32 = 1.3;

/// A closed band in the plane: `thick` half across it, `wide` half along z.
fn ribbon(line: &[Vec2], thick: f32, wide: impl Fn(usize) -> f32) -> Solid {
    let path: Vec<Vec3> = line.iter().map(|p| p.extend(0.0)).collect();
    Solid::sweep(&path, true, Vec3::Z, |i| {
        let w = wide(i);
        [[w, thick], [-w, thick], [-w, -thick], [w, -thick]].map(Vec2::from_array).to_vec()
    })
}

/// Belt-driven parts: name, centre, radius of the pulley.
const PULLEYS: [(&str, [f32; 3]); 5] = [
    ("crank pulley", [0.0, 0.0, 0.44]),
    ("alternator pulley", [1.55, 0.30, 0.20]),
    ("compressor pulley", [-1.55, 0.25, 0.27]),
    ("water pump pulley", [0.0, 1.50, 0.36]),
    ("idler pulley", [-0.95, 1.15, 0.16]),
];

fn add_belt(engine: &mut Engine) {
    let z = engine.half_length() + STAGGER as f32 + 0.62;
    for (name, [x, y, radius]) in PULLEYS {
        engine.add(name, &engine.turned(44, &pulley(radius)), [at(x, y, z)]);
    }
    let line = band(&PULLEYS.map(|(_, circle)| circle), engine.sides(150));
    engine.add("belt", &ribbon(&line, 0.02, |_| 0.09), [at(0.0, 0.0, z)]);

    for (name, index, radius, length) in
        [("alternator", 1, 0.36, 1.1), ("compressor", 2, 0.34, 1.3), ("water pump", 3, 0.34, 0.45)]
    {
        let [x, y, _] = PULLEYS[index].1;
        engine.add(name, &engine.turned(44, &housing(radius, length)), [at(x, y, z)]);
    }
}

/// The section of a pump's or a generator's housing, with its shaft.
fn housing(r: f32, length: f32) -> [[f32; 2]; 12] {
    [
        [0.0, -length],
        [r * 0.6, -length],
        [r * 0.9, -length + 0.05],
        [r, -length + 0.14],
        [r, -length * 0.52],
        [r * 0.93, -length * 0.5],
        [r, -length * 0.48],
        [r, -0.28],
        [r * 0.85, -0.2],
        [r * 0.35, -0.16],
        [0.06, -0.14],
        [0.06, 0.0],
    ]
}

/// The section of a grooved pulley with a thin web.
fn pulley(radius: f32) -> Vec<[f32; 2]> {
    let rim = radius - 0.02;
    let mut section =
        vec![[0.0, -0.05], [0.1, -0.05], [0.1, -0.02], [rim - 0.06, -0.02], [rim - 0.05, -0.1]];
    for i in 0..4 {
        let z = -0.08 + 0.053 * i as f32;
        section.extend([[rim, z - 0.015], [rim - 0.03, z + 0.012]]);
    }
    section.extend([
        [rim, 0.1],
        [rim - 0.05, 0.1],
        [rim - 0.06, 0.02],
        [0.1, 0.02],
        [0.1, 0.06],
        [0.0, 0.06],
    ]);
    section
}
