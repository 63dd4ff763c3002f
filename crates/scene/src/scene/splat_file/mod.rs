//! 3D Gaussian splats in PlayCanvas' compressed PLY.
//!
//! A splat becomes an ellipsoid that is seen as the rectangle around its outline,
//! with a Gaussian of its opacity for an alpha, cut off at √8 standard deviations, as
//! in PlayCanvas. Colours do not change with the direction they are seen from:
//! spherical harmonics beyond the constant are left out, with a warning. Colours are
//! taken from sRGB to linear light, where screendoor blends; the splats were trained
//! to be blended as encoded, so that see-through parts come out a little different.
//!
//! The format: `developer.playcanvas.com`, Gaussian splatting, compressed PLY. An
//! element `chunk` for every 256 splats has the least and the greatest place,
//! logarithm of the scale, and colour; an element `vertex` has, packed into whole
//! numbers, where in between each splat lies.

mod ply;

use std::path::Path;

use glam::{DAffine3, DVec3, Mat3, Quat, Vec3};
use ply_rs_bw::ply::ScalarType;

use self::ply::Element;
use crate::scene::bytes::Bytes;
use crate::scene::{
    AlphaMode, Material, Particles, Scene, Shape, TextureUse, View, file, file_name, sprite,
};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::picture::srgb;

/// How many splats share a chunk.
const CHUNK: usize = 256;
/// Where a splat ends, in standard deviations: √8.
const CUTOFF: f32 = 2.0 * std::f32::consts::SQRT_2;

/// Loads the compressed PLY file at `path`.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    let elements = ply::elements(&place, &content)?;
    let find = |name: &str| elements.iter().find(|e| e.name == name);
    let splats = match (find("chunk"), find("vertex")) {
        (Some(chunks), Some(vertices)) => Splats::new(chunks, vertices),
        _ => None,
    };
    let Some(splats) = splats else {
        return Err(ply::no_splats(&Bytes::new(&place, &content)));
    };
    if splats.vertices.count.div_ceil(CHUNK) != splats.chunks.count {
        let (vertices, chunks) = (splats.vertices.count, splats.chunks.count);
        let what = format_args!("it has {chunks} chunks of {CHUNK} for {vertices} splats");
        return Err(Error::invalid(&place, what, "export it again"));
    }

    let mut scene = Scene {
        source: file_name(path),
        files: vec![path.to_path_buf()],
        textures: vec![sprite::round(gaussian)],
        materials: vec![Material {
            name: "splats".into(),
            base_texture: Some(TextureUse::plain(0)),
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..Material::default()
        }],
        // Which side is the front, no file says.
        view: View { yaw: -30.0, pitch: 10.0, ..View::default() },
        ..Scene::default()
    };
    if find("sh").is_some() {
        let what = "its colours' changes with the direction of view are not read";
        scene.warnings.push(format!("{place}: {what}"));
    }
    scene.add("splats", Shape::Particles(splats.particles(&place)?));
    // Splats are trained with y downwards; viewers turn them about z.
    let half_turn = DVec3::new(-1.0, -1.0, 1.0);
    scene.objects[0].place = DAffine3::from_scale(half_turn);
    Ok(scene)
}

/// A splat's alpha over the distance from its middle, the cutoff being 1.
fn gaussian(distance: f32) -> f32 {
    libm::expf(-0.5 * CUTOFF * CUTOFF * distance * distance)
}

/// The splats of a file.
struct Splats<'a> {
    chunks: &'a Element<'a>,
    vertices: &'a Element<'a>,
    /// The columns of the least and the greatest of each: places, scales, colours.
    places: [[usize; 3]; 2],
    scales: [[usize; 3]; 2],
    /// Older files have none: theirs lie in [0, 1].
    colours: Option<[[usize; 3]; 2]>,
    /// The columns of the packed place, rotation, scale and colour.
    packed: [usize; 4],
}

impl<'a> Splats<'a> {
    /// `None` where columns are missing.
    fn new(chunks: &'a Element<'a>, vertices: &'a Element<'a>) -> Option<Self> {
        let column = |name: &str| chunks.column(name, &ScalarType::Float);
        let ends = |names: [&str; 3]| {
            let ends = ["min", "max"].map(|end| names.map(|name| column(&format!("{end}_{name}"))));
            let [[Some(a), Some(b), Some(c)], [Some(d), Some(e), Some(f)]] = ends else {
                return None;
            };
            Some([[a, b, c], [d, e, f]])
        };
        let packed = ["position", "rotation", "scale", "color"];
        let packed = packed.map(|n| vertices.column(&format!("packed_{n}"), &ScalarType::UInt));
        let [Some(place), Some(rotation), Some(scale), Some(colour)] = packed else { return None };
        Some(Splats {
            chunks,
            vertices,
            places: ends(["x", "y", "z"])?,
            scales: ends(["scale_x", "scale_y", "scale_z"])?,
            colours: ends(["r", "g", "b"]),
            packed: [place, rotation, scale, colour],
        })
    }

    fn particles(&self, place: &str) -> Result<Particles> {
        let mut particles = Particles::default();
        for i in 0..self.vertices.count {
            let [at, rotation, scale, colour] =
                self.packed.map(|column| u32::from_le_bytes(self.vertices.word(i, column)));
            let rgba = colour.to_be_bytes().map(|c| f32::from(c) / 255.0);
            let opacity = rgba[3];
            if opacity == 0.0 {
                continue;
            }
            let centre = self.between(i, Some(self.places), unpack_11_10_11(at));
            let log_scale = self.between(i, Some(self.scales), unpack_11_10_11(scale));
            let encoded = self.between(i, self.colours, Vec3::new(rgba[0], rgba[1], rgba[2]));
            let axes = CUTOFF * log_scale.map(libm::expf);
            if !(centre.is_finite() && axes.is_finite() && encoded.is_finite()) {
                let what = format_args!("its splat {i} has a size, place or colour not finite");
                return Err(Error::invalid(place, what, "export it again"));
            }
            let linear = encoded.map(|c| srgb::decode(f64::from(c.clamp(0.0, 1.0))) as f32);
            particles.centres.push(centre);
            particles.sizes.push(axes.max_element());
            particles.colours.push(linear.extend(opacity));
            particles
                .axes
                .push(Mat3::from_quat(unpack_rotation(rotation)) * Mat3::from_diagonal(axes));
        }
        Ok(particles)
    }

    /// What lies at the share `t` between the ends that the chunk of splat `i` has.
    fn between(&self, i: usize, ends: Option<[[usize; 3]; 2]>, t: Vec3) -> Vec3 {
        let Some(ends) = ends else { return t };
        let [low, high] = ends.map(|columns| {
            let word = |column| f32::from_le_bytes(self.chunks.word(i / CHUNK, column));
            Vec3::from_array(columns.map(word))
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
