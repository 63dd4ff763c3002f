//! Imports follow the one-way flow of `docs/ARCHITECTURE.md`.

use std::fs;
use std::path::{Path, PathBuf};

/// The modules, and which others each may import. What all may import stands in
/// `FOUNDATION`.
const FLOW: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("param", &[]),
    ("random", &[]),
    ("output", &[]),
    ("tile", &[]),
    ("picture", &[]),
    ("scene", &["picture"]),
    ("trace", &[]),
    ("capture", &["scene", "trace"]),
    ("resolve", &[]),
    ("rop", &["trace", "picture", "resolve"]),
    ("design", &["rop", "trace", "resolve"]),
    ("gpu", &["scene", "capture", "trace", "picture", "rop", "design"]),
    ("metrics", &["trace", "picture"]),
    ("study", &["scene", "capture", "trace", "rop", "gpu", "design", "metrics", "picture"]),
    ("report", &["study", "metrics", "picture"]),
    (
        "cli",
        &[
            "scene", "capture", "trace", "rop", "gpu", "design", "metrics", "picture", "study",
            "report",
        ],
    ),
];

const FOUNDATION: &[&str] = &["error", "param", "random", "output", "tile"];

/// The crate's modules that a source text names, tests left out.
fn imports(source: &str) -> Vec<String> {
    let code = source.split("#[cfg(test)]").next().unwrap_or("");
    let code: String =
        code.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let named = code.split("crate::").skip(1).filter_map(|rest| {
        let name: String =
            rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
        // Macros stand at the crate's root and belong to param.
        (!rest[name.len()..].starts_with('!') && !name.is_empty()).then_some(name)
    });
    named.collect()
}

/// Imports of `module` that the flow does not allow.
fn against_the_flow(module: &str, source: &str) -> Vec<String> {
    let allowed = FLOW.iter().find(|(name, _)| *name == module).expect(module).1;
    imports(source)
        .into_iter()
        .filter(|name| {
            name != module
                && !FOUNDATION.contains(&name.as_str())
                && !allowed.contains(&name.as_str())
        })
        .collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

#[test]
fn every_import_follows_the_flow() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = Vec::new();
    for path in sources(&root) {
        let relative = path.strip_prefix(&root).unwrap();
        let first = relative.components().next().unwrap().as_os_str().to_string_lossy();
        let module = first.trim_end_matches(".rs").to_string();
        // Files of tests may look at anything.
        if module == "lib" || module == "main" || relative.ends_with("tests.rs") {
            continue;
        }
        let source = fs::read_to_string(&path).unwrap();
        let wrong = against_the_flow(&module, &source);
        assert!(wrong.is_empty(), "{} imports {wrong:?}", relative.display());
        seen.push(module);
    }
    for (module, _) in FLOW {
        assert!(seen.iter().any(|m| m == module), "there is no module '{module}'");
    }
}

#[test]
fn the_flow_has_no_circle() {
    for (i, (module, allowed)) in FLOW.iter().enumerate() {
        for name in *allowed {
            let place = FLOW.iter().position(|(m, _)| m == name);
            assert!(place.is_some_and(|p| p < i), "{module} imports {name}, which comes later");
        }
    }
}

#[test]
fn a_planted_import_is_found() {
    let planted = "use crate::error::Result;\nuse crate::design::DESIGNS;\n";
    assert_eq!(against_the_flow("rop", planted), ["design"]);
    assert_eq!(against_the_flow("trace", "let s = crate::scene::load(\"x\");"), ["scene"]);
    assert!(against_the_flow("rop", "crate::options! {}\nuse crate::trace::Trace;").is_empty());
}
