//! Cem Yuksel's `.hair`: strands with thicknesses, transparencies and colours.
//!
//! The format: `cemyuksel.com/research/hairmodels`. A header of 128 bytes with defaults, then
//! those arrays of which it says that they are there. The text does not say whether
//! thicknesses are radii or diameters, nor what space colours are in: renderers take
//! diameters, and colours as they are shown.

use std::path::Path;

use glam::{Vec3, Vec4};

use crate::scene::bytes::Bytes;
use crate::scene::{AlphaMode, Material, Scene, Shape, Strands, View, file, file_name};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::picture::srgb;

/// The most points that are read.
const MAX_POINTS: usize = 1 << 26;
/// The bits of the arrays that a file may have.
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
const TRANSPARENCY: u32 = 8;
const COLOURS: u32 = 16;

/// Loads the `.hair` file at `path`.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    let mut bytes = Bytes::new(&place, &content);
    let head = Head::read(&mut bytes)?;
    let (mut strands, short) = head.strands(&mut bytes)?;
    let bad = |what: &str| Err(Error::invalid(&place, what, "export it again"));
    if strands.points.iter().any(|p| !p.is_finite()) {
        return bad("a point of its strands is not finite");
    }
    if !strands.radii.iter().all(|r| r.is_finite() && *r >= 0.0) {
        return bad("a thickness of its strands is none");
    }
    let see_through = strands.colours.iter().any(|c| c.w < 1.0);
    if strands.colours.iter().any(|c| !c.is_finite()) {
        return bad("a colour or transparency of its strands is not finite");
    }
    strands.material = 0;
    let mut scene = Scene {
        source: file_name(path),
        files: vec![path.to_path_buf()],
        materials: vec![Material {
            name: "hair".into(),
            alpha_mode: if see_through { AlphaMode::Blend } else { AlphaMode::Opaque },
            ..Material::default()
        }],
        view: View { background: [0.70, 0.72, 0.74], ..View::default() },
        ..Scene::default()
    };
    if short > 0 {
        let what = format!("{place}: {short} strands of a single point are not drawn");
        scene.warnings.push(what);
    }
    if bytes.left() > 0 {
        let what = format!("{place}: {} bytes after its arrays are not read", bytes.left());
        scene.warnings.push(what);
    }
    scene.add("hair", Shape::Strands(strands));
    Ok(scene)
}

/// What a file's header says.
struct Head {
    strands: usize,
    points: usize,
    arrays: u32,
    segments: u32,
    thickness: f32,
    transparency: f32,
    colour: [f32; 3],
}

impl Head {
    const LENGTH: usize = 128;
    const INFORMATION: usize = 88;

    fn read(bytes: &mut Bytes<'_>) -> Result<Self> {
        if bytes.left() < Self::LENGTH || bytes.take(4)? != b"HAIR" {
            return Err(bytes.bad("it does not begin with 'HAIR' and a header of 128 bytes"));
        }
        let (strands, points) = (bytes.u32()? as usize, bytes.u32()? as usize);
        let (arrays, segments) = (bytes.u32()?, bytes.u32()?);
        let (thickness, transparency) = (bytes.f32()?, bytes.f32()?);
        let colour = [bytes.f32()?, bytes.f32()?, bytes.f32()?];
        bytes.take(Self::INFORMATION)?;
        if arrays & POINTS == 0 {
            return Err(bytes.bad("it says that it has no points"));
        }
        if points > MAX_POINTS {
            let what = format_args!("it has {points} points, and {MAX_POINTS} are the most");
            return Err(bytes.unsupported(what, "thin the hair out"));
        }
        Ok(Head { strands, points, arrays, segments, thickness, transparency, colour })
    }

    /// The strands, and how many have a single point and are left out.
    fn strands(&self, bytes: &mut Bytes<'_>) -> Result<(Strands, usize)> {
        let has = |array: u32| self.arrays & array != 0;
        let segments: Option<&[u8]> =
            has(SEGMENTS).then(|| bytes.take(2 * self.strands)).transpose()?;
        let mut floats = |array: u32, count: usize| {
            let list = has(array).then(|| bytes.take(4 * count)).transpose()?;
            let number = |b: &[u8]| f32::from_le_bytes(b.try_into().expect("four bytes"));
            Ok(list.map(|list| list.chunks_exact(4).map(number).collect::<Vec<f32>>()))
        };
        let points = floats(POINTS, 3 * self.points)?.unwrap_or_default();
        let thickness = floats(THICKNESS, self.points)?;
        let transparency = floats(TRANSPARENCY, self.points)?;
        let colours = floats(COLOURS, 3 * self.points)?;

        let colour = |i: usize| {
            let own = colours.as_ref().map(|all| [all[3 * i], all[3 * i + 1], all[3 * i + 2]]);
            let linear = own.unwrap_or(self.colour).map(|c| {
                if c.is_nan() { c } else { srgb::decode(f64::from(c.clamp(0.0, 1.0))) as f32 }
            });
            let through = transparency.as_ref().map_or(self.transparency, |all| all[i]);
            Vec4::new(linear[0], linear[1], linear[2], 1.0 - through.clamp(0.0, 1.0))
        };
        let mut strands = Strands { starts: vec![0], ..Strands::default() };
        let (mut first, mut short) = (0_usize, 0);
        for strand in 0..self.strands {
            let count = 1 + match segments {
                Some(list) => {
                    usize::from(u16::from_le_bytes([list[2 * strand], list[2 * strand + 1]]))
                }
                None => self.segments as usize,
            };
            let end = first.checked_add(count).filter(|end| *end <= self.points);
            let Some(end) = end else {
                let what = format_args!("its strands have more than its {} points", self.points);
                return Err(bytes.bad(what));
            };
            if count < 2 {
                short += 1;
            } else {
                for i in first..end {
                    strands.points.push(Vec3::new(
                        points[3 * i],
                        points[3 * i + 1],
                        points[3 * i + 2],
                    ));
                    let thickness = thickness.as_ref().map_or(self.thickness, |all| all[i]);
                    strands.radii.push(thickness / 2.0);
                    strands.colours.push(colour(i));
                }
                strands.starts.push(strands.points.len() as u32);
            }
            first = end;
        }
        if first != self.points {
            let what = format_args!("its strands have {first} of its {} points", self.points);
            return Err(bytes.bad(what));
        }
        Ok((strands, short))
    }
}
