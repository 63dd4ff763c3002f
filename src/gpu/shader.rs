//! The shaders: files, each the twin of a Rust file of the same name, put together into
//! programs. A file names those that it uses in a line `// uses: a b`.

use std::fmt::Write;

use crate::rop::Constant;

/// Declares the files by their names.
macro_rules! files {
    ($($name:literal),+ $(,)?) => {
        /// Names and texts.
        pub(super) const FILES: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("shaders/", $name, ".wgsl")))),+];
    };
}

files![
    "append",
    "arithmetic",
    "bin",
    "bindings",
    "capture",
    "colour",
    "dither",
    "enderton",
    "fragment",
    "kbuffer",
    "lanes",
    "lanes_subgroup",
    "lanes_workgroup",
    "layered",
    "layers",
    "lk",
    "longest",
    "mask_narrow",
    "mask_wide",
    "mlab",
    "opacity",
    "over_opaque",
    "pixel_order",
    "random",
    "reference_value",
    "replay",
    "resolve",
    "round",
    "samples",
    "scan",
    "slab",
    "state",
    "stochastic",
    "subset",
    "surface",
    "systematic",
    "touch",
    "tracked",
    "view_depth",
    "wboit",
    "wide",
];

/// The text of the program that `files` are, with those that they use, each once and before
/// its users, behind `constants`. `mask` stands for the file that holds sets of up to
/// `samples` samples.
///
/// # Panics
/// Where a file is missing: a fault of the crate's own.
pub fn program(files: &[&str], samples: u32, constants: &[(String, Constant)]) -> String {
    let mut text = String::new();
    for (name, value) in constants {
        writeln!(text, "const {name}: {value};").expect("strings can be written to");
    }
    let mut done = Vec::new();
    files.iter().for_each(|file| append(file, samples, &mut done, &mut text));
    #[cfg(test)]
    let text = defect::plant(text);
    text
}

/// Defects that tests plant into shaders.
#[cfg(test)]
pub(super) mod defect {
    use std::cell::Cell;

    /// A text of a shader, and what stands in its place.
    pub type Defect = (&'static str, &'static str);

    thread_local! {
        static PLANTED: Cell<Option<Defect>> = const { Cell::new(None) };
    }

    /// Runs `then` with a defect in the shaders that are put together meanwhile.
    pub fn with<T>(defect: Option<Defect>, then: impl FnOnce() -> T) -> T {
        PLANTED.set(defect);
        let result = then();
        PLANTED.set(None);
        result
    }

    pub fn plant(text: String) -> String {
        match PLANTED.get() {
            Some((good, bad)) => text.replacen(good, bad, 1),
            None => text,
        }
    }
}

fn append(name: &str, samples: u32, done: &mut Vec<String>, text: &mut String) {
    let name = match name {
        "mask" if samples <= 32 => "mask_narrow",
        "mask" => "mask_wide",
        name => name,
    };
    if done.iter().any(|d| d == name) {
        return;
    }
    done.push(name.to_string());
    let file = FILES.iter().find(|(file, _)| *file == name);
    let (_, source) = file.unwrap_or_else(|| panic!("there is no shader '{name}'"));
    for used in uses(source) {
        append(used, samples, done, text);
    }
    text.push_str(source);
}

/// The files that a file names.
fn uses(source: &str) -> impl Iterator<Item = &str> {
    let lines = source.lines().filter_map(|line| line.strip_prefix("// uses: "));
    lines.flat_map(str::split_whitespace)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_put_in_once_and_before_its_users() {
        let constants = [("SAMPLES".to_string(), Constant::Whole(8))];
        let text = program(&["touch"], 8, &constants);
        assert!(text.starts_with("const SAMPLES: u32 = 8u;\n"));
        assert_eq!(text.matches("struct Fragment {").count(), 1);
        assert!(text.contains("alias Mask = u32;") && !text.contains("alias Mask = Wide;"));
        let place = |part: &str| text.find(part).expect(part);
        assert!(place("struct Params {") < place("fn touch("));
        assert!(program(&["touch"], 64, &constants).contains("alias Mask = Wide;"));
    }

    #[test]
    fn every_file_is_there_and_used() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/gpu/shaders");
        let mut found: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|f| f.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
            .collect();
        found.sort();
        assert_eq!(found, FILES.iter().map(|f| f.0.to_string()).collect::<Vec<_>>());
    }
}
