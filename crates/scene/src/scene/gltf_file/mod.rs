//! glTF 2.0 and GLB.
//!
//! What is read, what is approximated and what is only told stands in
//! `docs/SCENES_GLTF.md`, whose rows the tests try one by one.

mod accessor;
mod document;
mod extensions;
mod json;
mod material;
mod pose;
mod primitive;
mod splats;
mod texture;
mod warnings;

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use glam::{DAffine3, DMat4};

use self::json::{Node, Root};
use self::material::Made;
use self::primitive::{Drawn, Posed};
use self::texture::TextureKey;
use self::warnings::{Matter, Warnings};
use crate::scene::folder::Folder;
use crate::scene::{FileCamera, Object, Scene, file, file_name};
use screendoor_trace::error::{Error, Result, one_line};

/// The deepest nesting of nodes.
const MAX_DEPTH: usize = 256;
/// The most objects of a file: one buffer of places can ask for any number of instances.
const MAX_OBJECTS: usize = 1 << 20;

/// Loads the glTF or GLB file at `path`; textures that are missing become
/// warnings, missing geometry is an error.
pub(super) fn load(path: &Path, folder: &Folder) -> Result<Scene> {
    let bytes = file::read(path)?;
    let (root, blob) = document::read(path, &bytes)?;
    let place = path.display().to_string();
    let mut loader = Loader {
        folder,
        root: &root,
        buffers: Vec::new(),
        files: RefCell::new(vec![path.to_path_buf()]),
        scene: Scene { source: file_name(path), ..Scene::default() },
        materials: HashMap::new(),
        textures: HashMap::new(),
        meshes: HashMap::new(),
        parents: pose::parents(&root),
        animated: pose::animated(&root),
        seen: vec![false; root.nodes.len()],
        warnings: Warnings::new(&place),
        animations: None,
        place,
        elements: 0,
        zeros: 0,
    };
    loader.buffers = loader.read_buffers(blob)?;
    loader.draw()?;
    let mut scene = loader.scene;
    scene.warnings.extend(loader.warnings.warnings());
    Ok(Scene { files: loader.files.into_inner(), ..scene })
}

struct Loader<'a> {
    place: String,
    folder: &'a Folder,
    root: &'a Root,
    /// `None` for a buffer that names no bytes: what is packed may have none of its own.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    /// What has been read.
    files: RefCell<Vec<PathBuf>>,
    scene: Scene,
    /// By the file's number; `None` is glTF's default material.
    materials: HashMap<Option<usize>, Made>,
    textures: HashMap<TextureKey, Result<usize, Matter>>,
    /// What is drawn of each mesh, one shape for each of its primitives.
    meshes: HashMap<Posed, Vec<Drawn>>,
    /// Each node's parent.
    parents: Vec<Option<usize>>,
    /// Which nodes animations move.
    animated: Vec<bool>,
    /// Which nodes the scene has.
    seen: Vec<bool>,
    /// What is not drawn.
    warnings: Warnings,
    /// That animations are not played, where there are any.
    animations: Option<Matter>,
    /// Vertex attributes and indices read so far, and zeros that no bytes stand for.
    elements: usize,
    zeros: usize,
}

/// What a node takes over from those above it.
#[derive(Clone, Copy)]
struct Above {
    place: DMat4,
    depth: usize,
    /// Whether an animation would move it.
    moved: bool,
}

impl<'a> Loader<'a> {
    fn bad(&self, part: &str, what: impl std::fmt::Display, hint: &str) -> Error {
        Error::invalid(format_args!("{}, {part}", self.place), what, hint)
    }

    /// The bytes that a URI names: in the URI itself, or in a file that the scene's folder
    /// lets it name.
    fn resolve(&self, uri: &str, part: &str) -> Result<Vec<u8>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let decoded = data
                .split_once(";base64,")
                .and_then(|(_, text)| base64::engine::general_purpose::STANDARD.decode(text).ok());
            return decoded.ok_or_else(|| {
                self.bad(part, "its data URI cannot be decoded", "encode it as base64")
            });
        }
        let decoded = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
        let read = self.folder.open(&decoded).and_then(|found| {
            self.files.borrow_mut().push(found.path.clone());
            found.read()
        });
        read.map_err(|e| self.bad(part, e, "put the file beside the scene"))
    }

    fn read_buffers(&self, blob: Option<Cow<'a, [u8]>>) -> Result<Vec<Option<Cow<'a, [u8]>>>> {
        let mut blob = blob;
        let buffers = self.root.buffers.iter().enumerate();
        buffers
            .map(|(i, buffer)| {
                let part = format!("buffer {i}");
                let bytes = match &buffer.uri {
                    None => match blob.take() {
                        None => return Ok(None),
                        Some(bytes) => bytes,
                    },
                    Some(uri) => Cow::Owned(self.resolve(uri, &part)?),
                };
                if bytes.len() < buffer.byte_length {
                    let what = format!("it has {} of {} bytes", bytes.len(), buffer.byte_length);
                    return Err(self.bad(&part, what, "the file is truncated: export it again"));
                }
                Ok(Some(bytes))
            })
            .collect()
    }

    /// Draws the default scene.
    fn draw(&mut self) -> Result<()> {
        let root = self.root;
        let Some(scene) = root.scenes.get(root.scene.unwrap_or(0)) else {
            let what = match root.scene {
                Some(_) if !root.scenes.is_empty() => "its default scene is not there",
                _ => "it has no scene",
            };
            return Err(self.bad("the file", what, "give it one"));
        };
        if root.scenes.len() > 1 {
            let name = one_line(scene.name.as_deref().unwrap_or(""));
            let what = format_args!("of its {} scenes only '{name}' is drawn", root.scenes.len());
            let others = self.warnings.matter_of("other scene", what);
            self.warnings.concerns([others], root.scenes.len() - 1);
        }
        self.warnings.extensions(scene.extensions.names());
        let played = match &root.animations[..] {
            [] => None,
            [one] => {
                let name = one_line(one.name.as_deref().unwrap_or(""));
                Some(format!("its animation '{name}' is not played"))
            }
            all => Some(format!("its {} animations are not played", all.len())),
        };
        self.animations = played.map(|what| self.warnings.matter(what));
        for index in &scene.nodes {
            let above = Above { place: DMat4::IDENTITY, depth: 0, moved: false };
            self.node(*index, above, "the scene")?;
        }
        // What is declared and stands nowhere that is drawn.
        self.warnings.extensions(root.extensions_used.iter().map(String::as_str));
        Ok(())
    }

    /// Draws a node, which `namer` names, and what is below it.
    fn node(&mut self, index: usize, above: Above, namer: &str) -> Result<()> {
        let Some(node) = self.root.nodes.get(index) else {
            let what = format!("it names node {index}, which is not there");
            return Err(self.bad(namer, what, "make the nodes a tree"));
        };
        // Nodes that share children would be drawn 2^depth times, those in a circle
        // without end; glTF allows neither.
        let part = format!("node {index}");
        if std::mem::replace(&mut self.seen[index], true) {
            let what = "the scene has it twice: it has two parents, is listed twice, or is its own \
                        ancestor";
            return Err(self.bad(&part, what, "make the nodes a tree"));
        }
        if above.depth > MAX_DEPTH {
            let what = format_args!("nodes are nested more than {MAX_DEPTH} deep").to_string();
            return Err(self.bad(&part, what, "flatten the nodes"));
        }
        let visibility: Option<json::Visibility> =
            self.said(&node.extensions, "KHR_node_visibility", &part)?;
        if visibility.and_then(|v| v.visible) == Some(false) {
            return Ok(());
        }
        let here = Above {
            place: above.place * pose::transform(node),
            depth: above.depth + 1,
            moved: above.moved || self.animated[index],
        };
        if let Some(camera) = node.camera.and_then(|i| self.root.cameras.get(i)) {
            let name = camera.name.as_deref().or(node.name.as_deref());
            self.scene.cameras.push(FileCamera {
                name: name.map_or(part.clone(), one_line),
                place: DAffine3::from_mat4(here.place),
                field_of_view: camera.perspective.as_ref().map(|p| p.yfov),
            });
        }
        if let Some(mesh) = node.mesh {
            self.place_mesh(mesh, index, node, here)?;
        }
        for child in &node.children {
            self.node(*child, here, &part)?;
        }
        Ok(())
    }

    /// Draws the mesh of a node.
    fn place_mesh(&mut self, mesh: usize, index: usize, node: &Node, here: Above) -> Result<()> {
        let part = format!("node {index}");
        let drawn = self.mesh(mesh, index, node)?;
        let mut matters = self.warnings.extensions(node.extensions.names());
        if here.moved || self.moves_by_skin(node) {
            matters.extend(self.animations);
        }
        let instances = self.instances(node, &part)?;
        let name = node.name.as_deref().or(self.root.meshes[mesh].name.as_deref());
        let name = name.map_or(part.clone(), one_line);
        for drawn in drawn {
            let (place, instances) = match &instances {
                // Where its joints are says where it stands.
                Some(all) if drawn.in_scene => {
                    let what = "the instances of a mesh with a skin are drawn as one";
                    let matter = self.warnings.matter(what);
                    self.warnings.concerns([matter], drawn.items.saturating_mul(all.len() - 1));
                    (DMat4::IDENTITY, None)
                }
                _ if drawn.in_scene => (DMat4::IDENTITY, None),
                instances => (here.place, instances.as_ref()),
            };
            let place = DAffine3::from_mat4(place);
            let count = instances.map_or(1, Vec::len);
            let all = matters.iter().chain(&drawn.matters).copied();
            self.warnings.concerns(all, drawn.items.saturating_mul(count));
            let Some(shape) = drawn.shape else { continue };
            if self.scene.objects.len() + count > MAX_OBJECTS {
                let what = format!("it has more than {MAX_OBJECTS} objects up to here");
                let place = format_args!("{}, {part}", self.place);
                return Err(Error::unsupported(place, what, "split the scene"));
            }
            match instances {
                None => self.scene.objects.push(Object { name: name.clone(), shape, place }),
                Some(instances) => {
                    let each = instances.iter().enumerate().map(|(i, instance)| Object {
                        name: format!("{name}, instance {i}"),
                        shape,
                        place: place * *instance,
                    });
                    self.scene.objects.extend(each);
                }
            }
        }
        Ok(())
    }

    /// What one of its parts says by an extension.
    fn said<T: serde::de::DeserializeOwned>(
        &self,
        extensions: &extensions::Extensions,
        name: &str,
        part: &str,
    ) -> Result<Option<T>> {
        extensions.get(name).map_err(|e| self.bad(part, e, "export the file again"))
    }
}
