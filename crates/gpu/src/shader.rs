//! The shaders: files, each the twin of a Rust file of the same name, put together into
//! programs. A file names those that it uses in a line `// uses: a b`.

use std::fmt::Write;

use crate::loaders;
use crate::unroll::unrolled;
use screendoor_rop::shader;
use screendoor_rop::{Constant, SHADERS, Shader};

/// The device's own.
pub(super) const OWN: &[Shader] = &[
    shader!("shaders/", "append"),
    shader!("shaders/", "arithmetic"),
    shader!("shaders/", "bin"),
    shader!("shaders/", "bindings"),
    shader!("shaders/", "capture"),
    shader!("shaders/", "column"),
    shader!("shaders/", "fragment"),
    shader!("shaders/", "frame"),
    shader!("shaders/", "lanes"),
    shader!("shaders/", "lanes_subgroup"),
    shader!("shaders/", "lanes_workgroup"),
    shader!("shaders/", "longest"),
    shader!("shaders/", "mask_narrow"),
    shader!("shaders/", "mask_wide"),
    shader!("shaders/", "random"),
    shader!("shaders/", "replay"),
    shader!("shaders/", "resolve"),
    shader!("shaders/", "scan"),
    shader!("shaders/", "state"),
    shader!("shaders/", "touch"),
    shader!("shaders/", "value"),
    shader!("shaders/", "wide"),
];

/// The shader of a name: generated, of the device's own, or of the kits'.
///
/// # Panics
/// Where there is none: a fault of the crate's own, or of a design's shader.
pub(crate) fn named(name: &str) -> Shader {
    if let Some(generated) = loaders::named(name) {
        return generated;
    }
    let all = OWN.iter().chain(SHADERS);
    *all.clone().find(|s| s.name == name).unwrap_or_else(|| {
        let names = all.map(|s| s.name).collect::<Vec<_>>().join(" ");
        panic!("there is no shader '{name}', only {names}")
    })
}

/// The text of the program that `files` are, with those that they use, each once and before
/// its users, behind `constants`, loops over few samples written out. `mask` stands for the file that holds sets of up to
/// `samples` samples.
///
/// # Panics
/// Where a file is missing: a fault of the crate's own.
pub(crate) fn program(files: &[Shader], samples: u32, constants: &[(String, Constant)]) -> String {
    let mut text = String::new();
    for (name, value) in constants {
        writeln!(text, "const {name}: {value};").expect("strings can be written to");
    }
    let mut done = Vec::new();
    files.iter().for_each(|file| append(*file, samples, &mut done, &mut text));
    #[cfg(test)]
    let text = defect::plant(text);
    unrolled(&text, samples)
}

/// Defects that tests plant into shaders.
#[cfg(test)]
pub(super) mod defect {
    use std::cell::Cell;

    /// A text of a shader, and what stands in its place.
    pub(crate) type Defect = (&'static str, &'static str);

    thread_local! {
        static PLANTED: Cell<Option<Defect>> = const { Cell::new(None) };
    }

    /// Runs `then` with a defect in the shaders that are put together meanwhile.
    pub(crate) fn with<T>(defect: Option<Defect>, then: impl FnOnce() -> T) -> T {
        PLANTED.set(defect);
        let result = then();
        PLANTED.set(None);
        result
    }

    pub(crate) fn plant(text: String) -> String {
        match PLANTED.get() {
            Some((good, bad)) => text.replacen(good, bad, 1),
            None => text,
        }
    }
}

fn append(shader: Shader, samples: u32, done: &mut Vec<&'static str>, text: &mut String) {
    if done.contains(&shader.name) {
        return;
    }
    done.push(shader.name);
    for used in shader.uses() {
        let name = match used {
            "mask" if samples <= 32 => "mask_narrow",
            "mask" => "mask_wide",
            name => name,
        };
        append(named(name), samples, done, text);
    }
    text.push_str(shader.text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_put_in_once_and_before_its_users() {
        let constants = [("SAMPLES".to_string(), Constant::Whole(8))];
        let text = program(&[named("touch")], 8, &constants);
        assert!(text.starts_with("const SAMPLES: u32 = 8u;\n"));
        assert_eq!(text.matches("struct Fragment {").count(), 1);
        assert!(text.contains("alias Mask = u32;") && !text.contains("alias Mask = Wide;"));
        let place = |part: &str| text.find(part).expect(part);
        assert!(place("struct Params {") < place("fn touch("));
        assert!(program(&[named("touch")], 64, &constants).contains("alias Mask = Wide;"));
    }

    #[test]
    fn every_file_is_there_and_used() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/shaders");
        // The twins in other languages are for other programs.
        let mut found: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|f| f.unwrap().path())
            .filter(|path| path.extension().is_some_and(|ending| ending == "wgsl"))
            .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
            .collect();
        found.sort();
        assert_eq!(found, OWN.iter().map(|s| s.name.to_string()).collect::<Vec<_>>());
    }
}
