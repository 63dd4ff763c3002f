//! Smooth noise for scenes.

use glam::Vec3;

use screendoor_trace::random::hash;

/// Noise in [−1, 1] that changes over a distance of about 1: random values on a
/// grid, joined smoothly.
pub(super) fn noise(seed: u32, p: Vec3) -> f32 {
    let cell = p.floor();
    let t = p - cell;
    // The first and second derivatives vanish at the grid points.
    let t = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let [x, y, z] = cell.to_array().map(|c| c as i32);
    let value = |dx: i32, dy: i32, dz: i32| {
        let at = [x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)];
        let [x, y, z] = at.map(|c| c as u32);
        (hash([seed, x, y, z]) >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |dy, dz| mix(value(0, dy, dz), value(1, dy, dz), t.x);
    let plane = |dz| mix(row(0, dz), row(1, dz), t.y);
    mix(plane(0), plane(1), t.z)
}

/// Noise with `octaves` of detail, each half as large and half as strong as the
/// one before; in [−1, 1].
pub(super) fn fractal(seed: u32, p: Vec3, octaves: u32) -> f32 {
    let (mut sum, mut total, mut strength, mut scale) = (0.0, 0.0, 1.0, 1.0);
    for octave in 0..octaves {
        sum += strength * noise(seed.wrapping_add(octave), p * scale);
        total += strength;
        strength *= 0.5;
        scale *= 2.0;
    }
    sum / total
}

/// Three noises as a vector.
pub(super) fn vector(seed: u32, p: Vec3) -> Vec3 {
    let part = |i: u32| noise(hash([seed, i]), p);
    Vec3::new(part(0), part(1), part(2))
}

/// A flow without sources or sinks: the curl of [`vector`].
pub(super) fn curl(seed: u32, p: Vec3) -> Vec3 {
    const STEP: f32 = 1.0 / 64.0;
    let slope =
        |axis: Vec3| (vector(seed, p + axis * STEP) - vector(seed, p - axis * STEP)) / (2.0 * STEP);
    let (dx, dy, dz) = (slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z));
    Vec3::new(dy.z - dz.y, dz.x - dx.z, dx.y - dy.x)
}

/// 0 below `low`, 1 above `high`, smooth between; falls where `low` > `high`.
pub(super) fn smooth(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_bounded_continuous_and_of_its_seed() {
        let at = |i: i32| Vec3::new(i as f32 * 0.037, i as f32 * -0.011, 0.4);
        for i in -200..200 {
            let value = noise(3, at(i));
            assert!(value.abs() <= 1.0);
            assert!((value - noise(3, at(i) + Vec3::X * 1e-4)).abs() < 1e-3);
        }
        assert_ne!(noise(3, at(7)), noise(4, at(7)));
    }

    #[test]
    fn smooth_rises_and_falls() {
        assert_eq!([-1.0, 0.5, 2.0].map(|x| smooth(0.0, 1.0, x)), [0.0, 0.5, 1.0]);
        assert_eq!([-1.0, 0.5, 2.0].map(|x| smooth(1.0, 0.0, x)), [1.0, 0.5, 0.0]);
    }
}
