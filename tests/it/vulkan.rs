//! Captures of other programs, end to end: the command runs a program under the layer, makes a
//! trace and holds it against the program's picture.
//!
//! They need a Vulkan driver, the layer beside the program (`cargo build`), and what each names:
//! the test program (`cargo build -p screendoor-vulkan-layer --examples`), gfxrecon-replay,
//! vkcube and a display. So all are ignored unless asked for, and fail where something is absent.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use screendoor::trace::Trace;
use screendoor_vulkan_layer::log::{Entry, Event, Files, RECORD_BYTES, Record, entries};
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_screendoor");

/// How far a replay may be from an 8-bit picture, of 255: blending rounds at each layer.
const ROUNDING: f64 = 3.5;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap()
}

/// The program that draws in many ways.
fn raw() -> PathBuf {
    let path = Path::new(PROGRAM).with_file_name("examples").join("raw");
    let hint = "cargo build -p screendoor-vulkan-layer --examples";
    assert!(path.exists(), "{} is not there: {hint}", path.display());
    path
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Captures what `program` draws, with further arguments; what the command says as JSON.
fn capture(folder: &Path, arguments: &[&str], program: &[&str]) -> (Output, Value) {
    let json = folder.join("capture.json");
    let _ = std::fs::remove_file(&json);
    let output = Command::new(PROGRAM)
        .current_dir(folder)
        .args(["capture", "--vulkan", "--json", "capture.json", "-q"])
        .args(arguments)
        .arg("--")
        .args(program)
        .output()
        .unwrap();
    let text = std::fs::read_to_string(json).unwrap_or_else(|_| "null".into());
    (output, serde_json::from_str(&text).unwrap())
}

/// How far a checked capture is from the program's picture, of 255.
fn greatest(case: &str, document: &Value) -> f64 {
    let check = &document["check"];
    assert!(check["incomparable"].is_null(), "{case}: {check}");
    check["greatest"].as_f64().unwrap_or_else(|| panic!("{case}: {check}"))
}

/// Cases that cannot be held against their picture, or are far from it, and why.
const APART: [(&str, &str); 5] = [
    ("integer-target", "whole numbers"),
    ("resolve-command", "not resolved by its last pass"),
    // Their submissions wait for the host.
    ("timeline", "no picture"),
    ("timeline-behind", "no picture"),
    ("timeline-twice", "no picture"),
];

#[test]
#[ignore = "needs a Vulkan driver and the test program"]
fn whatever_is_drawn_is_in_the_trace_or_told() {
    let list = Command::new(raw()).arg("--list").output().unwrap();
    let list = told(&list);
    let cases = list.lines().filter_map(|line| line.split_whitespace().next());
    let folder = folder();
    let raw = raw();
    let (mut exact, mut refused) = (0, 0);
    for case in cases.filter(|case| !["forever", "killed"].contains(case)) {
        let program = [raw.to_str().unwrap(), case, "out"];
        let (output, document) = capture(folder.path(), &["--check", "-o", "t.arrow"], &program);
        let said = told(&output);
        if said.contains("unsupported:") {
            println!("{case}: skipped, the device cannot");
            continue;
        }
        assert!(output.status.success(), "{case}: {said}");
        let why = APART.iter().find(|(name, _)| *name == case).map(|(_, why)| why);
        if let Some(why) = why {
            let told = document["check"]["incomparable"].as_str().unwrap();
            assert!(told.contains(why), "{case}: {told}");
            continue;
        }
        // What is drawn by designs or pipelines that no trace can hold is refused by draw.
        if !document["refused"].as_array().unwrap().is_empty() {
            let warnings = document["warnings"].to_string();
            assert!(warnings.contains("not in the trace"), "{case}: {warnings}");
            refused += 1;
            continue;
        }
        let caveats = document["check"]["caveats"].as_array().unwrap();
        if !caveats.is_empty() {
            continue;
        }
        // 134 layers round 134 times.
        let limit = if case == "grow" { 134.0 / 2.0 } else { ROUNDING };
        let greatest = greatest(case, &document);
        assert!(greatest <= limit, "{case}: {greatest} of 255");
        assert!(document["fragments"].as_u64().unwrap() > 10_000, "{case}: {document}");
        exact += 1;
    }
    assert!(exact >= 45 && refused >= 15, "{exact} exact, {refused} refused");
}

/// Fragments of a trace by pixel, coverage and primitive.
fn of_trace(trace: &Trace) -> BTreeMap<(u16, u16, u64, u32), u32> {
    let mut all = BTreeMap::new();
    for batch in trace.batches() {
        for f in batch.unwrap().iter() {
            *all.entry((f.x, f.y, f.coverage.0, f.primitive)).or_default() += 1;
        }
    }
    all
}

#[test]
#[ignore = "needs a Vulkan driver"]
fn our_own_capture_by_a_gpu_is_seen_as_it_sees_itself() {
    let folder = folder();
    let path = folder.path();
    let scene = ["builtin:glass", "--gpu", "--size", "200x200", "-o", "own.arrow"];
    let program: Vec<&str> = [PROGRAM, "capture"].into_iter().chain(scene).collect();
    let (output, _) = capture(path, &["--keep", "kept", "-o", "t.arrow"], &program);
    assert!(output.status.success(), "{}", told(&output));
    let own = of_trace(&Trace::open(path.join("own.arrow")).unwrap());
    let logs = std::fs::read_dir(path.join("kept")).unwrap().map(|e| e.unwrap().path());
    let log = logs.into_iter().find(|p| p.extension().is_some_and(|e| e == "log")).unwrap();
    let (entries, torn) = entries(&std::fs::read(&log).unwrap()).unwrap();
    assert!(!torn);
    let bytes = std::fs::read(Files::of(&log).records).unwrap();
    // Of the passes that draw the scene, each of which sees all or a part of it: the largest.
    let seen = entries.iter().filter_map(|entry| match entry {
        Entry::Submission(s) => Some(s),
        _ => None,
    });
    let largest = seen.max_by_key(|s| s.records).unwrap();
    let draws = largest.events.iter().filter(|e| matches!(e, Event::Draw(_))).count();
    assert_eq!(draws, 1);
    let mut found = BTreeMap::new();
    for n in largest.first..largest.first + largest.records {
        let at = n as usize * RECORD_BYTES;
        let r = Record::from_bytes(&bytes[at..at + RECORD_BYTES]).unwrap();
        let coverage = u64::from(r.coverage & 0x7fff_ffff);
        let key = (r.x() as u16, r.y() as u16, coverage, r.primitive);
        *found.entry(key).or_insert(0_u32) += 1;
    }
    assert!(own.len() > 10_000, "{}", own.len());
    assert_eq!(found, own);
}

#[test]
#[ignore = "needs gfxrecon-replay (Debian: gfxreconstruct) and a Vulkan driver"]
fn recorded_streams_give_the_traces_that_the_programs_gave() {
    let folder = folder();
    for name in ["glass", "markers"] {
        let place = |ending| {
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("traces/programs/{name}.{ending}"))
        };
        let stream = place("gfxr");
        let program = ["gfxrecon-replay", stream.to_str().unwrap()];
        let (output, document) = capture(folder.path(), &["--check", "-o", "t.arrow"], &program);
        assert!(output.status.success(), "{name}: {}", told(&output));
        assert!(greatest(name, &document) <= ROUNDING, "{name}: {document}");
        let diff = Command::new(PROGRAM)
            .arg("diff")
            .arg(folder.path().join("t.arrow"))
            .arg(place("arrow"))
            .output()
            .unwrap();
        // They are of two programs, but of the same fragments.
        assert!(diff.status.success(), "{name}: {}", told(&diff));
    }
}

#[test]
#[ignore = "needs vkcube (Debian: vulkan-tools) and a display"]
fn a_program_that_presents_is_captured_frame_by_frame() {
    let folder = folder();
    let program = ["vkcube", "--c", "12"];
    let mut contents = Vec::new();
    for frame in ["0", "7"] {
        let arguments = ["--frame", frame, "--target", "present", "--check", "-o", "t.arrow"];
        let (output, document) = capture(folder.path(), &arguments, &program);
        assert!(output.status.success(), "{}", told(&output));
        // One opaque cube: nothing to round.
        assert_eq!(greatest("vkcube", &document), 0.0);
        assert_eq!(document["frame"], format!("frame {frame}"));
        contents.push(document["content"].as_str().unwrap().to_string());
    }
    assert_ne!(contents[0], contents[1], "the cube turns");
    let (output, _) = capture(folder.path(), &["--frame", "50", "-o", "none.arrow"], &program);
    let said = told(&output);
    assert!(!output.status.success() && said.contains("50") && said.contains("12"), "{said}");
    assert!(!folder.path().join("none.arrow").exists());
}

#[test]
#[ignore = "needs glxgears (Debian: mesa-utils), Mesa's OpenGL and a display"]
fn opengl_over_zink_is_captured_and_the_program_ended() {
    let folder = folder();
    // Zink takes no software driver unless it is told to.
    let program = ["env", "LIBGL_ALWAYS_SOFTWARE=1", "glxgears"];
    let arguments = ["--opengl", "--stop", "--frame", "2", "--check", "-o", "t.arrow"];
    let (output, document) = capture(folder.path(), &arguments, &program);
    assert!(output.status.success(), "{}", told(&output));
    // Opaque gears: nothing to round.
    assert_eq!(greatest("glxgears", &document), 0.0);
    assert!(document["refused"].as_array().unwrap().is_empty(), "{document}");
    assert!(document["fragments"].as_u64().unwrap() > 10_000, "{document}");
}

#[test]
#[ignore = "needs a Vulkan driver and the test program"]
fn a_program_that_is_killed_leaves_no_trace() {
    let folder = folder();
    let raw = raw();
    let program = [raw.to_str().unwrap(), "killed", "out"];
    let arguments = ["--frame", "2", "-o", "killed.arrow"];
    let (output, _) = capture(folder.path(), &arguments, &program);
    let said = told(&output);
    assert!(!output.status.success() && said.contains("ended within frame 2"), "{said}");
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "out")
        .collect();
    assert!(left.is_empty(), "{left:?}");
}
