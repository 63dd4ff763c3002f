//! A small cloth simulation: points held at their distances by moving them
//! (position-based dynamics), over a ball.
//!
//! Only the four basic operations and the square root are used, each point after
//! the other, so that every platform finds the same folds.

use glam::{Vec2, Vec3};

use crate::scene::builtin::outlines::direction;
use screendoor_trace::random::Stream;

/// A square sheet of (cells + 1)² points.
pub(super) struct Sheet {
    pub cells: usize,
    pub points: Vec<Vec3>,
}

impl Sheet {
    /// The number of the point in column `i` of row `j`.
    pub(super) fn at(&self, i: usize, j: usize) -> usize {
        j * (self.cells + 1) + i
    }
}

/// The ball that the sheets fall on; each lies a little above the one before.
const BALL: Vec3 = Vec3::new(0.0, 1.0, 0.0);
const RADIUS: f32 = 0.6;
const THICKNESS: f32 = 0.022;

/// What gravity adds to a point's move, in each step of 1/300 s.
const FALL: f32 = 9.8 / (300.0 * 300.0);
/// What air leaves of a point's move.
const DRAG: f32 = 0.994;
/// The share of its move that a point loses where it touches the ball.
const FRICTION: f32 = 0.25;
/// Steps on half as many cells, and then on all.
const COARSE_STEPS: usize = 420;
const FINE_STEPS: usize = 240;

/// Sheet `index` of `sheets` at rest, or nearly.
pub(super) fn drape(index: u32, sheets: u32, cells: usize, seed: u32) -> Sheet {
    let mut random = Stream::new([0xc107, seed, index]);
    // The lowest is the largest, so that every hem shows.
    let half = 1.4 - 0.5 * index as f32 / sheets as f32 + random.range(-0.04, 0.04);
    let turn = index as f32 * 0.107 + random.range(-0.02, 0.02);
    let offset = direction(random.unit()) * random.range(0.05, 0.25);
    let radius = RADIUS + THICKNESS * index as f32;
    let (x_axis, z_axis) = (direction(turn), direction(turn + 0.25));

    let coarse = cells / 2;
    let mut sheet = Sheet { cells: coarse, points: Vec::new() };
    for j in 0..=coarse {
        for i in 0..=coarse {
            let [u, v] = [i, j].map(|k| (k as f32 / coarse as f32 * 2.0 - 1.0) * half);
            let flat: Vec2 = offset + x_axis * u + z_axis * v;
            // No sheet is quite flat: that decides where its folds begin.
            let height = BALL.y + radius + 0.02 + random.range(0.0, 0.012);
            sheet.points.push(Vec3::new(flat.x, height, flat.y));
        }
    }
    settle(&mut sheet, 2.0 * half, radius, COARSE_STEPS);
    let mut sheet = refined(&sheet);
    settle(&mut sheet, 2.0 * half, radius, FINE_STEPS);
    sheet
}

/// Two points and the distance that they keep.
struct Link {
    ends: [usize; 2],
    length: f32,
    /// The share of an error that one step corrects.
    stiffness: f32,
}

/// A cell's sides, its diagonals, and pairs two cells apart that resist bending.
fn links(sheet: &Sheet, side: f32) -> Vec<Link> {
    let n = sheet.cells;
    let cell = side / n as f32;
    let diagonal = cell * std::f32::consts::SQRT_2;
    let kinds: [([isize; 2], f32, f32); 6] = [
        ([1, 0], cell, 1.0),
        ([0, 1], cell, 1.0),
        ([1, 1], diagonal, 0.25),
        ([1, -1], diagonal, 0.25),
        ([2, 0], 2.0 * cell, 0.03),
        ([0, 2], 2.0 * cell, 0.03),
    ];
    let inside = |i: usize, by: isize| i.checked_add_signed(by).filter(|i| *i <= n);
    let mut links = Vec::with_capacity(6 * sheet.points.len());
    for j in 0..=n {
        for i in 0..=n {
            links.extend(kinds.iter().filter_map(|([dx, dy], length, stiffness)| {
                let other = sheet.at(inside(i, *dx)?, inside(j, *dy)?);
                let ends = [sheet.at(i, j), other];
                Some(Link { ends, length: *length, stiffness: *stiffness })
            }));
        }
    }
    links
}

fn settle(sheet: &mut Sheet, side: f32, radius: f32, steps: usize) {
    let links = links(sheet, side);
    let points = &mut sheet.points;
    let mut before = points.clone();
    for _ in 0..steps {
        for (point, before) in points.iter_mut().zip(&mut before) {
            let moved = (*point - *before) * DRAG;
            *before = *point;
            *point += moved - Vec3::Y * FALL;
        }
        for Link { ends: [a, b], length, stiffness } in &links {
            let apart = points[*b] - points[*a];
            let distance = apart.length();
            let correction = apart * (0.5 * stiffness * (distance - length) / distance.max(1e-9));
            points[*a] += correction;
            points[*b] -= correction;
        }
        for (point, before) in points.iter_mut().zip(&mut before) {
            let out = *point - BALL;
            let distance = out.length();
            if distance < radius {
                *point = BALL + out * (radius / distance.max(1e-9));
                *before += (*point - *before) * FRICTION;
            }
        }
    }
}

/// The same sheet with twice as many cells along a side.
fn refined(sheet: &Sheet) -> Sheet {
    let cells = sheet.cells * 2;
    let mut points = Vec::with_capacity((cells + 1) * (cells + 1));
    for j in 0..=cells {
        for i in 0..=cells {
            let corner = |di: usize, dj: usize| sheet.points[sheet.at((i + di) / 2, (j + dj) / 2)];
            // An even column or row takes one point twice.
            let [di, dj] = [i % 2, j % 2];
            points.push((corner(0, 0) + corner(di, 0) + corner(0, dj) + corner(di, dj)) * 0.25);
        }
    }
    Sheet { cells, points }
}
