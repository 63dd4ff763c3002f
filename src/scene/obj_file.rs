//! Wavefront OBJ with MTL.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3, Vec4};

use crate::error::{Error, Result};
use crate::scene::{AlphaMode, Material, Mesh, Scene, Shape, Texture, TextureUse, file_name};

/// Loads the OBJ file at `path`; materials and textures that are missing become
/// warnings.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let file = File::open(path).map_err(|e| Error::io("read", path, e))?;
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let material_folder = folder.clone();
    let loaded = tobj::load_obj_buf(&mut BufReader::new(file), &options, move |name| {
        match File::open(material_folder.join(name)) {
            Ok(file) => tobj::load_mtl_buf(&mut BufReader::new(file)),
            Err(_) => Err(tobj::LoadError::OpenFileFailed),
        }
    });
    let (models, materials) = loaded.map_err(|e| explain(path, e))?;

    let mut scene = Scene { source: file_name(path), ..Scene::default() };
    let mut loader = Loader { folder, textures: HashMap::new() };
    match materials {
        Ok(materials) => {
            for material in &materials {
                let material = loader.material(material, &mut scene);
                scene.materials.push(material);
            }
        }
        Err(e) => scene.warnings.push(format!("{}: its materials: {e}", scene.source)),
    }
    let fallback = scene.materials.len();
    scene.materials.push(Material::default());
    for model in models {
        let mesh = model.mesh;
        let material = mesh.material_id.filter(|id| *id < fallback).unwrap_or(fallback);
        let triples = |v: &[f32]| v.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
        scene.add(
            model.name,
            Shape::Mesh(Mesh {
                positions: triples(&mesh.positions),
                normals: triples(&mesh.normals),
                // OBJ counts v upwards.
                uvs: mesh.texcoords.chunks_exact(2).map(|t| Vec2::new(t[0], 1.0 - t[1])).collect(),
                colours: triples(&mesh.vertex_color).into_iter().map(|c| c.extend(1.0)).collect(),
                triangles: mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
                material,
            }),
        );
    }
    Ok(scene)
}

struct Loader {
    folder: PathBuf,
    textures: HashMap<String, Option<usize>>,
}

impl Loader {
    fn material(&mut self, mtl: &tobj::Material, scene: &mut Scene) -> Material {
        let alpha = mtl.dissolve.unwrap_or(1.0);
        let base = Vec3::from(mtl.diffuse.unwrap_or([1.0; 3])).extend(alpha);
        let base_texture = self.texture(mtl.diffuse_texture.as_deref(), scene);
        let alpha_texture = match (&mtl.dissolve_texture, &mtl.diffuse_texture) {
            // The usual way to say that the colour texture's own alpha counts.
            (Some(alpha), Some(base)) if alpha == base => None,
            (alpha, _) => self.texture(alpha.as_deref(), scene),
        };
        let seen_through = alpha < 1.0
            || alpha_texture.is_some()
            || base_texture.is_some_and(|t| scene.textures[t.texture].has_alpha());
        Material {
            name: mtl.name.clone(),
            base: if base.is_finite() { base } else { Vec4::ONE },
            base_texture,
            alpha_texture,
            alpha_mode: if seen_through { AlphaMode::Blend } else { AlphaMode::Opaque },
            emissive: Vec3::from(mtl.emissive.unwrap_or([0.0; 3])),
            ..Material::default()
        }
    }

    /// The texture of an MTL map statement, whose last word is the file's name.
    fn texture(&mut self, statement: Option<&str>, scene: &mut Scene) -> Option<TextureUse> {
        let name = statement?.split_whitespace().last()?.replace('\\', "/");
        let index = match self.textures.get(&name) {
            Some(index) => *index,
            None => {
                let index = match Texture::read(&self.folder.join(&name)) {
                    Ok(texture) => {
                        scene.textures.push(texture);
                        Some(scene.textures.len() - 1)
                    }
                    Err(e) => {
                        scene.warnings.push(e.to_string());
                        None
                    }
                };
                self.textures.insert(name, index);
                index
            }
        };
        index.map(TextureUse::plain)
    }
}

/// The library's error with the line it is about, which the library does not say.
fn explain(path: &Path, error: tobj::LoadError) -> Error {
    let place = match find_line(path) {
        Some((number, line)) => format!("{}, line {number} ('{line}')", path.display()),
        None => path.display().to_string(),
    };
    Error::invalid(place, format_args!("the OBJ file cannot be read: {error}"), "correct it")
}

/// The first line with a number that is none, or a face that names a vertex that
/// is not there.
fn find_line(path: &Path) -> Option<(usize, String)> {
    let file = File::open(path).ok()?;
    let mut counts = HashMap::from([("v", 0_i64), ("vt", 0), ("vn", 0)]);
    for (i, line) in BufReader::new(file).split(b'\n').enumerate() {
        let line = String::from_utf8_lossy(&line.ok()?).trim().to_string();
        let mut words = line.split_whitespace();
        let keyword = words.next().unwrap_or("");
        let bad = match keyword {
            "v" | "vt" | "vn" => {
                *counts.get_mut(keyword)? += 1;
                words.clone().count() < 2 || words.any(|w| w.parse::<f32>().is_err())
            }
            "f" => words.any(|corner| {
                corner.split('/').zip(["v", "vt", "vn"]).any(|(index, kind)| {
                    !index.is_empty()
                        && index
                            .parse::<i64>()
                            .map_or(true, |index| index == 0 || index.abs() > counts[kind])
                })
            }),
            _ => false,
        };
        if bad {
            return Some((i + 1, line.chars().take(60).collect()));
        }
    }
    None
}
