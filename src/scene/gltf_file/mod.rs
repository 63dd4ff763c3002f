//! glTF 2.0 and GLB.

mod document;
mod material;
mod primitive;

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use glam::{DAffine3, DMat4};

use crate::error::{Error, Result, one_line};
use crate::scene::folder::Folder;
use crate::scene::{Object, Scene, Wrap, file, file_name};

/// The deepest nesting of nodes.
const MAX_DEPTH: usize = 256;

/// Loads the glTF or GLB file at `path`; textures that are missing become
/// warnings, missing geometry is an error.
pub(super) fn load(path: &Path, folder: &Folder) -> Result<Scene> {
    let bytes = file::read(path)?;
    let (document, blob) = document::read(path, &bytes)?;
    let mut loader = Loader {
        place: path.display().to_string(),
        folder,
        document: &document,
        buffers: Vec::new(),
        files: RefCell::new(vec![path.to_path_buf()]),
        scene: Scene { source: file_name(path), ..Scene::default() },
        materials: HashMap::new(),
        textures: HashMap::new(),
        meshes: HashMap::new(),
        seen: vec![false; document.nodes().len()],
        elements: 0,
        zeros: 0,
    };
    loader.buffers = loader.read_buffers(blob)?;
    let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) else {
        return Err(loader.bad("the file", "it has no scene", "give it one"));
    };
    for node in scene.nodes() {
        loader.node(&node, DMat4::IDENTITY, 0)?;
    }
    Ok(Scene { files: loader.files.into_inner(), ..loader.scene })
}

struct Loader<'a> {
    place: String,
    folder: &'a Folder,
    document: &'a gltf::Document,
    buffers: Vec<Cow<'a, [u8]>>,
    /// What has been read.
    files: RefCell<Vec<PathBuf>>,
    scene: Scene,
    /// By the file's number; `None` is glTF's default material.
    materials: HashMap<Option<usize>, usize>,
    /// By image and wrapping.
    textures: HashMap<(usize, [Wrap; 2]), Option<usize>>,
    /// The shapes of each mesh, one for each of its primitives.
    meshes: HashMap<usize, Vec<usize>>,
    /// Which nodes the scene has.
    seen: Vec<bool>,
    /// Vertex attributes and indices read so far, and zeros that no bytes stand for.
    elements: usize,
    zeros: usize,
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

    fn read_buffers(&self, blob: Option<Cow<'a, [u8]>>) -> Result<Vec<Cow<'a, [u8]>>> {
        let mut blob = blob;
        self.document
            .buffers()
            .map(|buffer| {
                let part = format!("buffer {}", buffer.index());
                let bytes = match buffer.source() {
                    gltf::buffer::Source::Bin => blob.take().ok_or_else(|| {
                        self.bad(&part, "its bytes are missing", "export the GLB again")
                    })?,
                    gltf::buffer::Source::Uri(uri) => Cow::Owned(self.resolve(uri, &part)?),
                };
                if bytes.len() < buffer.length() {
                    let what = format!("it has {} of {} bytes", bytes.len(), buffer.length());
                    return Err(self.bad(&part, what, "the file is truncated: export it again"));
                }
                Ok(bytes)
            })
            .collect()
    }

    fn node(&mut self, node: &gltf::Node<'_>, parent: DMat4, depth: usize) -> Result<()> {
        // Nodes that share children would be drawn 2^depth times, those in a circle
        // without end; glTF allows neither.
        let part = format!("node {}", node.index());
        if std::mem::replace(&mut self.seen[node.index()], true) {
            let what = "the scene has it twice: it has two parents, is listed twice, or is its own \
                        ancestor";
            return Err(self.bad(&part, what, "make the nodes a tree"));
        }
        if depth > MAX_DEPTH {
            let what = format_args!("nodes are nested more than {MAX_DEPTH} deep").to_string();
            return Err(self.bad(&part, what, "flatten the nodes"));
        }
        let place = parent
            * DMat4::from_cols_array_2d(&node.transform().matrix().map(|c| c.map(f64::from)));
        if let Some(mesh) = node.mesh() {
            let shapes = match self.meshes.get(&mesh.index()) {
                Some(shapes) => shapes.clone(),
                None => {
                    let shapes = self.mesh(&mesh)?;
                    self.meshes.insert(mesh.index(), shapes.clone());
                    shapes
                }
            };
            let name = node.name().or(mesh.name());
            let name = name.map_or(part, one_line);
            for shape in shapes {
                let place = DAffine3::from_mat4(place);
                self.scene.objects.push(Object { name: name.clone(), shape, place });
            }
        }
        for child in node.children() {
            self.node(&child, place, depth + 1)?;
        }
        Ok(())
    }
}
