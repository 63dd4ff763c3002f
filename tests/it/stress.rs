//! The suite of hard cases, hostile claims and faults, as `screendoor stress` runs it.

use std::process::Command;

use serde_json::Value;

use crate::measured::{BESIDE, Run};
use crate::util::gpu;

/// Runs the command. Returns what it found and what it said.
fn stress(arguments: &[&str]) -> (Value, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let [json, tables] = ["found.json", "tables.md"].map(|name| folder.path().join(name));
    let outputs = ["--json", "found.json", "-o", "tables.md"];
    let run = Run::changed(
        folder.path(),
        &[&["--quiet", "stress"], arguments, &outputs].concat(),
        |_| (),
    );
    let said = run.error.clone();
    // Mesa's driver makes machine code of hundreds of programs and keeps it.
    let driver = if gpu().is_some() { 2048 } else { 0 };
    run.is_good(BESIDE + driver, "stress");
    let found = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    (found, std::fs::read_to_string(tables).unwrap(), said)
}

#[test]
pub(crate) fn nothing_that_is_promised_is_broken_and_nothing_is_lost() {
    let (found, tables, said) = stress(&["--seeds", "16"]);
    assert!(!said.contains("fault of screendoor"), "{said}");
    assert!(tables.contains("Everything below keeps what is promised of it."));
    let list = |name: &str| found[name].as_array().unwrap().clone();
    // Every design of the registry on every case, and the exact one exact everywhere.
    let findings = list("findings");
    assert_eq!(findings.len(), list("cases").len() * list("series").len());
    assert!(screendoor::design::DESIGNS.len() <= list("series").len());
    let of = |design: &str| {
        findings.iter().filter(|f| f["design"] == design).cloned().collect::<Vec<_>>()
    };
    assert!(of("exact").iter().all(|f| f["outcome"] == "exact"));
    // The suite is hard: what is no more than an approximation shows.
    assert!(of("blend").iter().filter(|f| f["outcome"] == "degraded").count() > 20);
    assert!(of("wboit").iter().any(|f| f["outcome"] == "not-finite"));
    assert!(list("claims").len() > 10 && list("claims").iter().all(|c| c["held"] == true));
    let faults = list("faults");
    for fault in &faults {
        assert_eq!(fault["failures"], Value::Array(Vec::new()), "{fault}");
        let [tries, done, survived] =
            ["tries", "done", "survived"].map(|name| fault[name].as_u64().unwrap());
        assert!(tries == done + survived, "{fault}");
    }
    if cfg!(target_os = "linux") {
        // Each brought about, and at least once met by it.
        let required = std::env::var_os("SCREENDOOR_GPU").is_some_and(|v| v == "require");
        assert!(
            faults.len() >= 9 + usize::from(required)
                && faults.iter().all(|f| f["survived"].as_u64() > Some(0))
        );
    }
}

#[test]
fn pixels_that_are_not_finite_are_announced() {
    use screendoor::trace::{ColourFormat, Fragment};

    let header =
        screendoor::trace::Header { colour: ColourFormat::F32, ..crate::util::header(8, 8, 8) };
    let bright = crate::util::layered(&header, 8, |i| (i << 20, [f32::MAX; 3], 0.9));
    let bright: Vec<Fragment> = bright.into_iter().collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bright.arrow");
    let bytes = crate::util::trace_bytes(&header, &bright, Default::default());
    std::fs::write(&path, bytes).unwrap();
    let replay = |design: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_screendoor"))
            .arg("replay")
            .arg(&path)
            .args(["--design", design, "--samples", "8"])
            .output()
            .unwrap();
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert!(replay("wboit").contains("64 pixels are NaN or infinite"), "{}", replay("wboit"));
    // What keeps samples has none.
    assert!(!replay("lk").contains("NaN"), "{}", replay("lk"));
}

#[test]
fn the_document_is_of_this_suite() {
    let text = include_str!("../../docs/STABILITY.md");
    let cases = screendoor::study::stress::cases();
    let designs = screendoor::design::DESIGNS.iter();
    let missing: Vec<String> = cases
        .iter()
        .map(|c| format!("- **{}**: {}\n", c.name, c.what))
        .chain(designs.map(|d| format!("\n| `{}` | ", d.info.name)))
        .filter(|part| !text.contains(part))
        .collect();
    assert!(missing.is_empty(), "run 'screendoor stress -o docs/STABILITY.md': {missing:?}");
}
