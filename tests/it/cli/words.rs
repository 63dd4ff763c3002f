//! What the program says, and what it takes.

use super::*;

use screendoor::picture::{Layer, Picture, write_exr};
use screendoor::tile::TileGrid;

#[test]
fn verify_checks_every_file() {
    let place = Workplace::with_trace();
    let whole = fs::read(place.path("t.arrow")).unwrap();
    fs::write(place.path("cut.arrow"), &whole[..whole.len() - 9]).unwrap();
    let output = place.run(&["verify", "cut.arrow", "absent.arrow", "t.arrow"]);
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines.len(), 2, "{error}");
    assert!(lines[0].contains("cut.arrow") && lines[1].contains("absent.arrow"), "{error}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("t.arrow: "));
}

#[test]
#[cfg(unix)]
fn a_full_standard_error_is_no_panic() {
    if Path::new("/dev/full").exists() {
        let place = Workplace::new();
        for command in ["info absent", "verify absent", "capture nothing.obj -o x.arrow"] {
            let (code, _) = shell(&place, &format!("exec \"$PROGRAM\" {command} 2>/dev/full"));
            assert_eq!(code, Some(1), "{command}");
        }
        let (code, _) = shell(&place, "exec \"$PROGRAM\" frobnicate 2>/dev/full");
        assert_eq!(code, Some(2));
    }
}

#[test]
fn endings_say_the_format_in_any_case() {
    let place = Workplace::with_trace();
    place.good(&["replay", "t.arrow", "-o", "a.EXR", "-o", "a.Png"]);
    assert!(picture::read(place.path("a.EXR"), Some("colour")).is_ok());
    assert!(picture::read(place.path("a.Png"), None).is_ok());
    place.good(&["compare", "a.EXR", "a.Png", "-o", "d.Exr"]);
    let (code, error) = place.bad(&["compare", "a.EXR", "a.Png", "-o", "d.png"]);
    assert!(code == 2 && error.contains("name a .exr file"), "{error}");
    let (code, error) = place.bad(&["capture", "builtin:ramps", "-o", "-"]);
    assert!(code == 2 && error.contains("standard output"), "{error}");
    assert!(!place.path("-").exists() && !place.path("d.png").exists());
}

#[test]
fn what_is_not_finite_is_refused_and_counted() {
    let place = Workplace::new();
    for colour in ["1e38,0,0", "-1,-1,-1", "65505,0,0", "inf,0,0", "nan,0,0"] {
        let background = format!("--background={colour}");
        let (code, error) = place.bad(&["capture", "builtin:ramps", "-o", "x.arrow", &background]);
        assert!(code == 2 && error.contains(colour), "{error}");
    }
    let grid = TileGrid::new(20, 20);
    for (name, odd) in [("nan.exr", f64::NAN), ("inf.exr", f64::INFINITY), ("good.exr", 1.0)] {
        let pixel = |x, y| if y == 3 && x < 2 { [0.5, odd, 0.5] } else { [0.5; 3] };
        let picture = Picture::from_fn(grid, pixel);
        write_exr(place.path(name), &[Layer { name: "colour", picture: &picture }]).unwrap();
    }
    for (a, b) in [("nan.exr", "nan.exr"), ("good.exr", "nan.exr"), ("inf.exr", "good.exr")] {
        let output = place.run(&["compare", a, b]);
        let error = String::from_utf8_lossy(&output.stderr).to_string();
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.contains("2 of its 400 pixels are NaN or infinite"), "{error}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn a_transparent_scene_gives_no_nonsense() {
    let place = Workplace::new();
    let scene = "builtin:layers:alpha=0";
    let output = place.run(&["demo", "--scene", scene, "-o", "out"]);
    let text = String::from_utf8_lossy(&output.stdout).to_string();
    assert!(output.status.success() && !text.contains("NaN"), "{text}");
    assert!(text.contains(" - "), "{text}");
    let output = place.run(&["capture", scene, "-o", "x.arrow", "--size", "9x9"]);
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(error.contains("all of the scene is transparent"), "{error}");
    let text = place.good(&["replay", "x.arrow", "--seeds", "2"]);
    assert!(text.contains("no pixel holds a fragment") && !text.contains("NaN"), "{text}");
}

#[test]
#[cfg(unix)]
fn names_from_others_cannot_command_the_terminal() {
    use std::os::unix::ffi::OsStrExt;
    let place = Workplace::new();
    let odd = "red\u{1b}[31m\nline.obj";
    fs::write(place.path(odd), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    place.good(&["capture", odd, "-o", "t\u{1b}.arrow", "--size", "20x20"]);
    for command in ["info", "replay", "verify"] {
        let text = place.good(&[command, "t\u{1b}.arrow"]);
        assert!(!text.contains('\u{1b}') && text.contains("t\\u{1b}.arrow"), "{text}");
    }
    let info = place.good(&["info", "t\u{1b}.arrow"]);
    assert!(info.contains("red\\u{1b}[31m\\nline.obj"), "{info}");
    let (_, error) = place.bad(&["info", "gone\u{1b}\n.arrow"]);
    assert!(!error.contains('\u{1b}') && error.trim_end().lines().count() == 1, "{error}");

    let name = std::ffi::OsStr::from_bytes(b"caf\xe9.obj");
    let capture = |name| {
        let mut command = Command::new(PROGRAM);
        command.arg("capture").arg(name).args(["-o", "x.arrow"]);
        command.current_dir(place.0.path()).output().unwrap()
    };
    let output = capture(name);
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(output.status.code() == Some(2) && error.contains("rename"), "{error}");
}

#[test]
fn numbers_below_zero_are_told_what_is_allowed() {
    let place = Workplace::with_trace();
    let cases: &[(&[&str], &str)] = &[
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--order-seed", "-3"], "0..=4294967295"),
        (&["explain", "t.arrow", "--pixel", "-1,0"], "give whole numbers from 0"),
        (&["replay", "t.arrow", "--seed", "-3"], "0..=4294967295"),
        (&["replay", "t.arrow", "--seeds", "-3"], "1..=100000"),
        (&["replay", "t.arrow", "--samples", "-8"], "is 1, 2, 4, 8, 16, 32 or 64"),
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--alpha", "-1"], "lies in [0, 1]"),
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--fov", "-5"], "field of view"),
    ];
    for (arguments, says) in cases {
        let (code, error) = place.bad(arguments);
        assert!(code == 2 && error.contains(says), "{arguments:?}: {error}");
        assert!(!error.contains("use '--"), "{error}");
    }
}

#[test]
fn lists_and_the_demo_come_as_json() {
    let place = Workplace::new();
    let scenes: Value = serde_json::from_str(&place.good(&["scenes", "--json", "-"])).unwrap();
    let scenes = &scenes["scenes"];
    let builtins = screendoor::scene::builtin::BUILTINS;
    assert_eq!(scenes.as_array().unwrap().len(), builtins.len());
    assert_eq!(scenes[0]["params"][0]["name"], builtins[0].params[0].name);
    let demo = place.good(&["demo", "--scene", "builtin:layers:alpha=0", "--json", "-"]);
    let demo: Value = serde_json::from_str(&demo).unwrap();
    assert_eq!(demo["runs"].as_array().unwrap().len(), 9);
}

#[test]
fn fragments_that_a_replay_leaves_out_are_accounted_for() {
    let place = Workplace::new();
    place.good(&["capture", "builtin:hair", "-o", "h.arrow", "--size", "60x60"]);
    let text = place.good(&["replay", "h.arrow", "--samples", "2"]);
    assert!(text.contains("the others cover none of the first 2 samples"), "{text}");
    assert!(!place.good(&["replay", "h.arrow"]).contains("the others"));
}

#[test]
fn a_negative_square_is_explained() {
    let place = Workplace::with_trace();
    // Unbiased: of these estimates about half are below 0.
    let texts = ["1", "2", "3", "4", "5", "6"].map(|seed| {
        let enderton = ["replay", "t.arrow", "-d", "enderton", "--samples", "4", "--seeds", "2"];
        place.good(&[&enderton[..], &["--seed", seed]].concat())
    });
    let negative: Vec<&str> =
        texts.iter().flat_map(|t| t.lines()).filter(|l| l.contains("squared bias -")).collect();
    assert!(!negative.is_empty());
    assert!(negative.iter().all(|line| line.contains("scatters around 0")));
}

#[test]
#[cfg(unix)]
fn a_reader_that_has_seen_enough_is_no_error() {
    let place = Workplace::with_trace();
    for command in ["designs", "info t.arrow", "explain t.arrow --pixel 24,36", "designs --json -"]
    {
        let (code, error) =
            shell(&place, &format!("\"$PROGRAM\" {command} | head -n 1 >/dev/null"));
        assert_eq!((code, error.as_str()), (Some(0), ""), "{command}");
        let (_, error) = shell(&place, &format!("\"$PROGRAM\" {command} >&-"));
        assert!(!error.contains("panicked"), "{error}");
    }
}
