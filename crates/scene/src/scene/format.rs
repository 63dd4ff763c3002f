//! The formats of the files that scenes come as: what each is called by, and what reads it.

use std::path::Path;

use crate::scene::folder::Folder;
use crate::scene::{
    LoadOptions, Scene, gltf_file, hair_file, obj_file, ply_file, splat_file, stl_file, tfx_file,
    vdb_file,
};
use screendoor_trace::error::Result;

/// What reads a format.
type Load = fn(&Path, &Folder, &LoadOptions) -> Result<Scene>;

/// A format by one of its endings.
pub(super) struct Format {
    /// How files' names end, in small letters.
    pub(super) ending: &'static str,
    pub(super) up: Up,
    pub(super) load: Load,
}

/// Whether it is known which way is up in a file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Up {
    /// The format says it.
    Said,
    /// Its habit is taken where nobody says another way.
    Habit,
    /// Files do not keep to the format's text, which is told where nobody says another way.
    Guessed(&'static str),
}

const fn format(ending: &'static str, up: Up, load: Load) -> Format {
    Format { ending, up, load }
}

const SPZ: Up = Up::Guessed(
    "y is taken to point up, as the format has it, and many writers leave it down: say as its \
     axes y-down or y-up",
);

/// All of them.
const FORMATS: [Format; 10] = [
    format("obj", Up::Habit, |path, folder, _| obj_file::load(path, folder)),
    format("gltf", Up::Said, |path, folder, _| gltf_file::load(path, folder)),
    format("glb", Up::Said, |path, folder, _| gltf_file::load(path, folder)),
    format("ply", Up::Habit, |path, _, _| ply_file::load(path)),
    format("stl", Up::Habit, |path, _, _| stl_file::load(path)),
    format("vdb", Up::Habit, |path, _, options| vdb_file::load(path, options.grid.as_deref())),
    format("tfx", Up::Habit, |path, _, _| tfx_file::load(path)),
    format("hair", Up::Habit, |path, _, _| hair_file::load(path)),
    format("splat", Up::Habit, |path, _, _| splat_file::load_packed(path)),
    format("spz", SPZ, |path, _, _| splat_file::load_spz(path)),
];

/// The format of a file by its name.
pub(super) fn format_of(path: &Path) -> Option<&'static Format> {
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    FORMATS.iter().find(|format| format.ending == ending)
}

/// The endings of the files that scenes come as, as one lists them: `.obj, .gltf, …`.
pub fn endings() -> String {
    FORMATS.map(|format| format!(".{}", format.ending)).join(", ")
}

/// Whether a file's name is that of a scene.
pub fn is_scene(path: &Path) -> bool {
    format_of(path).is_some()
}
