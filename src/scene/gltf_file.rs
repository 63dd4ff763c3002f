//! glTF 2.0 and GLB.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use base64::Engine as _;
use glam::{Affine2, DAffine3, DMat4, Vec2, Vec3, Vec4};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;

use crate::error::{Error, Result};
use crate::scene::{
    AlphaMode, Material, Mesh, Object, Scene, Shape, Texture, TextureUse, Wrap, file_name,
};

/// The most elements of an accessor that has no bytes behind it (a sparse one).
const MAX_SPARSE: usize = 1 << 24;
/// The deepest nesting of nodes; a file whose nodes form a cycle ends here.
const MAX_DEPTH: usize = 256;

/// Loads the glTF or GLB file at `path`; textures that are missing become
/// warnings, missing geometry is an error.
pub(super) fn load(path: &Path) -> Result<Scene> {
    let place = path.display().to_string();
    let bytes = read_file(path)?;
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).map_err(|e| {
        Error::invalid(&place, format_args!("it cannot be read as glTF: {e}"), "correct the file")
    })?;
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut loader = Loader {
        place,
        folder,
        buffers: Vec::new(),
        scene: Scene { source: file_name(path), ..Scene::default() },
        materials: HashMap::new(),
        textures: HashMap::new(),
        meshes: HashMap::new(),
    };
    loader.buffers = loader.read_buffers(&document, blob)?;
    let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) else {
        return Err(loader.bad("the file", "it has no scene", "give it one"));
    };
    for node in scene.nodes() {
        loader.node(&node, DMat4::IDENTITY, 0)?;
    }
    Ok(loader.scene)
}

fn read_file(path: &Path) -> Result<Vec<u8>> {
    let fail = |e| Error::io("read", path, e);
    if !std::fs::metadata(path).map_err(fail)?.is_file() {
        return Err(Error::config(
            format_args!("cannot read {}: it is no regular file", path.display()),
            "name a file",
        ));
    }
    std::fs::read(path).map_err(fail)
}

struct Loader {
    place: String,
    folder: PathBuf,
    buffers: Vec<Vec<u8>>,
    scene: Scene,
    /// By the file's number; `None` is glTF's default material.
    materials: HashMap<Option<usize>, usize>,
    /// By image and wrapping.
    textures: HashMap<(usize, [Wrap; 2]), Option<usize>>,
    /// The shapes of each mesh, one for each of its primitives.
    meshes: HashMap<usize, Vec<usize>>,
}

impl Loader {
    fn bad(&self, part: &str, what: impl std::fmt::Display, hint: &str) -> Error {
        Error::invalid(format_args!("{}, {part}", self.place), what, hint)
    }

    /// The bytes that a URI names: in the URI itself, or a file in or below the
    /// scene's own folder.
    fn resolve<'a>(&self, uri: &'a str, part: &str) -> Result<Cow<'a, [u8]>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let decoded = data
                .split_once(";base64,")
                .and_then(|(_, text)| base64::engine::general_purpose::STANDARD.decode(text).ok());
            return decoded.map(Cow::Owned).ok_or_else(|| {
                self.bad(part, "its data URI cannot be decoded", "encode it as base64")
            });
        }
        let decoded = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
        let relative = Path::new(&*decoded);
        let inside =
            relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if !inside || decoded.contains(':') {
            return Err(self.bad(
                part,
                format_args!("'{uri}' leads out of the scene's folder"),
                "put the file beside the scene and name it without '..'",
            ));
        }
        let bytes = read_file(&self.folder.join(relative));
        bytes.map(Cow::Owned).map_err(|e| self.bad(part, e, "put the file beside the scene"))
    }

    fn read_buffers(
        &self,
        document: &gltf::Document,
        blob: Option<Vec<u8>>,
    ) -> Result<Vec<Vec<u8>>> {
        let mut blob = blob;
        document
            .buffers()
            .map(|buffer| {
                let part = format!("buffer {}", buffer.index());
                let bytes = match buffer.source() {
                    gltf::buffer::Source::Bin => blob.take().ok_or_else(|| {
                        self.bad(&part, "its bytes are missing", "export the GLB again")
                    })?,
                    gltf::buffer::Source::Uri(uri) => self.resolve(uri, &part)?.into_owned(),
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
        if depth > MAX_DEPTH {
            let part = format!("node {}", node.index());
            let what = format_args!("nodes are nested more than {MAX_DEPTH} deep, or in a circle")
                .to_string();
            return Err(self.bad(&part, what, "make the nodes a tree"));
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
            let name = name.map_or_else(|| format!("node {}", node.index()), str::to_string);
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

    fn mesh(&mut self, mesh: &gltf::Mesh<'_>) -> Result<Vec<usize>> {
        let mut shapes = Vec::new();
        for primitive in mesh.primitives() {
            let part = format!("mesh {}, primitive {}", mesh.index(), primitive.index());
            if let Some(shape) = self.primitive(&primitive, &part)? {
                self.scene.shapes.push(Shape::Mesh(shape));
                shapes.push(self.scene.shapes.len() - 1);
            }
        }
        Ok(shapes)
    }

    fn primitive(&mut self, primitive: &gltf::Primitive<'_>, part: &str) -> Result<Option<Mesh>> {
        use DataType::{F32, U8, U16, U32};
        let material = primitive.material();
        let texture_set = material
            .pbr_metallic_roughness()
            .base_color_texture()
            .map(|t| t.texture_transform().and_then(|t| t.tex_coord()).unwrap_or(t.tex_coord()))
            .or(material.emissive_texture().map(|t| t.tex_coord()))
            .unwrap_or(0);
        for (semantic, accessor) in primitive.attributes() {
            let (dimensions, types): (&[Dimensions], &[DataType]) = match semantic {
                gltf::Semantic::Positions | gltf::Semantic::Normals => {
                    (&[Dimensions::Vec3], &[F32])
                }
                gltf::Semantic::TexCoords(_) => (&[Dimensions::Vec2], &[F32, U8, U16]),
                gltf::Semantic::Colors(_) => {
                    (&[Dimensions::Vec3, Dimensions::Vec4], &[F32, U8, U16])
                }
                _ => continue,
            };
            self.check(&accessor, dimensions, types, part)?;
        }
        if let Some(indices) = primitive.indices() {
            self.check(&indices, &[Dimensions::Scalar], &[U8, U16, U32], part)?;
        }

        let buffers = &self.buffers;
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let Some(positions) = reader.read_positions() else {
            return Err(self.bad(part, "it has no readable positions", "export the file again"));
        };
        let positions: Vec<Vec3> = positions.map(Vec3::from).collect();
        let normals = reader.read_normals().into_iter().flatten().map(Vec3::from).collect();
        let uvs = reader
            .read_tex_coords(texture_set)
            .into_iter()
            .flat_map(|t| t.into_f32())
            .map(Vec2::from)
            .collect();
        let colours = reader
            .read_colors(0)
            .into_iter()
            .flat_map(|c| c.into_rgba_f32())
            .map(Vec4::from)
            .collect();
        let indices: Vec<u32> = match (reader.read_indices(), primitive.indices()) {
            (Some(indices), _) => indices.into_u32().collect(),
            (None, None) => (0..positions.len() as u32).collect(),
            (None, Some(_)) => {
                return Err(self.bad(part, "its indices cannot be read", "export the file again"));
            }
        };
        let triangles = match primitive.mode() {
            Mode::Triangles => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            Mode::TriangleStrip => {
                let flip = |(i, t): (usize, &[u32])| {
                    if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }
                };
                indices.windows(3).enumerate().map(flip).collect()
            }
            Mode::TriangleFan => {
                indices.windows(2).skip(1).map(|t| [indices[0], t[0], t[1]]).collect()
            }
            mode => {
                let warning = format!("{}, {part}: {mode:?} are not drawn", self.place);
                self.scene.warnings.push(warning);
                return Ok(None);
            }
        };
        let material = self.material(&material)?;
        Ok(Some(Mesh { positions, normals, uvs, colours, triangles, material }))
    }

    /// Refuses an accessor that the reader would misread or run out of.
    fn check(
        &self,
        accessor: &gltf::Accessor<'_>,
        dimensions: &[Dimensions],
        types: &[DataType],
        part: &str,
    ) -> Result<()> {
        let part = format!("{part}, accessor {}", accessor.index());
        let bad = |what: &str| Err(self.bad(&part, what, "export the file again"));
        if !dimensions.contains(&accessor.dimensions()) || !types.contains(&accessor.data_type()) {
            return bad("its type is not one that glTF allows here");
        }
        let fits =
            |view: Option<gltf::buffer::View<'_>>, offset: usize, size: usize, count: usize| {
                let Some(view) = view else { return count <= MAX_SPARSE };
                let stride = view.stride().unwrap_or(size);
                let end = count
                    .checked_sub(1)
                    .and_then(|n| n.checked_mul(stride))
                    .and_then(|n| n.checked_add(size)?.checked_add(offset));
                let view_end = view.offset().checked_add(view.length());
                let bytes = self.buffers.get(view.buffer().index()).map_or(0, Vec::len);
                stride >= size
                    && end.is_some_and(|end| end <= view.length())
                    && view_end.is_some_and(|end| end <= bytes)
            };
        let count = accessor.count();
        if !fits(accessor.view(), accessor.offset(), accessor.size(), count) || count == 0 {
            return bad("it reaches beyond its buffer");
        }
        match accessor.sparse() {
            None if accessor.view().is_none() => bad("it has no data"),
            None => Ok(()),
            Some(sparse) => {
                let (indices, values, n) = (sparse.indices(), sparse.values(), sparse.count());
                let index_bytes = indices.index_type().size();
                let good = n <= count
                    && fits(Some(indices.view()), indices.offset(), index_bytes, n)
                    && fits(Some(values.view()), values.offset(), accessor.size(), n);
                if good { Ok(()) } else { bad("its sparse values reach beyond their buffer") }
            }
        }
    }

    fn material(&mut self, material: &gltf::Material<'_>) -> Result<usize> {
        if let Some(index) = self.materials.get(&material.index()) {
            return Ok(*index);
        }
        let pbr = material.pbr_metallic_roughness();
        let base_texture = match pbr.base_color_texture() {
            None => None,
            Some(info) => {
                let transform = info.texture_transform().map_or(Affine2::IDENTITY, |t| {
                    // The extension's own order: scale, then rotate, then move. Its
                    // rotation is counter-clockwise with v upwards, ours downwards.
                    Affine2::from_scale_angle_translation(
                        Vec2::from(t.scale()),
                        -t.rotation(),
                        Vec2::from(t.offset()),
                    )
                });
                let texture = self.texture(&info.texture())?;
                texture.map(|texture| TextureUse { texture, transform })
            }
        };
        let emissive_texture = match material.emissive_texture() {
            None => None,
            Some(info) => self.texture(&info.texture())?,
        };
        let emissive = if material.emissive_texture().is_some() && emissive_texture.is_none() {
            // The factor alone would flood the surface with the light that the
            // missing texture was to confine.
            Vec3::ZERO
        } else {
            Vec3::from(material.emissive_factor())
        };
        let made = Material {
            name: material.name().unwrap_or("").to_string(),
            base: Vec4::from(pbr.base_color_factor()),
            base_texture,
            alpha_texture: None,
            alpha_mode: match material.alpha_mode() {
                gltf::material::AlphaMode::Opaque => AlphaMode::Opaque,
                gltf::material::AlphaMode::Mask => {
                    AlphaMode::Mask { cutoff: material.alpha_cutoff().unwrap_or(0.5) }
                }
                gltf::material::AlphaMode::Blend => AlphaMode::Blend,
            },
            transmission: material.transmission().map_or(0.0, |t| t.transmission_factor()),
            double_sided: material.double_sided(),
            emissive,
            emissive_texture: emissive_texture.map(TextureUse::plain),
            unlit: material.unlit(),
        };
        self.scene.materials.push(made);
        let index = self.scene.materials.len() - 1;
        self.materials.insert(material.index(), index);
        Ok(index)
    }

    /// The scene's texture for a glTF texture; `None`, with a warning, where its
    /// image is missing.
    fn texture(&mut self, texture: &gltf::Texture<'_>) -> Result<Option<usize>> {
        let wrap = |mode| match mode {
            gltf::texture::WrappingMode::Repeat => Wrap::Repeat,
            gltf::texture::WrappingMode::MirroredRepeat => Wrap::Mirror,
            gltf::texture::WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let wrap = [wrap(texture.sampler().wrap_s()), wrap(texture.sampler().wrap_t())];
        let image = texture.source();
        let key = (image.index(), wrap);
        if let Some(index) = self.textures.get(&key) {
            return Ok(*index);
        }
        let part = format!("image {}", image.index());
        let bytes = match image.source() {
            gltf::image::Source::Uri { uri, .. } => self.resolve(uri, &part).map(Cow::into_owned),
            gltf::image::Source::View { view, .. } => {
                let buffer = self.buffers.get(view.buffer().index());
                let range = view.offset()..view.offset().saturating_add(view.length());
                buffer.and_then(|b| b.get(range)).map(<[u8]>::to_vec).ok_or_else(|| {
                    self.bad(&part, "it reaches beyond its buffer", "export the file again")
                })
            }
        };
        let place = format!("{}, {part}", self.place);
        let index = match bytes.and_then(|bytes| Texture::decode(&bytes, &place)) {
            Ok(texture) => {
                self.scene.textures.push(texture.wrapped(wrap));
                Some(self.scene.textures.len() - 1)
            }
            Err(e) => {
                self.scene.warnings.push(e.to_string());
                None
            }
        };
        self.textures.insert(key, index);
        Ok(index)
    }
}
