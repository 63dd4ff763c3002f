//! Real spherical harmonics up to degree 4, in the order and with the signs that splats have
//! them (Kerbl et al. 2023; degree 4: `nianticlabs/spz`).

use glam::DVec3;

/// The harmonics in the unit direction `d`: (degree + 1)² of them.
pub(super) fn basis(degree: u32, d: DVec3) -> [f64; 25] {
    let DVec3 { x, y, z } = d;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let mut b = [0.0; 25];
    b[0] = 0.282_094_791_773_878_14;
    if degree > 0 {
        const C: f64 = 0.488_602_511_902_919_9;
        b[1..4].copy_from_slice(&[-C * y, C * z, -C * x]);
    }
    if degree > 1 {
        b[4..9].copy_from_slice(&[
            1.092_548_430_592_079_2 * x * y,
            -1.092_548_430_592_079_2 * y * z,
            0.315_391_565_252_520_05 * (2.0 * zz - xx - yy),
            -1.092_548_430_592_079_2 * x * z,
            0.546_274_215_296_039_6 * (xx - yy),
        ]);
    }
    if degree > 2 {
        b[9..16].copy_from_slice(&[
            -0.590_043_589_926_643_5 * y * (3.0 * xx - yy),
            2.890_611_442_640_554 * x * y * z,
            -0.457_045_799_464_465_8 * y * (4.0 * zz - xx - yy),
            0.373_176_332_590_115_4 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
            -0.457_045_799_464_465_8 * x * (4.0 * zz - xx - yy),
            1.445_305_721_320_277 * z * (xx - yy),
            -0.590_043_589_926_643_5 * x * (xx - 3.0 * yy),
        ]);
    }
    if degree > 3 {
        b[16..25].copy_from_slice(&[
            2.503_342_941_796_704_6 * x * y * (xx - yy),
            -1.770_130_769_779_930_4 * y * z * (3.0 * xx - yy),
            0.946_174_695_757_560_1 * x * y * (7.0 * zz - 1.0),
            -0.669_046_543_557_289_2 * y * z * (7.0 * zz - 3.0),
            0.105_785_546_915_204_31 * (zz * (35.0 * zz - 30.0) + 3.0),
            -0.669_046_543_557_289_2 * x * z * (7.0 * zz - 3.0),
            0.473_087_347_878_780_04 * (xx - yy) * (7.0 * zz - 1.0),
            -1.770_130_769_779_930_4 * x * z * (xx - 3.0 * yy),
            0.625_835_735_449_176_1 * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy)),
        ]);
    }
    b
}

/// The colour of a splat with these coefficients, in its own space, in the direction of the basis.
pub(super) fn colour(coefficients: &[[f32; 3]], basis: &[f64; 25]) -> [f64; 3] {
    let mut sum = [0.5; 3];
    for (c, b) in coefficients.iter().zip(basis) {
        for (sum, c) in sum.iter_mut().zip(c) {
            *sum += b * f64::from(*c);
        }
    }
    sum.map(|v| v.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_harmonics_are_orthonormal() {
        // A rule that is exact far beyond degree 8: equal steps around, Gauss-Legendre by the
        // roots' own iteration from pole to pole.
        const N: usize = 12;
        let legendre = |t: f64| {
            let (mut a, mut b) = (1.0, t);
            for k in 2..=N {
                let k = k as f64;
                (a, b) = (b, ((2.0 * k - 1.0) * t * b - (k - 1.0) * a) / k);
            }
            (b, N as f64 * (t * b - a) / (t * t - 1.0))
        };
        let mut gram = [[0.0; 25]; 25];
        for i in 0..N {
            let mut t = libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (N as f64 + 0.5));
            for _ in 0..20 {
                let (p, slope) = legendre(t);
                t -= p / slope;
            }
            let (_, slope) = legendre(t);
            let weight = 2.0 / ((1.0 - t * t) * slope * slope);
            for j in 0..24 {
                let (sin, cos) = libm::sincos(f64::from(j) * std::f64::consts::TAU / 24.0);
                let r = (1.0 - t * t).sqrt();
                let b = basis(4, DVec3::new(r * cos, r * sin, t));
                let weight = weight * std::f64::consts::TAU / 24.0;
                for (row, x) in gram.iter_mut().zip(b) {
                    for (sum, y) in row.iter_mut().zip(b) {
                        *sum += weight * x * y;
                    }
                }
            }
        }
        for (i, row) in gram.iter().enumerate() {
            for (j, found) in row.iter().enumerate() {
                let wanted = f64::from(u8::from(i == j));
                assert!((found - wanted).abs() < 1e-9, "{i} {j}: {found}");
            }
        }
    }

    #[test]
    fn colours_are_not_below_0_and_may_be_above_1() {
        let basis = basis(0, DVec3::Z);
        let found = colour(&[[0.0, -9.0, 9.0]], &basis);
        assert_eq!(found[..2], [0.5, 0.0]);
        assert!(found[2] > 3.0);
    }
}
