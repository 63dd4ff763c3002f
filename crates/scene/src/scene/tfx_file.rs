//! TressFX 4 hair: strands of as many points each.
//!
//! The format: TressFX 4.0, `TressFXFileFormat.h`. A header of 160 bytes, then the
//! points as four floats each: a place, and a number for the simulation of hair that
//! is not used here.

use std::path::Path;

use glam::{Vec3, Vec4};

use crate::scene::bytes::Bytes;
use crate::scene::lines::SHARE;
use crate::scene::{Material, Scene, Shape, Strands, View, file, file_name};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::random::Stream;

/// The file says nothing of these: brown, half see-through.
const COLOUR: [f32; 3] = [0.22, 0.10, 0.045];
const ALPHA: f32 = 0.5;
/// How much thinner a strand's tip is than its root.
const TIP: f32 = 0.4;
/// The most points that are read.
const MAX_POINTS: usize = 1 << 26;

/// Loads the TressFX file at `path`.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    let mut bytes = Bytes::new(&place, &content);
    let head = Head::read(&mut bytes)?;
    let mut scene = Scene {
        source: file_name(path),
        files: vec![path.to_path_buf()],
        materials: vec![Material::diffuse("hair", [1.0; 3], ALPHA)],
        view: View { background: [0.70, 0.72, 0.74], ..View::default() },
        ..Scene::default()
    };
    for (offset, what) in [(head.thickness, "thicknesses"), (head.colours, "colours")] {
        if offset != 0 {
            let drawn = "all strands are drawn as brown ones of one width";
            scene.warnings.push(format!("{place}: its {what} are not read: {drawn}"));
        }
    }

    bytes.seek(u64::from(head.points))?;
    let (count, along) = (head.strands as usize, head.points_per_strand as usize);
    let mut points = Vec::new();
    for _ in 0..count * along {
        points.push(Vec3::new(bytes.f32()?, bytes.f32()?, bytes.f32()?));
        bytes.f32()?;
    }
    let finite = || points.iter().copied().filter(|p| p.is_finite());
    let (low, high) = (finite().fold(Vec3::MAX, Vec3::min), finite().fold(Vec3::MIN, Vec3::max));
    let radius = SHARE / 2.0 * (high - low).length();
    if !(radius.is_normal() && radius > 0.0) {
        let what = "its strands have no finite length";
        return Err(Error::invalid(&place, what, "export it again"));
    }
    let thickness = |k: usize| 1.0 - (1.0 - TIP) * k as f32 / (along - 1) as f32;
    let strands = Strands {
        radii: (0..points.len()).map(|i| radius * thickness(i % along)).collect(),
        colours: (0..head.strands).map(colour).collect(),
        starts: (0..=count).map(|i| (i * along) as u32).collect(),
        points,
        material: 0,
    };
    scene.add("hair", Shape::Strands(strands));
    Ok(scene)
}

/// A strand's colour: none is quite as its neighbours.
fn colour(strand: u32) -> Vec4 {
    let tone = Stream::new([0x7f4, strand]).range(0.6, 1.4);
    (Vec3::from(COLOUR) * tone).extend(1.0)
}

/// What a file's header says.
struct Head {
    strands: u32,
    points_per_strand: u32,
    /// Where things begin, counted from the file's beginning; 0 where there are none.
    points: u32,
    thickness: u32,
    colours: u32,
}

impl Head {
    const LENGTH: usize = 160;

    fn read(bytes: &mut Bytes) -> Result<Self> {
        if bytes.left() < Self::LENGTH {
            return Err(bytes.bad("it is shorter than the header of a TressFX file"));
        }
        let version = bytes.f32()?;
        if version != 4.0 {
            let what = format_args!("it is of TressFX version {version}, and 4 is read");
            return Err(bytes.unsupported(what, "export it with TressFX 4"));
        }
        let (strands, points_per_strand, points) = (bytes.u32()?, bytes.u32()?, bytes.u32()?);
        let (_strand_uvs, _point_uvs) = (bytes.u32()?, bytes.u32()?);
        let (thickness, colours) = (bytes.u32()?, bytes.u32()?);
        let head = Head { strands, points_per_strand, points, thickness, colours };
        if strands == 0 || points_per_strand < 2 {
            let what = format_args!("it has {strands} strands of {points_per_strand} points");
            return Err(bytes.bad(what));
        }
        if (points as usize) < Self::LENGTH {
            return Err(bytes.bad("its points lie in its header"));
        }
        let total = u64::from(strands) * u64::from(points_per_strand);
        if total > MAX_POINTS as u64 {
            let what = format_args!("it has {total} points, and {MAX_POINTS} are the most");
            return Err(bytes.unsupported(what, "thin the hair out"));
        }
        Ok(head)
    }
}
