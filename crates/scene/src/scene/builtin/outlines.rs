//! Lines that shapes are made along: outlines in the plane and curves in space.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

/// The direction at `turn` turns from the x axis towards the y axis.
pub(super) fn direction(turn: f32) -> Vec2 {
    let (sin, cos) = libm::sincosf(turn * TAU);
    Vec2::new(cos, sin)
}

/// A closed outline whose radius depends on the turn in [0, 1).
pub(super) fn radial(sides: usize, radius: impl Fn(f32) -> f32) -> Vec<Vec2> {
    let turn = |i: usize| i as f32 / sides as f32;
    (0..sides).map(|i| direction(turn(i)) * radius(turn(i))).collect()
}

/// A circle around the origin.
pub(super) fn circle(sides: usize, radius: f32) -> Vec<Vec2> {
    radial(sides, |_| radius)
}

/// The tight band around circles of (centre x, centre y, radius), as `sides`
/// points evenly along it.
pub(super) fn band(circles: &[[f32; 3]], sides: usize) -> Vec<Vec2> {
    let around = |&[x, y, radius]: &[f32; 3]| {
        circle(96, radius).into_iter().map(move |p| p + Vec2::new(x, y))
    };
    evenly(&convex_hull(circles.iter().flat_map(around).collect()), sides)
}

/// A rectangle around the origin with rounded corners, as [`band`] gives it.
pub(super) fn rounded(half: [f32; 2], corner: f32, sides: usize) -> Vec<Vec2> {
    let corner = corner.min(half[0]).min(half[1]);
    let [x, y] = half.map(|h| h - corner);
    band(&[[x, y, corner], [-x, y, corner], [-x, -y, corner], [x, -y, corner]], sides)
}

/// The corners of the convex hull, counter-clockwise (Andrew's monotone chain).
fn convex_hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = &Vec2>| {
        let mut kept: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = kept[..]
                && (b - a).perp_dot(*p - b) <= 0.0
            {
                kept.pop();
            }
            kept.push(*p);
        }
        // The last is the first of the other chain.
        kept.pop();
        kept
    };
    let mut hull = chain(&mut points.iter());
    hull.extend(chain(&mut points.iter().rev()));
    hull
}

/// `count` points at even distances along a closed line.
fn evenly(line: &[Vec2], count: usize) -> Vec<Vec2> {
    let next = |i: usize| line[(i + 1) % line.len()];
    let length: f32 = (0..line.len()).map(|i| line[i].distance(next(i))).sum();
    let mut points = Vec::with_capacity(count);
    let (mut edge, mut passed) = (0, 0.0);
    for k in 0..count {
        let target = length * k as f32 / count as f32;
        while edge + 1 < line.len() && passed + line[edge].distance(next(edge)) <= target {
            passed += line[edge].distance(next(edge));
            edge += 1;
        }
        let share = (target - passed) / line[edge].distance(next(edge)).max(f32::MIN_POSITIVE);
        points.push(line[edge].lerp(next(edge), share.clamp(0.0, 1.0)));
    }
    points
}

/// A smooth curve through points (Catmull and Rom), in `steps` pieces between
/// each two.
pub(super) fn curve(through: &[Vec3], steps: usize) -> Vec<Vec3> {
    let at = |i: usize| through[i.min(through.len() - 1)];
    let mut points = Vec::with_capacity(through.len() * steps);
    for i in 0..through.len() - 1 {
        let [a, b, c, d] = [at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2)];
        points.extend((0..steps).map(|k| {
            let t = k as f32 / steps as f32;
            let bend = (a * 2.0 - b * 5.0 + c * 4.0 - d) + (b * 3.0 - a - c * 3.0 + d) * t;
            (b * 2.0 + (c - a) * t + bend * (t * t)) * 0.5
        }));
    }
    points.push(at(through.len() - 1));
    points
}

/// A line with each piece cut into even parts no longer than `step`.
pub(super) fn cut<const N: usize>(line: &[[f32; N]], step: f32) -> Vec<[f32; N]> {
    let mut points = Vec::new();
    for pair in line.windows(2) {
        let squared: f32 = pair[0].iter().zip(pair[1]).map(|(a, b)| (a - b) * (a - b)).sum();
        let parts = (squared.sqrt() / step).ceil().max(1.0);
        points.extend((0..parts as usize).map(|k| {
            let t = k as f32 / parts;
            std::array::from_fn(|i| pair[0][i] + (pair[1][i] - pair[0][i]) * t)
        }));
    }
    points.extend(line.last());
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_and_curves_pass_where_they_should() {
        let belt = band(&[[0.0, 0.0, 1.0], [4.0, 0.0, 1.0]], 200);
        assert!(belt.iter().all(|p| p.y.abs() < 1.001 && p.x > -1.001 && p.x < 5.001));
        let steps: Vec<f32> = (0..200).map(|i| belt[i].distance(belt[(i + 1) % 200])).collect();
        assert!(steps.iter().all(|s| (s / steps[0] - 1.0).abs() < 0.02));
        let through = [Vec3::ZERO, Vec3::X, Vec3::ONE];
        let line = curve(&through, 5);
        assert_eq!([line[0], line[5], line[10]], through);
        assert_eq!(cut(&[[0.0], [1.0], [1.5]], 0.5), [[0.0], [0.5], [1.0], [1.5]]);
    }
}
