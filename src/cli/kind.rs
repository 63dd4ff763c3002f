//! What files are by their names: a name that says one thing is not taken for another.

use std::path::Path;

use crate::error::{Error, Result};
use crate::scene;

/// What a command reads or writes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    Trace,
    Scene,
    Picture,
    Study,
    Json,
    Markdown,
    Page,
    /// A folder of results.
    Folder,
}

impl Kind {
    /// What a name says by its ending; `None` where that says nothing of these.
    fn of(path: &Path) -> Option<Kind> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match &*ending {
            "arrow" => Kind::Trace,
            "exr" | "png" | "jpg" | "jpeg" | "hdr" | "tif" | "tiff" | "bmp" => Kind::Picture,
            "toml" => Kind::Study,
            "json" | "jsonl" => Kind::Json,
            "md" => Kind::Markdown,
            "html" | "htm" => Kind::Page,
            _ if scene::is_scene(path) => Kind::Scene,
            _ => return None,
        })
    }

    fn name(self) -> &'static str {
        match self {
            Kind::Trace => "a trace",
            Kind::Scene => "a scene",
            Kind::Picture => "a picture",
            Kind::Study => "a study file",
            Kind::Json => "JSON",
            Kind::Markdown => "a text in Markdown",
            Kind::Page => "a web page",
            Kind::Folder => "a folder of results",
        }
    }

    /// What to name in place of another kind's name.
    fn good(self) -> &'static str {
        match self {
            Kind::Trace => "name a .arrow file",
            Kind::Scene => "name a scene's file",
            Kind::Picture => "name a .exr or .png file",
            Kind::Study => "name a .toml file",
            Kind::Json => "name a .json file",
            Kind::Markdown => "name a .md file",
            Kind::Page => "name a .html file",
            Kind::Folder => "name a folder",
        }
    }
}

/// Refuses an output whose name says that it is something else, and a trace on standard output:
/// it is whole or not there, which a pipe cannot be.
pub(super) fn check_output(path: &Path, kind: Kind) -> Result<()> {
    if kind == Kind::Trace && path == Path::new("-") {
        return Err(Error::config(
            "a trace cannot go to standard output",
            "name a file (./- for one that is called so)",
        ));
    }
    match Kind::of(path) {
        // A folder may be called so, if it is one.
        Some(_) if kind == Kind::Folder && path.is_dir() => Ok(()),
        Some(named) if named != kind => Err(Error::config(
            format_args!(
                "{} cannot be written as '{}', which is named as {}",
                kind.name(),
                path.display(),
                named.name()
            ),
            kind.good(),
        )),
        _ => Ok(()),
    }
}

/// Refuses as an input of a kind what is plainly another, and says what to do with it.
pub(super) fn check_input(path: &Path, kind: Kind) -> Result<()> {
    let Some((named, hint)) = mistaken(path, kind) else { return Ok(()) };
    let (name, wanted) = (path.display(), kind.name());
    Err(Error::config(format_args!("'{name}' is {named}, and {wanted} is asked for"), hint))
}

/// What a path is in place of a `kind`, and what to do.
fn mistaken(path: &Path, kind: Kind) -> Option<(&'static str, String)> {
    let name = path.display();
    let capture = |scene: &str| format!("capture it first: screendoor capture {scene} -o t.arrow");
    if !path.exists()
        && let Some(builtin) = path.to_str().and_then(scene::meant_builtin)
    {
        return Some(match kind {
            Kind::Trace => ("a built-in scene", capture(&builtin)),
            Kind::Picture => ("a built-in scene", "capture and replay it first".to_string()),
            _ => ("a built-in scene", format!("name it in a study as source = \"{builtin}\"")),
        });
    }
    if path.join("study.toml").is_file() && kind != Kind::Folder {
        let report = format!("screendoor report {name}");
        return Some(match kind {
            Kind::Trace => ("a study's folder", format!("name one of the traces in {name}/traces")),
            Kind::Study => ("a study's folder", format!("write its report again with {report}")),
            _ => ("a study's folder", format!("name a file in it, or {report}")),
        });
    }
    let named = Kind::of(path).filter(|named| *named != kind)?;
    let hint = match (named, kind) {
        (Kind::Scene, Kind::Trace) => capture(&name.to_string()),
        (Kind::Scene, Kind::Study | Kind::Folder) => {
            format!("name it in a study file as source = \"{name}\"")
        }
        (Kind::Scene, _) => "capture and replay it first".to_string(),
        (Kind::Trace, Kind::Picture) => {
            format!("replay it first: screendoor replay {name} -o a.exr")
        }
        (Kind::Trace, Kind::Study | Kind::Folder) => {
            format!("name it in a study file as trace = \"{name}\"")
        }
        (Kind::Study, _) => format!("measure it: screendoor study {name} -o results"),
        (Kind::Picture, Kind::Trace) => "pictures are for 'screendoor compare'".to_string(),
        _ => kind.good().to_string(),
    };
    Some((named.name(), hint))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_refused_for_every_kind_but_its_own() {
        let names = [
            ("a.Arrow", Kind::Trace),
            ("a.glb", Kind::Scene),
            ("a.PNG", Kind::Picture),
            ("a.toml", Kind::Study),
            ("a.json", Kind::Json),
            ("a.md", Kind::Markdown),
            ("a.html", Kind::Page),
        ];
        for (name, own) in names {
            for (_, kind) in names {
                assert_eq!(check_output(Path::new(name), kind).is_ok(), kind == own, "{name}");
                assert_eq!(check_input(Path::new(name), kind).is_ok(), kind == own, "{name}");
            }
            assert!(check_output(Path::new(name), Kind::Folder).is_err());
        }
        for neutral in ["a", "a.b", "/dev/stdout", "-", "t.ipc"] {
            let written = check_output(Path::new(neutral), Kind::Trace);
            assert_eq!(written.is_ok(), neutral != "-", "{neutral}");
            assert!(check_input(Path::new(neutral), Kind::Trace).is_ok());
        }
    }
}
