//! Splats in PlayCanvas' compressed PLY.
//!
//! The format: `developer.playcanvas.com`, Gaussian splatting, compressed PLY. An
//! element `chunk` for every 256 splats has the least and the greatest place,
//! logarithm of the scale, and colour; an element `vertex` has, packed into whole
//! numbers, where in between each splat lies; an element `sh`, where there is one, the
//! coefficients of its harmonics in a byte each, all of red first.

use glam::{Quat, Vec3};

use super::trained::rest;
use super::{Cloud, Stored, constant};
use crate::scene::ply_file::{Element, Place};
use screendoor_trace::error::{Error, Result};

/// How many splats share a chunk.
const CHUNK: usize = 256;

/// The splats; `None` where the elements are of another kind.
pub(in crate::scene) fn compressed(place: &str, elements: &[Element<'_>]) -> Result<Option<Cloud>> {
    let find = |name: &str| elements.iter().find(|e| e.name == name);
    let packed = match (find("chunk"), find("vertex")) {
        (Some(chunks), Some(vertices)) => Packed::new(chunks, vertices),
        _ => None,
    };
    let Some(packed) = packed else { return Ok(None) };
    let (splats, chunks) = (packed.vertices.count, packed.chunks.count);
    if splats.div_ceil(CHUNK) != chunks {
        let what = format_args!("it has {chunks} chunks of {CHUNK} for {splats} splats");
        return Err(Error::invalid(place, what, "export it again"));
    }
    let harmonics = find("sh").map(|of| Ok((of, rest(place, of)?))).transpose()?;
    if let Some((of, _)) = harmonics.as_ref().filter(|(of, _)| of.count != splats) {
        let what = format_args!("it has {splats} splats and harmonics of {}", of.count);
        return Err(Error::invalid(place, what, "export it again"));
    }
    let degree = harmonics.as_ref().map_or(0, |(_, (degree, _))| *degree);
    let mut cloud = Cloud::new(place, degree, splats);
    let mut list = Vec::new();
    for i in 0..splats {
        let (splat, colour) = packed.splat(i);
        list.clear();
        list.push(colour);
        if let Some((of, (_, columns))) = &harmonics {
            let each = columns.len() / 3;
            let value = |k: usize| harmonic(of.value(i, columns[k]));
            list.extend((0..each).map(|k| [0, 1, 2].map(|c| value(c * each + k))));
        }
        cloud.push(&splat, &list);
    }
    Ok(Some(cloud))
}

/// The coefficient of a byte: −4 to 4, of which the ends are exact.
fn harmonic(byte: f64) -> f32 {
    let share = match byte {
        0.0 => 0.0,
        255.0 => 1.0,
        v => (v + 0.5) / 256.0,
    };
    ((share - 0.5) * 8.0) as f32
}

/// The splats of a file.
struct Packed<'a> {
    chunks: &'a Element<'a>,
    vertices: &'a Element<'a>,
    /// The columns of the least and the greatest of each: places, scales, colours.
    places: [[Place; 3]; 2],
    scales: [[Place; 3]; 2],
    /// Older files have none: theirs lie in [0, 1].
    colours: Option<[[Place; 3]; 2]>,
    /// The columns of the packed place, rotation, scale and colour.
    packed: [Place; 4],
}

impl<'a> Packed<'a> {
    /// `None` where columns are missing.
    fn new(chunks: &'a Element<'a>, vertices: &'a Element<'a>) -> Option<Self> {
        let ends = |names: [&str; 3]| {
            let column = |end: &str, name: &str| chunks.column(&format!("{end}_{name}"));
            let ends = ["min", "max"].map(|end| names.map(|name| column(end, name)));
            let [[Some(a), Some(b), Some(c)], [Some(d), Some(e), Some(f)]] = ends else {
                return None;
            };
            Some([[a, b, c], [d, e, f]])
        };
        let word = |name: &str| {
            let column = vertices.column(&format!("packed_{name}"))?;
            (vertices.greatest(column) == f64::from(u32::MAX)).then_some(column)
        };
        let [Some(place), Some(rotation), Some(scale), Some(colour)] =
            ["position", "rotation", "scale", "color"].map(word)
        else {
            return None;
        };
        Some(Packed {
            chunks,
            vertices,
            places: ends(["x", "y", "z"])?,
            scales: ends(["scale_x", "scale_y", "scale_z"])?,
            colours: ends(["r", "g", "b"]),
            packed: [place, rotation, scale, colour],
        })
    }

    /// Splat `i`, and the constant harmonic's coefficients.
    fn splat(&self, i: usize) -> (Stored, [f32; 3]) {
        let [at, rotation, scale, colour] =
            self.packed.map(|column| self.vertices.value(i, column) as u32);
        let [r, g, b, opacity] = colour.to_be_bytes().map(|c| f32::from(c) / 255.0);
        let mean = self.between(i, Some(self.places), unpack_11_10_11(at));
        let scale = self.between(i, Some(self.scales), unpack_11_10_11(scale));
        let colour = self.between(i, self.colours, Vec3::new(r, g, b));
        let [x, y, z, w] = unpack_rotation(rotation).to_array();
        let splat = Stored {
            mean: mean.to_array().map(f64::from),
            scale: scale.to_array().map(|s| libm::exp(f64::from(s))),
            rotation: [w, x, y, z].map(f64::from),
            opacity: f64::from(opacity),
        };
        (splat, colour.to_array().map(|c| constant(f64::from(c))))
    }

    /// What lies at the share `t` between the ends that the chunk of splat `i` has.
    fn between(&self, i: usize, ends: Option<[[Place; 3]; 2]>, t: Vec3) -> Vec3 {
        let Some(ends) = ends else { return t };
        let [low, high] = ends.map(|columns| {
            Vec3::from(columns.map(|column| self.chunks.value(i / CHUNK, column) as f32))
        });
        low * (Vec3::ONE - t) + high * t
    }
}

/// The `bits` bits of a number from `shift` on, as a share of the greatest.
fn unorm(packed: u32, shift: u32, bits: u32) -> f32 {
    let greatest = (1 << bits) - 1;
    (packed >> shift & greatest) as f32 / greatest as f32
}

/// Three shares in 11, 10 and 11 bits, the first in the uppermost.
fn unpack_11_10_11(packed: u32) -> Vec3 {
    Vec3::new(unorm(packed, 21, 11), unorm(packed, 11, 10), unorm(packed, 0, 11))
}

/// A rotation: in two bits which part of the quaternion (w, x, y, z) is the
/// greatest and left out, then the others in their order in 10 bits each, from −√½
/// to √½.
fn unpack_rotation(packed: u32) -> Quat {
    let part = |shift| (unorm(packed, shift, 10) - 0.5) * std::f32::consts::SQRT_2;
    let [a, b, c] = [part(20), part(10), part(0)];
    let left_out = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    let [w, x, y, z] = match packed >> 30 {
        0 => [left_out, a, b, c],
        1 => [a, left_out, b, c],
        2 => [a, b, left_out, c],
        _ => [a, b, c, left_out],
    };
    Quat::from_xyzw(x, y, z, w).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_unpacked_from_the_uppermost_bits_on() {
        assert_eq!(unpack_11_10_11(0x7ff << 21), Vec3::X);
        assert_eq!(unpack_11_10_11(0x3ff << 11), Vec3::Y);
        assert_eq!(unpack_11_10_11(0x7ff), Vec3::Z);
    }

    #[test]
    fn rotations_leave_their_greatest_part_out() {
        // Half of 1023, rounded up: nearly 0.
        const ZERO: u32 = 512 << 20 | 512 << 10 | 512;
        let turned = [0, 1, 2, 3].map(|greatest| unpack_rotation(ZERO | greatest << 30));
        let wanted = [Quat::IDENTITY, Quat::from_xyzw(1.0, 0.0, 0.0, 0.0)];
        assert!(turned[0].abs_diff_eq(wanted[0], 2e-3), "{}", turned[0]);
        assert!(turned[1].abs_diff_eq(wanted[1], 2e-3), "{}", turned[1]);
        assert!(turned.iter().all(|q| q.is_normalized()));
        // Far out of range, as in a damaged file.
        assert!(unpack_rotation(0x3fff_ffff).is_normalized());
    }
}
