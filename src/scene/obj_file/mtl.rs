//! MTL files: the materials of OBJ scenes.
//!
//! Read here and not by `tobj`: that gives up a whole file for one bad statement,
//! panics on colours of fewer than three numbers, knows no line numbers, and is
//! of use only for statements that want no more than a few numbers or a name.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::{Vec3, Vec4};

use super::lines::{Lines, Statement};
use crate::error::{Result, one_line};
use crate::scene::texture::Encoding;
use crate::scene::{AlphaMode, Material, Scene, Texture, TextureUse};

/// The materials that an OBJ file's MTL files define.
///
/// They and their textures may lie anywhere, since exporters write absolute
/// paths and such with `..`; a glTF file, which may come from a stranger, is
/// held to its own folder.
pub(super) struct Library {
    folder: PathBuf,
    numbers: HashMap<String, usize>,
    read: HashSet<PathBuf>,
    textures: HashMap<(String, Encoding), Option<usize>>,
    /// Whether every MTL file named could be read.
    pub whole: bool,
}

/// A material as its statements say it.
#[derive(Default)]
struct Definition {
    name: String,
    diffuse: Option<Vec3>,
    emissive: Option<Vec3>,
    dissolve: Option<f32>,
    transparency: Option<f32>,
    colour_map: Option<String>,
    alpha_map: Option<String>,
}

impl Library {
    /// An empty one for an OBJ file in `folder`.
    pub fn new(folder: &Path) -> Self {
        Library {
            folder: folder.to_path_buf(),
            numbers: HashMap::new(),
            read: HashSet::new(),
            textures: HashMap::new(),
            whole: true,
        }
    }

    /// The number in the scene of the material of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    /// Reads the files that a `mtllib` statement names: one whose name may hold
    /// spaces, or several. What cannot be read becomes warnings.
    pub fn read(&mut self, names: &str, scene: &mut Scene) {
        let names = names.replace('\\', "/");
        let words: Vec<&str> = names.split_whitespace().collect();
        if words.is_empty() {
            scene.warnings.push(format!("{}: a mtllib statement names no file", scene.source));
        }
        let there = |name: &&str| self.folder.join(name).exists();
        let names = if words.is_empty() {
            words
        } else if there(&names.as_str()) || !words.iter().any(there) {
            vec![names.as_str()]
        } else {
            words
        };
        for path in names.iter().map(|name| self.folder.join(name)).collect::<Vec<_>>() {
            if !self.read.insert(path.clone()) {
                continue;
            }
            if let Err(e) = self.read_file(&path, scene) {
                self.whole = false;
                scene.warnings.push(format!("{}: its materials: {e}", scene.source));
            }
        }
    }

    fn read_file(&mut self, path: &Path, scene: &mut Scene) -> Result<()> {
        let mut lines = Lines::open(path)?;
        scene.files.push(path.to_path_buf());
        let mut current: Option<Definition> = None;
        while let Some(statement) = lines.next()? {
            if statement.keyword().eq_ignore_ascii_case("newmtl") {
                if let Some(done) = current.take() {
                    self.add(done, scene);
                }
                let name = statement.name().to_string();
                if !name.is_empty() {
                    current = Some(Definition { name, ..Definition::default() });
                    continue;
                }
            }
            let understood = match &mut current {
                Some(definition) => definition.take(&statement),
                None => Err("it belongs to no material".to_string()),
            };
            if let Err(what) = understood {
                scene.warnings.push(format!("{}: {what}", statement.place(path)));
            }
        }
        if let Some(done) = current {
            self.add(done, scene);
        }
        Ok(())
    }

    fn add(&mut self, definition: Definition, scene: &mut Scene) {
        // Who writes both (3ds Max does) means the same with them.
        let transparency = definition.transparency.unwrap_or(0.0);
        let alpha = definition.dissolve.unwrap_or(1.0 - transparency);
        let base_texture = self.texture(definition.colour_map.as_deref(), Encoding::Srgb, scene);
        let alpha_texture = match (&definition.alpha_map, &definition.colour_map) {
            // The usual way to say that the colour texture's own alpha counts.
            (Some(alpha), Some(base)) if alpha == base => None,
            (alpha, _) => self.texture(alpha.as_deref(), Encoding::Linear, scene),
        };
        let seen_through = alpha < 1.0
            || alpha_texture.is_some()
            || base_texture.is_some_and(|t| scene.textures[t.texture].has_alpha());
        self.numbers.insert(definition.name.clone(), scene.materials.len());
        let base: Vec4 = definition.diffuse.unwrap_or(Vec3::ONE).extend(alpha);
        scene.materials.push(Material {
            name: one_line(&definition.name),
            base,
            base_texture,
            alpha_texture,
            alpha_mode: if seen_through { AlphaMode::Blend } else { AlphaMode::Opaque },
            emissive: definition.emissive.unwrap_or(Vec3::ZERO),
            ..Material::default()
        });
    }

    /// The texture in the file of that name, as the scene's use of it.
    fn texture(
        &mut self,
        name: Option<&str>,
        encoding: Encoding,
        scene: &mut Scene,
    ) -> Option<TextureUse> {
        let name = name?;
        let key = (name.to_string(), encoding);
        let index = match self.textures.get(&key) {
            Some(index) => *index,
            None => {
                let path = self.folder.join(name);
                let read = Texture::read_as(&path, encoding);
                scene.files.push(path);
                let index = match read.and_then(|texture| scene.add_texture(texture)) {
                    Ok(index) => Some(index),
                    Err(e) => {
                        scene.warnings.push(e.to_string());
                        None
                    }
                };
                self.textures.insert(key, index);
                index
            }
        };
        index.map(TextureUse::plain)
    }
}

impl Definition {
    /// Takes a statement in; those that this model has no use for are skipped.
    ///
    /// # Errors
    /// Why it cannot be read, and what becomes of it.
    fn take(&mut self, statement: &Statement) -> Result<(), String> {
        let ignored = |what: String| format!("{what}; the statement is ignored");
        match statement.keyword().to_ascii_lowercase().as_str() {
            "newmtl" => Err(ignored("the material has no name".to_string())),
            "kd" => colour(statement).map(|c| self.diffuse = Some(c)).map_err(ignored),
            "ke" => colour(statement).map(|c| self.emissive = Some(c)).map_err(ignored),
            "d" => {
                let halo = statement.words().next() == Some("-halo");
                let word = statement.words().nth(usize::from(halo));
                self.dissolve = Some(share(word).map_err(ignored)?);
                if halo { Err("the halo is ignored".to_string()) } else { Ok(()) }
            }
            "tr" => {
                let word = statement.words().next();
                share(word).map(|t| self.transparency = Some(t)).map_err(ignored)
            }
            "map_kd" => map(statement, &mut self.colour_map),
            "map_d" => map(statement, &mut self.alpha_map),
            _ => Ok(()),
        }
    }
}

/// The colour of a statement: three numbers, or one for a grey.
fn colour(statement: &Statement) -> Result<Vec3, String> {
    let words = statement.words().take(4);
    let numbers = words.map(Statement::number).collect::<Result<Vec<f32>, _>>()?;
    if let Some(negative) = numbers.iter().find(|n| **n < 0.0) {
        return Err(format!("'{negative}' is negative"));
    }
    match *numbers {
        [grey] => Ok(Vec3::splat(grey)),
        [r, g, b, ..] => Ok(Vec3::new(r, g, b)),
        _ => Err("a colour has three numbers, or one".to_string()),
    }
}

/// A number from 0 to 1.
fn share(word: Option<&str>) -> Result<f32, String> {
    let word = word.ok_or("the number is missing")?;
    let number = Statement::number(word)?;
    if (0.0..=1.0).contains(&number) {
        Ok(number)
    } else {
        Err(format!("'{number}' is not from 0 to 1"))
    }
}

/// Takes the file's name of a map statement, which stands behind its options.
fn map(statement: &Statement, to: &mut Option<String>) -> Result<(), String> {
    let mut rest = statement.name();
    let mut options = Vec::new();
    while let Some(option) = rest.split_whitespace().next().filter(|w| w.starts_with('-')) {
        let (numbers, words) = match option.to_ascii_lowercase().as_str() {
            "-o" | "-s" | "-t" => (3, 0),
            "-mm" => (2, 0),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-texres" | "-bm" | "-boost"
            | "-imfchan" | "-type" => (0, 1),
            // A name that begins with a dash.
            _ => break,
        };
        options.push(option);
        rest = after(rest, option);
        for i in 0..numbers + words {
            let Some(word) = rest.split_whitespace().next() else { break };
            // One number suffices to the options that take several.
            if i >= words && word.parse::<f32>().is_err() {
                break;
            }
            rest = after(rest, word);
        }
    }
    if rest.is_empty() {
        return Err("it names no file; the statement is ignored".to_string());
    }
    *to = Some(rest.replace('\\', "/"));
    match options[..] {
        [] => Ok(()),
        _ => Err(format!("the map is used without its options ({})", options.join(", "))),
    }
}

/// What follows the first word, which is `word`.
fn after<'a>(text: &'a str, word: &str) -> &'a str {
    text.trim_start()[word.len()..].trim_start()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file_of(text: &str) -> (Option<String>, bool) {
        let mut name = None;
        let clean = map(&Statement::of(text), &mut name).is_ok();
        (name, clean)
    }

    #[test]
    fn options_of_maps_are_skipped() {
        let name = |n: &str| Some(n.to_string());
        assert_eq!(file_of("map_Kd a.png"), (name("a.png"), true));
        assert_eq!(file_of("map_Kd my leaf.png"), (name("my leaf.png"), true));
        assert_eq!(file_of("map_Kd tex\\a.png"), (name("tex/a.png"), true));
        assert_eq!(file_of("map_Kd -s 2 2 1 -clamp on a b.png"), (name("a b.png"), false));
        assert_eq!(file_of("map_Kd -o 0.5 a.png"), (name("a.png"), false));
        assert_eq!(file_of("map_Kd -s 1 1 1 1.png"), (name("1.png"), false));
        assert_eq!(file_of("map_d -imfchan m a.png"), (name("a.png"), false));
        assert_eq!(file_of("map_Kd -mine.png"), (name("-mine.png"), true));
        assert_eq!(file_of("map_Kd"), (None, false));
        assert_eq!(file_of("map_Kd -s 1 1 1"), (None, false));
    }
}
