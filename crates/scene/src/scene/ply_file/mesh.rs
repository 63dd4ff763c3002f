//! Meshes in PLY files: vertices with colours, normals and texture coordinates, and faces.

use std::path::Path;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

use super::content::File;
use super::{Element, Place};
use crate::scene::polygon::{Corner, Cutter};
use crate::scene::{AlphaMode, Material, Mesh, Scene, Shape, far, file_name};
use screendoor_trace::error::{Error, Result, one_line};
use screendoor_trace::picture::srgb;

/// Names that programs give a face's corners, texture coordinates and colours.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];
const UVS: [[&str; 2]; 4] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["tx", "ty"]];
const COLOURS: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];
const ALPHAS: [&str; 3] = ["alpha", "opacity", "a"];

/// The mesh of a file; `None` where there is no element of faces.
pub(super) fn scene(path: &Path, file: &File<'_>) -> Result<Option<Scene>> {
    let File { elements, textures } = file;
    let place = path.display().to_string();
    let find = |name: &str| elements.iter().find(|e| e.name == name);
    if find("tristrips").is_some() {
        let hint = "save it with faces";
        return Err(Error::unsupported(&place, "its triangles are in strips ('tristrips')", hint));
    }
    let (Some(vertices), Some(faces)) = (find("vertex"), find("face")) else { return Ok(None) };
    let corners = faces.lists().iter().find(|list| CORNERS.contains(&list.name.as_str()));
    let Some(corners) = corners else {
        let what = format_args!("its faces have no list '{}'", CORNERS.join("' or '"));
        return Err(Error::invalid(&place, what, "export it again"));
    };
    let Ok(positions) = vertices.columns(["x", "y", "z"]) else {
        return Err(Error::invalid(&place, "its vertices lack x, y or z", "export it again"));
    };
    let at = |i: usize| DVec3::from(positions.map(|column| vertices.value(i, column)));
    let origin = far::origin((0..vertices.count).map(at));
    let own = |i: usize| (at(i) - origin).as_vec3();
    let mut mesh = Mesh { positions: (0..vertices.count).map(own).collect(), ..Mesh::default() };
    let real = |i: usize, column: Place| vertices.value(i, column) as f32;
    if let Ok(normals) = vertices.columns(["nx", "ny", "nz"]) {
        // Exporters write such normals of flat triangles.
        let normal = |i| Some(Vec3::from(normals.map(|c| real(i, c)))).filter(|n| n.is_finite());
        mesh.normals = (0..vertices.count).map(|i| normal(i).unwrap_or(Vec3::NAN)).collect();
    }
    if let Some(uvs) = UVS.into_iter().find_map(|names| vertices.columns(names).ok()) {
        // PLY's writers count v upwards.
        let uv = |i| Vec2::new(real(i, uvs[0]), 1.0 - real(i, uvs[1]));
        mesh.uvs = (0..vertices.count).map(uv).collect();
    }
    let mut warnings = Vec::new();
    mesh.colours = colours(vertices, |what| warnings.push(format!("{place}: {what}")));

    let mut cutter = Cutter::default();
    let mut points = Vec::new();
    let mut few = 0;
    for (face, list) in corners.rows().enumerate() {
        let mut polygon = Vec::with_capacity(list.len());
        for index in list {
            let known = (0.0..vertices.count as f64).contains(index) && index.fract() == 0.0;
            if !known {
                let what = format!("it has {} vertices and names vertex {index}", vertices.count);
                let place = format!("{place}, face {face}");
                return Err(Error::invalid(place, what, "correct the indices"));
            }
            polygon.push(*index as usize);
        }
        few += usize::from(list.len() < 3);
        points.clear();
        points.extend(polygon.iter().map(|i| at(*i)));
        let triangles = cutter.triangulate(&points).map_err(|_| {
            let what = format!(
                "a face of {} corners that is not convex or, with those before, takes too long to cut",
                list.len()
            );
            let hint = "divide it into polygons of fewer corners";
            Error::unsupported(format!("{place}, face {face}"), what, hint)
        })?;
        for triangle in triangles {
            let corner = |corner| match corner {
                Corner::Own(i) => polygon[i] as u32,
                Corner::OnEdge(i, share) => {
                    let ends = [i, (i + 1) % polygon.len()].map(|i| polygon[i]);
                    between(&mut mesh, ends, share as f32)
                }
            };
            let triangle = triangle.map(corner);
            mesh.triangles.push(triangle);
        }
    }
    mesh.fill_normals();
    let see_through = mesh.colours.iter().any(|c| c.w < 1.0);
    let mut scene = Scene {
        source: file_name(path),
        files: vec![path.to_path_buf()],
        materials: vec![Material {
            name: "mesh".into(),
            alpha_mode: if see_through { AlphaMode::Blend } else { AlphaMode::Opaque },
            ..Material::default()
        }],
        warnings,
        ..Scene::default()
    };
    if few > 0 {
        let what = format!("{place}: {few} faces of fewer than three corners are not drawn");
        scene.warnings.push(what);
    }
    if COLOURS.iter().any(|names| faces.columns(*names).is_ok()) {
        let what = "its faces' own colours are not read; vertices' are";
        scene.warnings.push(format!("{place}: {what}"));
    }
    for list in faces.lists().iter().filter(|list| !CORNERS.contains(&list.name.as_str())) {
        let name = one_line(&list.name);
        let what = format!("what its faces say as '{name}' is not read; what vertices say is");
        scene.warnings.push(format!("{place}: {what}"));
    }
    for name in textures {
        let what = format!("its texture '{}' is not read: give it to the capture", one_line(name));
        scene.warnings.push(format!("{place}: {what}"));
    }
    scene.add("mesh", Shape::Mesh(mesh));
    scene.objects[0].place = DAffine3::from_translation(origin);
    Ok(Some(scene))
}

/// Linear colours and alphas; empty where there are none. Whole numbers are shares of the
/// greatest that their type holds, encoded as in pictures.
fn colours(vertices: &Element<'_>, mut warn: impl FnMut(&str)) -> Vec<Vec4> {
    let rgb = COLOURS.into_iter().find_map(|names| vertices.columns(names).ok());
    let alpha = ALPHAS.into_iter().find_map(|name| vertices.column(name));
    if rgb.is_none() && alpha.is_none() {
        return Vec::new();
    }
    // Wide integers and real numbers hold 0 to 255 too, as some programs write them.
    let most =
        |column: Place| (0..vertices.count).map(|i| vertices.value(i, column)).fold(0.0, f64::max);
    let wide = |column: &Place| {
        let (greatest, most) = (vertices.greatest(*column), most(*column));
        greatest == 1.0 && most > 1.0 || greatest > 65535.0 && most <= 255.0
    };
    let bytes = rgb.into_iter().flatten().chain(alpha).any(|column| wide(&column));
    if bytes {
        warn("its vertices' colours are taken for 0 to 255");
    }
    let share = |i: usize, column: Place| {
        let whole = if bytes { 255.0 } else { vertices.greatest(column) };
        (vertices.value(i, column) / whole).clamp(0.0, 1.0)
    };
    let colour = |i: usize| {
        let rgb = rgb.map_or([1.0; 3], |rgb| rgb.map(|c| srgb::decode(share(i, c)) as f32));
        Vec3::from(rgb).extend(alpha.map_or(1.0, |c| share(i, c) as f32))
    };
    (0..vertices.count).map(colour).collect()
}

/// Adds a vertex on the edge between two; its number.
fn between(mesh: &mut Mesh, [a, b]: [usize; 2], share: f32) -> u32 {
    mesh.positions.push(mesh.positions[a].lerp(mesh.positions[b], share));
    if !mesh.normals.is_empty() {
        mesh.normals.push(mesh.normals[a].lerp(mesh.normals[b], share));
    }
    if !mesh.uvs.is_empty() {
        mesh.uvs.push(mesh.uvs[a].lerp(mesh.uvs[b], share));
    }
    if !mesh.colours.is_empty() {
        mesh.colours.push(mesh.colours[a].lerp(mesh.colours[b], share));
    }
    mesh.positions.len() as u32 - 1
}
