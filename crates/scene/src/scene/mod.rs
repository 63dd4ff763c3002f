//! Scenes: triangles, strands and particles with their materials, from files
//! and from built-in generators.
//!
//! A scene knows nothing of pixels. [`load`] takes either the name of a file
//! (OBJ, glTF, GLB, PLY, STL, OpenVDB, hair, Gaussian splats) or `builtin:NAME`.

mod axes;
pub mod builtin;
mod bytes;
mod check;
mod far;
pub(crate) mod file;
mod folder;
mod format;
mod gltf_file;
mod hair_file;
mod image_file;
mod lines;
mod material;
mod obj_file;
mod ply_file;
mod polygon;
mod sampling;
mod shape;
mod source;
mod splat_file;
mod splats;
mod sprite;
mod stl_file;
mod texture;
mod tfx_file;
mod vdb_file;

pub use format::{endings, is_scene};
pub use source::{check, meant_builtin, path_of, seen_from};

use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3, Vec3};

pub use axes::Axes;
pub use material::{AlphaMode, Material, TextureUse};
pub use sampling::{Filter, Sampling, Wrap};
pub use shape::{Mesh, Particles, Shape, Strands};
pub use splats::Splats;
pub use texture::Texture;

use crate::scene::folder::Folder;
use crate::scene::format::{Up, format_of};
use crate::scene::source::{BUILTIN, no_builtin, no_scene};
use screendoor_trace::error::{Error, Result};

/// The most texels of all textures of a scene that were read from files: 11 bytes
/// each when loaded.
const MAX_TEXELS: u64 = 1 << 28;

/// A scene: objects that draw shapes with materials.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Where it comes from: a file's name, or a built-in with its parameters.
    pub source: String,
    /// Objects in API order.
    pub objects: Vec<Object>,
    /// What the objects place.
    pub shapes: Vec<Shape>,
    /// What the shapes are made of; never empty in a loaded scene.
    pub materials: Vec<Material>,
    /// What the materials show.
    pub textures: Vec<Texture>,
    /// From where it is best seen.
    pub view: View,
    /// The cameras that its file has.
    pub cameras: Vec<FileCamera>,
    /// From the space of its file, in which cameras given beside it stand, to the scene's.
    pub world: DAffine3,
    /// Which way its file has up, by habit.
    pub axes: Axes,
    /// The files that it was read from.
    pub files: Vec<PathBuf>,
    /// What could not be honoured, for the user to know.
    pub warnings: Vec<String>,
}

/// A camera that a scene's file has.
#[derive(Clone, Debug)]
pub struct FileCamera {
    /// Its name, for people.
    pub name: String,
    /// From its own space, where it looks along −z with y up, to that of the file.
    pub place: DAffine3,
    /// From top to bottom, in radians; `None` where its lines of sight are parallel.
    pub field_of_view: Option<f64>,
}

/// A shape at its place in the scene.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its name, for people.
    pub name: String,
    /// Which of [`Scene::shapes`].
    pub shape: usize,
    /// From the shape's space to the scene's.
    pub place: DAffine3,
}

/// From where a scene is best seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Degrees that the camera stands to the right of the scene's front (+z).
    pub yaw: f64,
    /// Degrees that it stands above the horizontal.
    pub pitch: f64,
    /// Whether parallel lines stay parallel.
    pub orthographic: bool,
    /// Linear colour behind the scene.
    pub background: [f32; 3],
    /// What the frame shows, where it is not the whole scene: the half-extents
    /// of a centred rectangle in the plane facing the camera.
    pub frame: Option<[f64; 2]>,
}

impl Default for View {
    fn default() -> Self {
        View { yaw: 30.0, pitch: 20.0, orthographic: false, background: [0.0; 3], frame: None }
    }
}

impl View {
    /// Straight from the front along parallel lines, onto a square from −1 to 1,
    /// before black: for pictures rather than things.
    pub const FRONT: View = View {
        yaw: 0.0,
        pitch: 0.0,
        orthographic: true,
        background: [0.0; 3],
        frame: Some([1.0, 1.0]),
    };
}

impl Scene {
    /// How many triangles and splats it draws.
    pub fn primitive_count(&self) -> usize {
        self.objects.iter().map(|o| self.shapes[o.shape].primitive_count()).sum()
    }

    /// Whether it has splats.
    pub fn has_splats(&self) -> bool {
        self.shapes.iter().any(|shape| matches!(shape, Shape::Splats(_)))
    }

    /// Whether it has nothing else.
    pub(crate) fn is_all_splats(&self) -> bool {
        self.shapes.iter().all(|shape| matches!(shape, Shape::Splats(_)))
    }

    /// All points that bound the scene, each with a radius around it.
    pub fn bounding_points(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        self.placed_points(Shape::bounding_points)
    }

    /// Those of what is no splat.
    pub(crate) fn solid_points(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        self.placed_points(|shape| match shape {
            Shape::Splats(_) => Box::new(std::iter::empty()),
            other => other.bounding_points(),
        })
    }

    /// Those of splats: the means of what shows something, and how far it reaches around.
    pub(crate) fn splat_points(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        self.placed_points(|shape| match shape {
            Shape::Splats(_) => shape.bounding_points(),
            _ => Box::new(std::iter::empty()),
        })
    }

    /// Those of them that a camera has in its frame.
    pub fn framed_points(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        self.placed_points(Shape::framed_points)
    }

    fn placed_points<'a>(
        &'a self,
        points: impl Fn(&'a Shape) -> Box<dyn Iterator<Item = (Vec3, f32)> + 'a> + 'a,
    ) -> impl Iterator<Item = (DVec3, f64)> + 'a {
        self.objects.iter().flat_map(move |object| {
            // The largest stretch of any direction bounds how a radius grows.
            let matrix = object.place.matrix3;
            let stretch = matrix.x_axis.length().max(matrix.y_axis.length());
            let stretch = stretch.max(matrix.z_axis.length());
            points(&self.shapes[object.shape]).map(move |(point, radius)| {
                (object.place.transform_point3(point.as_dvec3()), f64::from(radius) * stretch)
            })
        })
    }

    /// Adds a shape and an object that places it as it is.
    pub fn add(&mut self, name: impl Into<String>, shape: Shape) {
        self.objects.push(Object {
            name: name.into(),
            shape: self.shapes.len(),
            place: DAffine3::IDENTITY,
        });
        self.shapes.push(shape);
    }

    /// Adds a texture that was read; its number.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the scene's textures then had more than
    /// [`MAX_TEXELS`] texels together.
    fn add_texture(&mut self, texture: Texture) -> Result<usize> {
        let size = |t: &Texture| u64::from(t.width()) * u64::from(t.height());
        if self.textures.iter().map(size).sum::<u64>() + size(&texture) > MAX_TEXELS {
            let what = format!("its textures have more than {MAX_TEXELS} texels together");
            return Err(Error::unsupported(&self.source, what, "scale them down"));
        }
        self.textures.push(texture);
        Ok(self.textures.len() - 1)
    }

    /// Puts the texture in the file at `path` on every material that has none;
    /// where it has an alpha, those materials show it.
    ///
    /// # Errors
    /// As [`Texture::read`], and where the scene's textures become too large
    /// together.
    pub fn apply_texture(&mut self, path: &Path) -> Result<()> {
        let texture = Texture::read(path)?;
        self.files.push(path.to_path_buf());
        if self.is_all_splats() {
            let what = "splats show no texture: it changes nothing";
            self.warnings.push(format!("{}: {what}", path.display()));
        }
        let has_alpha = texture.has_alpha();
        let texture = self.add_texture(texture)?;
        for material in self.materials.iter_mut().filter(|m| m.base_texture.is_none()) {
            material.base_texture = Some(TextureUse::plain(texture));
            if has_alpha && material.alpha_mode == AlphaMode::Opaque {
                material.alpha_mode = AlphaMode::Blend;
            }
        }
        Ok(())
    }

    /// Makes every surface white, keeping alphas: the untextured models of the
    /// publications.
    pub fn whiten(&mut self) {
        for material in &mut self.materials {
            material.base = Vec3::ONE.extend(material.base.w);
            material.emissive = Vec3::ZERO;
        }
        let materials = self.materials.iter();
        let data: Vec<usize> = materials
            .flat_map(|m| [m.alpha_texture, m.transmission_texture])
            .flatten()
            .map(|used| used.texture)
            .collect();
        for (i, texture) in self.textures.iter_mut().enumerate() {
            // What is no colour stays what it is.
            if !data.contains(&i) {
                texture.whiten();
            }
        }
        for shape in &mut self.shapes {
            let colours = match shape {
                Shape::Mesh(mesh) => &mut mesh.colours,
                Shape::Strands(strands) => &mut strands.colours,
                Shape::Particles(particles) => &mut particles.colours,
                Shape::Splats(splats) => {
                    splats.whiten();
                    continue;
                }
            };
            colours.iter_mut().for_each(|c| *c = Vec3::ONE.extend(c.w));
        }
    }
}

/// How a scene is loaded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Which grid of a volume to draw; where none is named, its densities.
    pub grid: Option<String>,
    /// Whether a scene's file may name files outside its own folder.
    pub allow_outside: bool,
    /// Which way is up in a file that does not say; where not given, as its format has it by
    /// habit.
    pub axes: Option<Axes>,
    /// How wide lines are drawn, in the scene's units. Where not given, lines beside surfaces
    /// are not drawn, and others as wide as suits their extent.
    pub line_width: Option<f64>,
}

/// Loads the scene that `source` names, as [`load_with`] does without options.
///
/// # Errors
/// As [`load_with`].
pub fn load(source: &str) -> Result<Scene> {
    load_with(source, &LoadOptions::default())
}

/// Loads the scene that `source` names: `builtin:NAME[:key=value,…]`, or a file
/// whose ending says its format. Nothing outside the file's folder is opened.
///
/// # Errors
/// [`Error::Config`] for an unknown built-in or ending, a grid that is not there, or a width of
/// lines where there are none,
/// [`Error::Io`] where the file cannot be read, [`Error::Invalid`] where it is damaged or
/// holds nothing to draw.
pub fn load_with(source: &str, options: &LoadOptions) -> Result<Scene> {
    let format = path_of(source).and_then(format_of);
    if options.grid.is_some() && format.is_none_or(|format| format.ending != "vdb") {
        let what = format_args!("'{source}' has no grids to choose from");
        return Err(Error::config(what, "leave --grid out, or give a .vdb file"));
    }
    if options.axes.is_some() && format.is_none_or(|format| format.up == Up::Said) {
        let what = format_args!("'{source}' says itself which way is up");
        return Err(Error::config(what, "leave the axes out"));
    }
    let mut scene = match source.strip_prefix(BUILTIN) {
        Some(spec) => builtin::build(spec).map_err(|e| no_builtin(source, e))?,
        None => {
            let path = Path::new(source);
            let folder = Folder::of(path, options.allow_outside);
            let Some(format) = format else { return Err(no_scene(source)) };
            let mut scene = (format.load)(path, &folder, options)?;
            folder.tell(&mut scene);
            if let (Up::Guessed(what), None) = (format.up, options.axes) {
                scene.warnings.push(format!("{source}: {what}"));
            }
            scene.stand_up(options.axes.unwrap_or(scene.axes));
            scene
        }
    };
    scene.widen_lines(options.line_width)?;
    if scene.materials.is_empty() {
        scene.materials.push(Material::default());
    }
    scene.check()?;
    Ok(scene)
}

/// The name under which a file appears in traces: without its folders, so that a
/// trace does not depend on where its scene lay.
fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}
