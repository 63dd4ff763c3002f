//! What names a scene: a file or a built-in one, and what was meant where it is neither.

use std::path::Path;

use crate::scene::builtin;
use crate::scene::format::{endings, is_scene};
use screendoor_trace::error::{Error, Result, nearest};

/// How a built-in scene's name begins.
pub(super) const BUILTIN: &str = "builtin:";

/// The file that a scene's `source` names; `None` for a built-in one.
pub fn path_of(source: &str) -> Option<&Path> {
    (!source.starts_with(BUILTIN)).then(|| Path::new(source))
}

/// The scene of a text that was written in the folder `base`: files are seen from there.
pub fn seen_from(source: &str, base: &Path) -> String {
    match path_of(source) {
        // Not a file's name, so that what is told of it is what was written.
        Some(path) if ending(path).is_empty() => source.to_string(),
        Some(path) => base.join(path).display().to_string(),
        None => source.to_string(),
    }
}

fn ending(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase()
}

/// Finds out what can be of a scene without loading it: the built-in one's name and
/// parameters, the file's ending and that it can be opened.
///
/// # Errors
/// As [`crate::scene::load`].
pub fn check(source: &str) -> Result<()> {
    let Some(path) = path_of(source) else {
        return builtin::resolve(&source[BUILTIN.len()..])
            .map(|_| ())
            .map_err(|e| no_builtin(source, e));
    };
    if path.is_dir() {
        let why = "it is a folder; name a file";
        let why = std::io::Error::new(std::io::ErrorKind::IsADirectory, why);
        return Err(Error::io("read", path, why));
    }
    if !is_scene(path) {
        return Err(no_scene(source));
    }
    std::fs::File::open(path).map(|_| ()).map_err(|e| Error::io("read", path, e))
}

/// The built-in scene that a text means which does not say so: `cloth`, `Cloth:cells=16`,
/// `Builtin:cloth`.
pub fn meant_builtin(source: &str) -> Option<String> {
    let lower = source.to_ascii_lowercase();
    let skip = if lower.starts_with(BUILTIN) { BUILTIN.len() } else { 0 };
    let (name, settings) = match source[skip..].split_once(':') {
        Some((name, settings)) => (name, format!(":{settings}")),
        None => (&source[skip..], String::new()),
    };
    let found = builtin::BUILTINS.iter().find(|b| b.name.eq_ignore_ascii_case(name))?;
    Some(format!("{BUILTIN}{}{settings}", found.name))
}

/// Why a text names no scene, with what it seems to mean.
pub(super) fn no_scene(source: &str) -> Error {
    if let Some(meant) = meant_builtin(source) {
        let what = format_args!("'{source}' is no file of a scene");
        return Error::config(what, format_args!("did you mean '{meant}'?"));
    }
    let ending = ending(Path::new(source));
    if ending == "arrow" {
        return Error::config(
            format_args!("'{source}' is a trace, and a scene is asked for"),
            "a trace has been captured already: give it to 'replay' or 'info', or in a study as 'trace'",
        );
    }
    if ending.is_empty() {
        let names = || builtin::BUILTINS.iter().map(|b| b.name);
        // Measured by the bare names, which differ more.
        let hint = match nearest(source, names()) {
            Some(name) => format!("did you mean '{BUILTIN}{name}'?"),
            None => {
                let names: Vec<String> = names().map(|n| format!("{BUILTIN}{n}")).collect();
                format!("give a {} file, or one of {}", endings(), names.join(", "))
            }
        };
        return Error::config(format_args!("unknown scene '{source}'"), hint);
    }
    Error::config(
        format_args!("'{source}': scenes do not come as '.{ending}'"),
        format_args!("give a file that is one of {}, or builtin:NAME", endings()),
    )
}

/// The error about a built-in scene, or, where what is named so is a file, about that.
pub(super) fn no_builtin(source: &str, error: Error) -> Error {
    let name = source.strip_prefix(BUILTIN).unwrap_or(source);
    if !is_scene(Path::new(name)) {
        return error;
    }
    let what = format_args!("'{name}' is a file and no built-in scene");
    Error::config(what, format_args!("leave '{BUILTIN}' out"))
}
