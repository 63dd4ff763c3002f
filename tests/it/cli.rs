//! The program as its users run it.

mod compare;
mod edits;
mod gpu;
mod outputs;
mod shade;
mod study;
mod told;
mod traps;
mod vulkan;
mod words;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use screendoor::picture;
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_screendoor");

/// A folder of its own and the program run in it.
struct Workplace(tempfile::TempDir);

impl Workplace {
    fn new() -> Self {
        Workplace(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(PROGRAM).args(arguments).current_dir(self.0.path()).output().unwrap()
    }

    /// Runs what must succeed; its standard output.
    fn good(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let error = String::from_utf8_lossy(&output.stderr).to_string();
        assert!(output.status.success(), "{arguments:?}: {error}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs what must fail; its exit code and its one line of error.
    fn bad(&self, arguments: &[&str]) -> (i32, String) {
        let output = self.run(arguments);
        let error = String::from_utf8_lossy(&output.stderr).to_string();
        let code = output.status.code().unwrap_or_else(|| panic!("{arguments:?}: {error}"));
        assert!(code == 1 || code == 2, "{arguments:?} ended with {code}: {error}");
        (code, error)
    }

    /// Whether a process has begun a file here: one without a name yet, or with a temporary one.
    #[cfg(unix)]
    fn has_begun(&self, process: u32) -> bool {
        let mut named = fs::read_dir(self.0.path()).unwrap().flatten();
        let own = |e: fs::DirEntry| e.file_name().to_string_lossy().ends_with(".partial");
        let mut open = fs::read_dir(format!("/proc/{process}/fd")).into_iter().flatten().flatten();
        let folder = self.0.path().canonicalize().unwrap();
        let unnamed = |e: fs::DirEntry| {
            fs::read_link(e.path()).is_ok_and(|place| {
                place.starts_with(&folder) && place.to_string_lossy().ends_with(" (deleted)")
            })
        };
        named.any(own) || open.any(unnamed)
    }

    /// A small trace to work on.
    fn with_trace() -> Self {
        let place = Workplace::new();
        place.good(&["capture", "builtin:ramps", "-o", "t.arrow", "--size", "48x40"]);
        place
    }
}

#[test]
fn a_scene_becomes_a_trace_a_picture_and_figures() {
    let place = Workplace::with_trace();
    let info: Value =
        serde_json::from_str(&place.good(&["info", "t.arrow", "--json", "-"])).unwrap();
    let fragments = info["statistics"]["fragments"].as_u64().unwrap();
    assert!(fragments > 1000);
    assert_eq!(info["header"]["width"], 48);
    let said = place.good(&["info", "t.arrow"]);
    assert!(said.contains("depth complexity"));
    // The view, in numbers for programs and rounded for people.
    let view = &info["header"]["view"];
    let number = |key: &str| view[key].as_f64().unwrap();
    assert!(view["projection"] == "orthographic" && number("near") < number("far"), "{view}");
    for (key, name) in [("world_to_view", "world to view"), ("view_to_clip", "view to clip")] {
        assert_eq!(view[key].as_array().unwrap().len(), 16);
        let first = format!("  {name:<16}{:>14.6}", view[key][0].as_f64().unwrap());
        assert!(said.contains(&first), "{first} in {said}");
    }
    let planes =
        format!("orthographic, from {:.6} to {:.6} scene units", number("near"), number("far"));
    assert!(said.contains(&planes), "{planes} in {said}");
    assert!(place.good(&["verify", "t.arrow"]).contains("hold"));
    // A trace of before there were views.
    let old = concat!(env!("CARGO_MANIFEST_DIR"), "/traces/ramps.arrow");
    let info: Value = serde_json::from_str(&place.good(&["info", old, "--json", "-"])).unwrap();
    assert!(info["header"]["view"].is_null() && !place.good(&["info", old]).contains("to clip"));

    let json = place.good(&[
        "replay",
        "t.arrow",
        "--design",
        "lk",
        "--samples",
        "8",
        "--seed",
        "3",
        "--exact",
        "--json",
        "-",
        "-o",
        "a.exr",
        "-o",
        "a.png",
    ]);
    let result: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&result["design"], &result["samples"]), (&"lk".into(), &8.into()));
    assert!(result["errors"]["frame"]["rmse"]["value"].as_f64().unwrap() > 0.1);
    assert!(result["events"]["fragments"].as_u64().unwrap() <= fragments);
    let colour = picture::read(place.path("a.exr"), Some("colour")).unwrap();
    assert_eq!((colour.width(), colour.height()), (48, 40));
    for layer in ["reference", "error"] {
        assert!(picture::read(place.path("a.exr"), Some(layer)).is_ok());
    }
    assert!(picture::read(place.path("a.png"), None).is_ok());

    // The figures that compare gives are those that replay gave.
    let compared = place.good(&[
        "compare",
        "a.exr",
        "a.exr",
        "--layer",
        "colour",
        "--reference-layer",
        "reference",
        "--json",
        "-",
    ]);
    let compared: Value = serde_json::from_str(&compared).unwrap();
    let (a, b) = (&compared["errors"]["rmse"], &result["errors"]["frame"]["rmse"]["value"]);
    assert!((a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1e-4);
    assert!(place.good(&["compare", "a.png", "a.png"]).contains("identical"));
}

#[test]
fn the_same_run_gives_the_same_picture_whatever_the_threads() {
    let place = Workplace::with_trace();
    let hash = |threads: &str, window: &str| {
        let json = place.good(&[
            "--threads",
            threads,
            "replay",
            "t.arrow",
            "--samples",
            "16",
            "--window",
            window,
            "--json",
            "-",
        ]);
        serde_json::from_str::<Value>(&json).unwrap()["picture"].clone()
    };
    assert_eq!(hash("1", "1000000"), hash("2", "333"));
    place.good(&[
        "--threads",
        "1",
        "capture",
        "builtin:ramps",
        "-o",
        "one.arrow",
        "--size",
        "48x40",
    ]);
    let (a, b) = (fs::read(place.path("t.arrow")), fs::read(place.path("one.arrow")));
    assert_eq!(a.unwrap(), b.unwrap());
}

#[test]
fn several_seeds_tell_variance_from_bias() {
    let place = Workplace::with_trace();
    let json = place.good(&["replay", "t.arrow", "--samples", "4", "--seeds", "8", "--json", "-"]);
    let errors = &serde_json::from_str::<Value>(&json).unwrap()["errors"]["covered"];
    assert_eq!(errors["seeds"], 8);
    assert!(errors["variance"].as_f64().unwrap() > 1.0);
    assert!(
        errors["bias_squared"]["value"].as_f64().unwrap().abs()
            < errors["variance"].as_f64().unwrap() / 4.0
    );
    let rmse = &errors["rmse"];
    assert!(rmse["low"].as_f64() < rmse["value"].as_f64());
}

#[test]
fn explain_tells_the_story_of_a_pixel() {
    let place = Workplace::with_trace();
    let text = place.good(&["explain", "t.arrow", "--pixel", "24,36", "--samples", "8"]);
    for word in ["covers", "sorted", "references", "writes", "samples", "surface", "resolved"] {
        assert!(text.contains(word), "{word}:\n{text}");
    }
    let json =
        place.good(&["explain", "t.arrow", "--pixel", "24,36", "--samples", "8", "--json", "-"]);
    let story: Value = serde_json::from_str(&json).unwrap();
    let step = &story["steps"][0];
    assert_eq!(step["record"]["covered"].as_array().unwrap().len(), 8);
    assert_eq!(step["contents"]["samples"].as_array().unwrap().len(), 8);
    assert!(place.good(&["explain", "t.arrow", "--pixel", "0,0"]).contains("no fragment"));
}

#[test]
fn designs_and_scenes_are_listed_from_their_registries() {
    let place = Workplace::new();
    let list: Value = serde_json::from_str(&place.good(&["designs", "--json", "-"])).unwrap();
    let text = place.good(&["designs"]);
    let list = &list["designs"];
    for design in list.as_array().unwrap() {
        assert!(text.contains(design["citation"].as_str().unwrap()));
        for param in design["params"].as_array().unwrap() {
            assert!(text.contains(param["help"].as_str().unwrap()));
        }
    }
    assert_eq!(list.as_array().unwrap().len(), screendoor::design::DESIGNS.len());
    let scenes = place.good(&["scenes"]);
    for scene in screendoor::scene::builtin::BUILTINS {
        assert!(scenes.contains(&format!("builtin:{}", scene.name)));
    }
}

#[test]
fn wrong_requests_end_with_2_and_a_hint() {
    let place = Workplace::with_trace();
    let cases: &[(&[&str], &str)] = &[
        (&["replay", "t.arrow", "-d", "endertn"], "did you mean 'enderton'?"),
        (&["replay", "t.arrow", "--set", "sorted=false"], "did you mean 'sort'?"),
        (&["replay", "t.arrow", "--set", "sort=maybe"], "it takes true|false"),
        (&["replay", "t.arrow", "--set", "surfaces=bitmaks"], "did you mean 'bitmask'?"),
        (&["replay", "t.arrow", "--samples", "3"], "is 1, 2, 4, 8, 16, 32 or 64"),
        (&["replay", "t.arrow", "-o", "a.jpg"], "name a .exr or .png file"),
        (&["replay", "t.arrow", "--seeds", "0"], "--seeds"),
        (&["capture", "builtin:engin", "-o", "x.arrow"], "unknown built-in scene 'engin'"),
        (&["capture", "builtin:layers:count=0", "-o", "x.arrow"], "it takes 1..100000"),
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--size", "0x100"], "each side 1 to 65536"),
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--size", "999999999999x1"], "each side"),
        (
            &["capture", "builtin:ramps", "-o", "x.arrow", "--alpha", "nan"],
            "an alpha lies in [0, 1]",
        ),
        (
            &[
                "capture",
                "builtin:ramps",
                "-o",
                "x.arrow",
                "--pattern",
                "standard",
                "--samples",
                "64",
            ],
            "no standard pattern of 64",
        ),
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--fov", "500"], "field of view"),
        (&["capture", "model.step", "-o", "x.arrow"], "do not come as '.step'"),
        (&["explain", "t.arrow", "--pixel", "99,0"], "outside the frame"),
        (&["explain", "t.arrow", "--pixel", "1.5,0"], "no pixel coordinate"),
        (&["compare", "t.arrow", "t.arrow"], "replay it first"),
        (&["frobnicate"], "frobnicate"),
        (&[], "Usage"),
    ];
    for (arguments, says) in cases {
        let (code, error) = place.bad(arguments);
        assert_eq!(code, 2, "{arguments:?}: {error}");
        assert!(error.contains(says), "{arguments:?}: {error}");
    }
    assert!(!place.path("x.arrow").exists());
}

#[test]
fn a_standard_trace_serves_its_own_count_only() {
    let place = Workplace::new();
    place.good(&["capture", "builtin:ramps", "-o", "s.arrow", "--size", "20x20", "--samples", "8"]);
    place.good(&["replay", "s.arrow"]);
    let (code, error) = place.bad(&["replay", "s.arrow", "--samples", "4"]);
    assert_eq!(code, 2);
    assert!(error.contains("--samples 64"), "{error}");
}

#[test]
fn bad_files_end_with_1_and_one_line() {
    let place = Workplace::with_trace();
    let whole = fs::read(place.path("t.arrow")).unwrap();
    fs::write(place.path("cut.arrow"), &whole[..whole.len() - 9]).unwrap();
    fs::write(place.path("text.exr"), "not a picture").unwrap();
    let cases: &[(&[&str], &str)] = &[
        (&["info", "missing.arrow"], "cannot read missing.arrow: No such file"),
        (&["replay", "cut.arrow"], "cut.arrow: its end is missing (truncated)"),
        (&["verify", "t.arrow", "cut.arrow"], "cut.arrow"),
        (&["capture", "missing.obj", "-o", "x.arrow"], "cannot read missing.obj"),
        (&["compare", "text.exr", "text.exr"], "text.exr"),
        (
            &["capture", "builtin:ramps", "-o", "no/such/folder/x.arrow"],
            "cannot create no/such/folder/x.arrow: the folder no/such/folder does not exist",
        ),
        (&["capture", "builtin:ramps", "-o", "."], "it is a folder"),
        (&["capture", ".", "-o", "x.arrow"], "it is a folder"),
        (&["info", "."], "it is a folder"),
        (&["replay", "."], "it is a folder"),
        (&["explain", ".", "--pixel", "0,0"], "it is a folder"),
        (&["verify", "."], "it is a folder"),
        (&["compare", "a.exr", "."], "it is a folder"),
        (&["reproduce", "--models", "no/such/folder"], "no such folder"),
    ];
    for (arguments, says) in cases {
        let (code, error) = place.bad(arguments);
        assert_eq!(code, 1, "{arguments:?}: {error}");
        assert!(error.contains(says), "{arguments:?}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
        assert!(error.starts_with("screendoor: error: "), "{error}");
    }
}

/// Runs a shell command; exit code and standard error.
#[cfg(unix)]
fn shell(place: &Workplace, command: &str) -> (Option<i32>, String) {
    let output = Command::new("sh")
        .args(["-c", command])
        .env("PROGRAM", PROGRAM)
        .current_dir(place.0.path())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).to_string())
}

#[cfg(unix)]
fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().to_string())
        .collect();
    names.sort();
    names
}

#[test]
fn progress_stays_out_of_what_is_no_terminal() {
    let place = Workplace::with_trace();
    let output = place.run(&["replay", "t.arrow", "--exact"]);
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_demo_does_the_main_job() {
    let place = Workplace::new();
    let demo = ["demo", "--scene", "builtin:ramps", "--output", "out", "--json", "out/d.json"];
    let text = place.good(&demo);
    for design in ["lk", "enderton", "enderton-mask-naive"] {
        for samples in [4, 8, 16] {
            assert!(text.contains(&design.replace("-mask-", ":mask=")));
            for ending in ["png", "exr"] {
                assert!(place.path(&format!("out/{design}-{samples}.{ending}")).exists());
            }
        }
    }
    assert!(text.contains("at 16 samples lk has 0."), "{text}");
    assert!(place.path("out/exact.png").exists());
    let json = fs::read(place.path("out/d.json")).unwrap();
    let json: Value = serde_json::from_slice(&json).unwrap();
    assert!(json["runs"][8]["covered"]["rmse"]["value"].as_f64().unwrap() > 0.1);
}
