//! What `capture` tells of a scene, and what it does with `--strict`.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::Workplace;

fn with_input(names: &[&str]) -> Workplace {
    let place = Workplace::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/inputs/gltf");
    for name in names {
        fs::copy(folder.join(name), place.path(name)).unwrap();
    }
    place
}

/// The lines of standard error, without what comes before the message.
fn lines(error: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(error);
    let lines = text.lines().filter_map(|l| l.strip_prefix("screendoor: "));
    lines.filter(|l| l.contains(": ")).map(str::to_string).collect()
}

#[test]
fn strict_makes_errors_of_warnings_and_writes_nothing() {
    let place = with_input(&["anim_no_node.gltf", "morph.gltf"]);
    let capture = |file: &str, more: &[&str]| {
        let arguments = ["capture", file, "-o", "t.arrow", "--size", "16x16", "--samples", "4"];
        place.run(&[&arguments, more].concat())
    };
    // What the file says is told before anything is drawn.
    let output = capture("anim_no_node.gltf", &["--strict"]);
    assert_eq!(output.status.code(), Some(1));
    let said = lines(&output.stderr);
    let warning = "anim_no_node.gltf: its animation '' is not played (0 triangles)";
    assert!(said.iter().any(|l| l == &format!("warning: {warning}")), "{said:?}");
    let error = said.last().unwrap();
    assert!(error.starts_with("error: anim_no_node.gltf: there is a warning"), "{error}");
    assert!(error.contains(warning) && error.contains("--strict"), "{error}");
    assert!(!place.path("t.arrow").exists());
    // What the drawing shows is told before the trace is in its place.
    let transparent = ["--alpha", "0", "--strict", "-q"];
    let output = capture("morph.gltf", &transparent);
    assert_eq!(output.status.code(), Some(1));
    let said = lines(&output.stderr);
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("no fragment of object 0, 'node 0', was recorded"), "{said:?}");
    assert!(said[0].contains("there are 2 warnings"), "{said:?}");
    let left: Vec<_> =
        fs::read_dir(place.path(".")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
    // Without a warning it changes nothing.
    assert!(capture("morph.gltf", &["--strict"]).status.success());
    assert!(place.path("t.arrow").exists());
}

#[test]
fn options_that_change_nothing_are_told_of() {
    let place = Workplace::new();
    // A splat of antimatter15's: place, sizes, colour and opacity, turn.
    let mut splat: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    splat.extend([255, 128, 0, 200, 255, 128, 128, 128]);
    fs::write(place.path("a.splat"), splat).unwrap();
    fs::write(place.path("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    image::RgbImage::new(1, 1).save(place.path("a.png")).unwrap();
    let told = |file: &str, more: &[&str]| {
        let arguments = ["capture", file, "-o", "t.arrow", "--size", "16x16", "--samples", "4"];
        let output = place.run(&[&arguments, more].concat());
        assert!(output.status.success());
        lines(&output.stderr).iter().filter(|l| l.starts_with("warning: ")).cloned().collect()
    };
    let all = ["--faces", "both", "--texture", "a.png", "--splat-rules", "gsplat"];
    let found: Vec<String> = told("a.splat", &all);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].contains("a.png: splats show no texture"), "{found:?}");
    assert!(found[1].contains("faces 'both' changes nothing"), "{found:?}");
    let found: Vec<String> = told("a.obj", &all);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("splat rules 'gsplat' change nothing"), "{found:?}");
}

/// An OBJ file of several objects, each with its own reason not to be seen from the front.
const UNSEEN: &str = "mtllib a.mtl
v -1 -1 0\nv 1 -1 0\nv 0 1 0
v 0 0 0.01\nv 0.00001 0 0.01\nv 0 0.00001 0.01
v 5 5 0\nv 6 5 0\nv 5 6 0
o seen\nf 1 2 3
o thin\nf 4 5 6
o clear\nusemtl clear\nf 1 2 3\nf 1 2 4
o mixed\nf 1 2 3\nf 4 5 6
";

#[test]
fn objects_without_fragments_are_listed_with_the_reason() {
    let place = Workplace::new();
    fs::write(place.path("a.obj"), UNSEEN).unwrap();
    fs::write(place.path("a.mtl"), "newmtl clear\nd 0\n").unwrap();
    let arguments = [
        "capture",
        "a.obj",
        "-o",
        "t.arrow",
        "--size",
        "16x16",
        "--samples",
        "4",
        "--angle",
        "0,0",
        "--fov",
        "0",
        "--json",
        "t.json",
    ];
    let output = place.run(&arguments);
    assert!(output.status.success());
    let said = lines(&output.stderr);
    let told = |object: u32, name: &str, reason: &str| {
        let line =
            format!("warning: no fragment of object {object}, '{name}', was recorded: {reason}");
        assert!(said.contains(&line), "{line}: {said:?}");
    };
    let clear = "wholly transparent (its material 'clear' has the alpha 0)";
    told(1, "thin", "its one triangle is so small that no sample is covered");
    told(2, "clear", &format!("its 2 triangles are {clear}"));
    told(
        3,
        "mixed",
        &format!("of its 2 triangles 1 {clear}, 1 so small that no sample is covered"),
    );
    let figures: Value = serde_json::from_slice(&fs::read(place.path("t.json")).unwrap()).unwrap();
    let unseen = figures["unseen"].as_array().unwrap();
    assert_eq!(unseen.len(), 3);
    assert_eq!(
        (unseen[1]["object"].as_u64(), unseen[1]["primitives"].as_u64()),
        (Some(2), Some(2))
    );
    assert_eq!(unseen[1]["reason"], format!("its 2 triangles are {clear}"));
}

#[test]
fn many_objects_without_fragments_are_counted() {
    let place = Workplace::new();
    let mut text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl c\n".to_string();
    (0..30).for_each(|i| text += &format!("o n{i}\nf 1 2 3\n"));
    fs::write(place.path("a.obj"), text).unwrap();
    fs::write(place.path("a.mtl"), "newmtl c\nd 0\n").unwrap();
    let output =
        place.run(&["capture", "a.obj", "-o", "t.arrow", "--size", "8x8", "--samples", "1"]);
    let said = lines(&output.stderr);
    let few = said.iter().filter(|l| l.contains("no fragment of object")).count();
    assert_eq!(few, 20, "{said:?}");
    assert!(said.iter().any(|l| l.contains("nor was one of 10 more objects")), "{said:?}");
}
