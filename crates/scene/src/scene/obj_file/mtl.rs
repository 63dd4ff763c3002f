//! MTL files: the materials of OBJ scenes.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::{Vec3, Vec4};

use super::lines::{Lines, Statement};
use super::map::{Map, map};
use super::unread::Unread;
use crate::scene::folder::{Folder, Found};
use crate::scene::image_file::{self, Channel};
use crate::scene::texture::Encoding;
use crate::scene::{AlphaMode, Material, Scene, Texture, TextureUse, Wrap};
use screendoor_trace::error::{Result, one_line};

/// How many bad statements of a file are told one by one.
const MAX_TOLD: usize = 20;

/// Statements that change nothing of a diffuse picture: highlights, reflections, refraction,
/// what ambient light finds, and models of roughness.
const PASSED: [&str; 24] = [
    "ka",
    "ks",
    "ns",
    "ni",
    "illum",
    "sharpness",
    "map_ka",
    "map_ks",
    "map_ns",
    "refl",
    "map_refl",
    "map_aat",
    "pr",
    "pm",
    "ps",
    "pc",
    "pcr",
    "aniso",
    "anisor",
    "map_pr",
    "map_pm",
    "map_ps",
    "map_pc",
    "map_pcr",
];

/// The materials that an OBJ file's MTL files define.
pub(super) struct Library<'a> {
    folder: &'a Folder,
    numbers: HashMap<String, usize>,
    /// By their names in small letters.
    lower: HashMap<String, usize>,
    read: HashSet<PathBuf>,
    textures: HashMap<(String, Reading, bool), Option<usize>>,
    /// Where materials are said to be wholly transparent, by their names.
    clear: HashMap<String, String>,
    /// Whether every MTL file named could be read.
    pub whole: bool,
}

/// What is read of a picture.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Reading {
    Colours,
    ColoursAndAlpha,
    Opacity(Channel),
}

/// A number, and where it is said.
struct Said {
    number: f32,
    place: String,
}

/// A material as its statements say it.
#[derive(Default)]
struct Definition {
    name: String,
    diffuse: Option<(Vec3, String)>,
    emissive: Option<(Vec3, String)>,
    dissolve: Option<Said>,
    transparency: Option<Said>,
    colour_map: Option<Map>,
    alpha_map: Option<Map>,
    emissive_map: Option<Map>,
}

/// What of a file was not understood.
#[derive(Default)]
struct Left {
    bad: Vec<String>,
    /// Bad statements that are not told one by one.
    more: usize,
    unread: Unread,
    options: Unread,
    /// Statements before the first material, and the first one's line.
    before: Option<(usize, usize)>,
}

impl<'a> Library<'a> {
    /// An empty one for an OBJ file in `folder`.
    pub(super) fn new(folder: &'a Folder) -> Self {
        Library {
            folder,
            numbers: HashMap::new(),
            lower: HashMap::new(),
            read: HashSet::new(),
            textures: HashMap::new(),
            clear: HashMap::new(),
            whole: true,
        }
    }

    /// The number in the scene of the material of that name, and whether it is spelt so.
    pub(super) fn find(&self, name: &str) -> Option<(usize, bool)> {
        if let Some(number) = self.numbers.get(name) {
            return Some((*number, true));
        }
        let bare = name.trim_matches('"').to_lowercase();
        self.lower.get(&bare).map(|number| (*number, false))
    }

    /// Reads the files that a `mtllib` statement names: one whose name may hold
    /// spaces, or several. What cannot be read becomes warnings.
    pub(super) fn read(&mut self, names: &str, scene: &mut Scene) {
        let words = words(names);
        if words.is_empty() {
            scene.warnings.push(format!("{}: a mtllib statement names no file", scene.source));
        }
        let is_library = |word: &&str| word.to_ascii_lowercase().ends_with(".mtl");
        let several = words.len() > 1
            && !self.folder.has(names)
            && (words.iter().all(is_library) || words.iter().any(|word| self.folder.has(word)));
        let names = if several || words.len() < 2 { words } else { vec![names] };
        for name in names {
            let read = self.folder.open(name).and_then(|found| self.read_file(found, scene));
            if let Err(e) = read {
                self.whole = false;
                scene.warnings.push(format!("{}: its materials: {e}", scene.source));
            }
        }
    }

    fn read_file(&mut self, found: Found, scene: &mut Scene) -> Result<()> {
        let path = found.path.clone();
        if !self.read.insert(path.clone()) {
            return Ok(());
        }
        scene.files.push(path.clone());
        let mut lines = Lines::of(found.into_file().0, &path)?;
        let mut current: Option<Definition> = None;
        let mut left = Left::default();
        while let Some(statement) = lines.next()? {
            let begins = statement.keyword().eq_ignore_ascii_case("newmtl");
            if begins && !statement.name().is_empty() {
                if let Some(done) = current.take() {
                    self.add(done, scene);
                }
                let name = statement.name().to_string();
                current = Some(Definition { name, ..Definition::default() });
                continue;
            }
            match &mut current {
                Some(definition) => {
                    if let Err(what) = definition.take(&statement, &path, &mut left) {
                        left.bad(format!("{}: {what}", statement.place(&path)));
                    }
                }
                // What this is, nobody knows: it is not shown.
                None => left.before.get_or_insert((statement.line, 0)).1 += 1,
            }
        }
        match current {
            Some(done) => self.add(done, scene),
            None => {
                let what = format!("{}: it defines no material", path.display());
                scene.warnings.push(what);
                return Ok(());
            }
        }
        scene.warnings.extend(left.told(&path));
        Ok(())
    }

    fn add(&mut self, mut definition: Definition, scene: &mut Scene) {
        // Who writes both (3ds Max does) means the same with them.
        let transparency = definition.transparency.as_ref().map_or(0.0, |said| said.number);
        let alpha = definition.dissolve.as_ref().map_or(1.0 - transparency, |said| said.number);
        let name = one_line(&definition.name);
        let said = definition.dissolve.take().or(definition.transparency.take());
        match said.filter(|_| alpha == 0.0) {
            Some(said) => drop(self.clear.insert(name.clone(), said.place)),
            None => drop(self.clear.remove(&name)),
        }
        let (colour_map, alpha_map) = (definition.colour_map.take(), definition.alpha_map.take());
        // The usual way to say that the colour texture's own alpha counts.
        let own_alpha = match (&alpha_map, &colour_map) {
            (Some(alpha), Some(base)) => alpha.name == base.name,
            (None, _) => true,
            (Some(_), None) => false,
        };
        let reading = if own_alpha { Reading::ColoursAndAlpha } else { Reading::Colours };
        let base_texture = self.texture(colour_map.as_ref(), reading, scene);
        let alpha_texture = alpha_map
            .filter(|_| !own_alpha)
            .and_then(|map| self.texture(Some(&map), Reading::Opacity(map.channel), scene));
        let emissive_map = definition.emissive_map.take();
        let emissive_texture = self.texture(emissive_map.as_ref(), Reading::Colours, scene);

        let base = match definition.diffuse {
            // Exporters that take the texture for the colour write so, and mean no black.
            Some((Vec3::ZERO, place)) if base_texture.is_some() => {
                let what =
                    "the texture of map_Kd would be multiplied by black; it is shown as it is";
                scene.warnings.push(format!("{place}: {what}"));
                Vec3::ONE
            }
            Some((colour, _)) => colour,
            None => Vec3::ONE,
        };
        let emissive = match (definition.emissive, &emissive_map, emissive_texture) {
            // Without its texture it would glow all over.
            (_, Some(_), None) => Vec3::ZERO,
            (Some((Vec3::ZERO, place)), Some(_), _) => {
                let what = "the texture of map_Ke is multiplied by black and does not show";
                scene.warnings.push(format!("{place}: {what}"));
                Vec3::ZERO
            }
            (Some((colour, _)), _, _) => colour,
            (None, Some(_), _) => Vec3::ONE,
            (None, None, _) => Vec3::ZERO,
        };
        let seen_through = alpha < 1.0
            || alpha_texture.is_some()
            || base_texture.is_some_and(|t| scene.textures[t.texture].has_alpha());
        let number = scene.materials.len();
        self.lower.insert(definition.name.to_lowercase(), number);
        self.numbers.insert(definition.name, number);
        let base: Vec4 = base.extend(alpha);
        scene.materials.push(Material {
            name,
            base,
            base_texture,
            alpha_texture,
            alpha_mode: if seen_through { AlphaMode::Blend } else { AlphaMode::Opaque },
            emissive,
            emissive_texture,
            ..Material::default()
        });
    }

    /// The texture that a statement names, as the scene's use of it.
    fn texture(
        &mut self,
        map: Option<&Map>,
        reading: Reading,
        scene: &mut Scene,
    ) -> Option<TextureUse> {
        let map = map?;
        let key = (map.name.clone(), reading, map.clamp);
        let index = match self.textures.get(&key) {
            Some(index) => *index,
            None => {
                let read = self.read_texture(map, reading, scene);
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
        index.map(|texture| TextureUse { transform: map.transform, ..TextureUse::plain(texture) })
    }

    fn read_texture(&self, map: &Map, reading: Reading, scene: &mut Scene) -> Result<Texture> {
        let found = self.folder.open(&map.name)?;
        let path = found.path.clone();
        scene.files.push(path.clone());
        let image = image_file::decode(&found.read()?, &path.display().to_string())?;
        let (image, encoding) = match reading {
            Reading::ColoursAndAlpha => (image, Encoding::Srgb),
            Reading::Colours => (image_file::colours(image), Encoding::Srgb),
            Reading::Opacity(channel) => (image_file::opacity(image, channel), Encoding::Linear),
        };
        let texture = Texture::from_image(image, encoding);
        Ok(if map.clamp { texture.wrapped([Wrap::Clamp; 2]) } else { texture })
    }

    /// Warns of materials in use that are said to be wholly transparent: some exporters write
    /// `Tr 1` for opaque.
    pub(super) fn warn_of_clear(&self, scene: &mut Scene) {
        let name =
            |o: &crate::scene::Object| &*scene.materials[scene.shapes[o.shape].material()].name;
        let clear: BTreeSet<&str> =
            scene.objects.iter().map(name).filter(|n| self.clear.contains_key(*n)).collect();
        let Some(first) = clear.first() else { return };
        let all = scene.objects.iter().all(|o| clear.contains(name(o)));
        let what = match clear.len() {
            _ if all => "the whole scene is".to_string(),
            1 => "a material is".to_string(),
            n => format!("{n} materials are"),
        };
        let warning = format!(
            "{}: {what} transparent: {} says so of '{first}'; where opaque is meant, write 'd 1' \
             in its place (some programs write 'Tr 1' for it)",
            scene.source, self.clear[*first]
        );
        scene.warnings.push(warning);
    }
}

impl Left {
    fn bad(&mut self, what: String) {
        if self.bad.len() < MAX_TOLD {
            self.bad.push(what);
        } else {
            self.more += 1;
        }
    }

    /// The warnings about a file that has materials.
    fn told(self, path: &Path) -> Vec<String> {
        let mut told = self.bad;
        let mut tell = |what: String| told.push(format!("{}: {what}", path.display()));
        if self.more > 0 {
            tell(format!("{} more statements are ignored", self.more));
        }
        if let Some((line, count)) = self.before {
            tell(format!("{count} statements from line {line} on belong to no material"));
        }
        if let Some(named) = self.unread.named() {
            tell(format!("statements that are not read: {named}"));
        }
        if let Some(named) = self.options.named() {
            tell(format!("options of maps that are not applied: {named}"));
        }
        told
    }
}

impl Definition {
    /// Takes a statement in.
    ///
    /// # Errors
    /// Why it cannot be read, and what becomes of it.
    fn take(&mut self, statement: &Statement, path: &Path, left: &mut Left) -> Result<(), String> {
        let ignored = |what: String| format!("{what}; the statement is ignored");
        let place = || statement.place(path);
        let options = &mut left.options;
        match statement.keyword().to_ascii_lowercase().as_str() {
            "newmtl" => return Err(ignored("the material has no name".to_string())),
            "kd" => self.diffuse = Some((colour(statement).map_err(ignored)?, place())),
            "ke" => self.emissive = Some((colour(statement).map_err(ignored)?, place())),
            "d" => {
                let halo = statement.words().next() == Some("-halo");
                let word = statement.words().nth(usize::from(halo));
                let number = share(word).map_err(ignored)?;
                self.dissolve = Some(Said { number, place: place() });
                if halo {
                    return Err("the halo is ignored".to_string());
                }
            }
            "tr" => {
                let number = share(statement.words().next()).map_err(ignored)?;
                self.transparency = Some(Said { number, place: place() });
            }
            "map_kd" => self.colour_map = Some(map(statement, options)?),
            "map_d" => self.alpha_map = Some(map(statement, options)?),
            "map_ke" => self.emissive_map = Some(map(statement, options)?),
            // A filter that lets all light through is none.
            "tf" if statement.words().all(|word| word.parse() == Ok(1.0_f32)) => {}
            word if PASSED.contains(&word) => {}
            _ => left.unread.add(statement.keyword(), statement.line),
        }
        Ok(())
    }
}

/// The words of a statement; those in quotes may hold spaces.
fn words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() && !rest.starts_with('#') {
        let quoted = rest.strip_prefix('"').and_then(|inner| inner.split_once('"'));
        let (word, after) = match quoted {
            Some(parts) => parts,
            None => rest.split_once(char::is_whitespace).unwrap_or((rest, "")),
        };
        words.push(word);
        rest = after.trim_start();
    }
    words
}

/// A number that single precision can hold.
fn real(word: &str) -> Result<f32, String> {
    let number = Statement::number(word)? as f32;
    if number.is_finite() { Ok(number) } else { Err(format!("'{word}' is too large a number")) }
}

/// The colour of a statement: three numbers, or one for a grey.
fn colour(statement: &Statement) -> Result<Vec3, String> {
    let words = statement.words().take(4);
    let numbers = words.map(real).collect::<Result<Vec<f32>, _>>()?;
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
    let number = real(word.ok_or("the number is missing")?)?;
    if (0.0..=1.0).contains(&number) {
        Ok(number)
    } else {
        Err(format!("'{number}' is not from 0 to 1"))
    }
}
