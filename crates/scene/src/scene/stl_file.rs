//! STL: triangles, in bytes or as text. Normals follow from the corners; colours, of which
//! there are several habits and no text, are not read.

use std::path::Path;

use glam::{DAffine3, DVec3};

use crate::scene::bytes::Bytes;
use crate::scene::{Material, Mesh, Scene, Shape, far, file, file_name};
use screendoor_trace::error::Result;

/// Bytes before the number of triangles, and of a triangle.
const HEAD: usize = 80;
const TRIANGLE: usize = 50;

/// Loads the STL file at `path`.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    let mut bytes = Bytes::new(&place, &content);
    // Programs begin files of bytes with 'solid' too: their length tells them apart.
    let count =
        content.get(HEAD..HEAD + 4).map(|b| u32::from_le_bytes(b.try_into().expect("four")));
    let length = |count: u32| (HEAD + 4) as u64 + u64::from(count) * TRIANGLE as u64;
    let is_bytes = count.is_some_and(|count| length(count) == content.len() as u64);
    let mut coloured = 0;
    let corners = match (is_bytes, content.trim_ascii_start().starts_with(b"solid")) {
        (true, _) => {
            bytes.seek((HEAD + 4) as u64)?;
            let mut corners = Vec::new();
            while bytes.left() > 0 {
                bytes.take(12)?;
                for _ in 0..3 {
                    corners.push(DVec3::new(
                        bytes.f32()?.into(),
                        bytes.f32()?.into(),
                        bytes.f32()?.into(),
                    ));
                }
                coloured += usize::from(bytes.take(2)? != [0, 0]);
            }
            corners
        }
        // Text has none of these; bytes that begin like it and are cut short do.
        (false, true) if !content.contains(&0) => text(&bytes, &content)?,
        (false, _) => {
            let what = match count {
                Some(count) => format!("its {count} triangles take {} bytes", length(count)),
                None => "it is shorter than a header".to_string(),
            };
            return Err(bytes.bad(format_args!("{what}, and it has {}", content.len())));
        }
    };
    let origin = far::origin(corners.iter().copied());
    let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let mesh = Mesh {
        positions: corners.iter().map(|c| (*c - origin).as_vec3()).collect(),
        triangles: triangles.collect(),
        ..Mesh::default()
    };
    let mut scene = Scene {
        source: file_name(path),
        files: vec![path.to_path_buf()],
        materials: vec![Material { double_sided: true, ..Material::default() }],
        ..Scene::default()
    };
    if coloured > 0 {
        let what = format!("{place}: what {coloured} triangles say of colours is not read");
        scene.warnings.push(what);
    }
    scene.add("mesh", Shape::Mesh(mesh));
    scene.objects[0].place = DAffine3::from_translation(origin);
    Ok(scene)
}

/// The corners of triangles in text: of facets of three corners each, of all solids.
fn text(bytes: &Bytes<'_>, content: &[u8]) -> Result<Vec<DVec3>> {
    let text = String::from_utf8_lossy(content);
    // A solid's name is any text, before its facets and behind them.
    let named = |line: &&str| {
        let line = line.trim_start();
        !line.starts_with("solid") && !line.starts_with("endsolid")
    };
    let ended = text.lines().rfind(|line| !line.trim().is_empty());
    if !ended.is_some_and(|line| line.trim_start().starts_with("endsolid")) {
        return Err(bytes.bad("it does not end with 'endsolid'"));
    }
    let mut words = text.lines().filter(named).flat_map(str::split_ascii_whitespace);
    let mut corners = Vec::new();
    let mut facet = None;
    while let Some(word) = words.next() {
        match word {
            "facet" => facet = Some(corners.len()),
            "endfacet" => {
                let own = facet.take().map_or(0, |first| corners.len() - first);
                if own != 3 {
                    return Err(bytes.bad(format_args!("a facet of it has {own} corners")));
                }
            }
            "vertex" if facet.is_none() => {
                return Err(bytes.bad("a vertex of it stands in no facet"));
            }
            "vertex" => {
                let mut number = || {
                    let word = words.next().unwrap_or("");
                    word.parse::<f64>().map_err(|_| {
                        let few: String = word.chars().take(20).collect();
                        bytes.bad(format_args!(
                            "at a vertex stands '{few}' where a number is needed"
                        ))
                    })
                };
                corners.push(DVec3::new(number()?, number()?, number()?));
            }
            _ => {}
        }
    }
    if facet.is_some() {
        return Err(bytes.bad("a facet of it does not end"));
    }
    Ok(corners)
}
