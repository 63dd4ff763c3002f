//! Mistakes that come naturally: what is said of them, and what they cost.

use super::*;

/// A study of one run.
const STUDY: &str = "name = 's'\ndesigns = ['lk']\nsamples = [4]\nseeds = 2\ntiming = 0\n\
    metrics = []\n[[scene]]\nname = 'r'\nsource = 'builtin:ramps'\nsize = [16, 16]\n";

fn with_study() -> Workplace {
    let place = Workplace::with_trace();
    fs::write(place.path("s.toml"), STUDY).unwrap();
    place.good(&["study", "s.toml", "-o", "out"]);
    place
}

#[test]
fn one_thing_given_for_another_is_told_with_what_to_do() {
    let place = with_study();
    fs::write(place.path("model.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let capture = "capture it first: screendoor capture";
    let cases: &[(&[&str], &str)] = &[
        (&["capture", "cloth", "-o", "x.arrow"], "did you mean 'builtin:cloth'?"),
        (&["capture", "Cloth:cells=16", "-o", "x.arrow"], "did you mean 'builtin:cloth:cells=16'?"),
        (&["capture", "Builtin:cloth", "-o", "x.arrow"], "did you mean 'builtin:cloth'?"),
        (&["capture", "clohts", "-o", "x.arrow"], "did you mean 'builtin:cloth'?"),
        (&["capture", "builtin:CLOTH", "-o", "x.arrow"], "did you mean 'cloth'?"),
        (&["capture", "builtin:model.obj", "-o", "x.arrow"], "leave 'builtin:' out"),
        (&["capture", "t.arrow", "-o", "x.arrow"], "is a trace, and a scene is asked for"),
        (&["capture", "s.toml", "-o", "x.arrow"], "scenes do not come as '.toml'"),
        (&["demo", "--scene", "cloth", "-o", "x"], "did you mean 'builtin:cloth'?"),
        (&["replay", "model.obj"], capture),
        (&["info", "model.obj"], capture),
        (&["explain", "model.obj", "--pixel", "1,1"], capture),
        (&["throughput", "model.obj"], capture),
        (&["replay", "builtin:cloth"], "screendoor capture builtin:cloth -o"),
        (&["info", "cloth"], "screendoor capture builtin:cloth -o"),
        (&["replay", "out"], "name one of the traces in out/traces"),
        (&["info", "out"], "name one of the traces in out/traces"),
        (&["info", "s.toml"], "screendoor study s.toml -o"),
        (&["replay", "a.png"], "'a.png' is a picture, and a trace is asked for"),
        (&["compare", "t.arrow", "t.arrow"], "screendoor replay t.arrow -o"),
        (&["study", "t.arrow", "s.toml", "-o", "x"], "screendoor study s.toml -o"),
        (&["study", "out", "-o", "x"], "screendoor report out"),
        (&["report", "s.toml"], "screendoor study s.toml -o"),
        (&["merge", "x", "s.toml"], "screendoor study s.toml -o"),
    ];
    for (arguments, says) in cases {
        let (code, error) = place.bad(arguments);
        assert!(code == 2 && error.contains(says), "{arguments:?}: {code}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    }
    // Each of many is told, and the others are checked.
    let output = place.run(&["verify", "model.obj", "t.arrow"]);
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(error.contains(capture) && !output.stdout.is_empty(), "{error}");
    assert!(!place.path("x.arrow").exists() && !place.path("x").exists());
}

#[test]
fn an_output_that_is_named_as_something_else_is_refused() {
    let place = with_study();
    let before = files(place.0.path());
    let cases: &[(&[&str], &str)] = &[
        (&["capture", "builtin:ramps", "-o", "x.exr"], "name a .arrow file"),
        (&["capture", "builtin:ramps", "-o", "x.PNG"], "name a .arrow file"),
        (&["capture", "builtin:ramps", "-o", "x.obj"], "name a .arrow file"),
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--json", "x.exr"], "name a .json file"),
        (&["replay", "t.arrow", "-o", "x.arrow"], "name a .exr or .png file"),
        (&["replay", "t.arrow", "-o", "x.json"], "name a .exr or .png file"),
        (&["replay", "t.arrow", "--json", "x.png"], "name a .json file"),
        (&["info", "t.arrow", "--json", "x.arrow"], "name a .json file"),
        (&["verify", "t.arrow", "--json", "x.arrow"], "name a .json file"),
        (&["explain", "t.arrow", "--pixel", "1,1", "--json", "x.png"], "name a .json file"),
        (&["throughput", "t.arrow", "--engines", "fast", "--json", "x.md"], "name a .json file"),
        (&["designs", "--json", "x.html"], "name a .json file"),
        (&["scenes", "--json", "x.toml"], "name a .json file"),
        (&["stress", "-o", "x.json"], "name a .md file"),
        (&["study", "s.toml", "-o", "x.html"], "name a folder"),
        (&["study", "s.toml", "-o", "x", "--json", "x.png"], "name a .json file"),
        (&["merge", "x.arrow", "out"], "name a folder"),
        (&["report", "-o", "x.html"], "name a folder"),
        (&["demo", "-o", "x.exr"], "name a folder"),
        (&["reproduce", "-o", "x.md"], "name a folder"),
    ];
    for (arguments, says) in cases {
        let (code, error) = place.bad(arguments);
        assert!(code == 2 && error.contains(says), "{arguments:?}: {code}: {error}");
        assert_eq!(files(place.0.path()), before, "{arguments:?}");
    }
}

#[test]
fn names_are_suggested_whatever_their_case() {
    let place = Workplace::with_trace();
    let cases: &[(&[&str], &str)] = &[
        (&["replay", "t.arrow", "--design", "LK"], "did you mean 'lk'?"),
        (&["replay", "t.arrow", "--design", "Enderton"], "did you mean 'enderton'?"),
        (&["replay", "t.arrow", "--set", "Sort=false"], "did you mean 'sort'?"),
        (&["replay", "t.arrow", "--set", "surfaces=BITMASK"], "did you mean 'bitmask'?"),
        (&["replay", "t.arrow", "--engine", "FAST"], "did you mean 'fast'?"),
        (&["throughput", "t.arrow", "--designs", "LK"], "did you mean 'lk'?"),
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--order", "API"], "did you mean 'api'?"),
        (&["Capture", "builtin:ramps", "-o", "x.arrow"], "did you mean 'capture'?"),
        (&["REPLAY", "t.arrow"], "did you mean 'replay'?"),
        (&["reproduce", "--part", "LK"], "did you mean 'lk'?"),
    ];
    for (arguments, says) in cases {
        let (code, error) = place.bad(arguments);
        assert!(code == 2 && error.contains(says), "{arguments:?}: {code}: {error}");
    }
    place.good(&["replay", "t.arrow", "-o", "a.exr"]);
    let (_, error) = place.bad(&["compare", "a.exr", "a.exr", "--layer", "COLOUR"]);
    assert!(error.contains("did you mean 'colour'?"), "{error}");
}

/// What a value is where a design's or a scene's parameter is told.
fn is_typed(value: &Value) -> bool {
    match value {
        // Numbers, and true and false, are not told as text.
        Value::String(text) => text.parse::<f64>().is_err() && text.parse::<bool>().is_err(),
        Value::Bool(_) | Value::Number(_) => true,
        _ => false,
    }
}

/// Holds all parameters within a document to it, and counts them.
fn parameters(value: &Value) -> usize {
    match value {
        Value::Object(map) => {
            let mut count = 0;
            if let Some(Value::Object(given)) = map.get("parameters") {
                assert!(given.values().all(is_typed), "{given:?}");
                count += given.len();
            }
            if map.contains_key("type") && map.contains_key("default") {
                assert!(is_typed(&map["default"]), "{map:?}");
                count += 1;
            }
            count + map.values().map(parameters).sum::<usize>()
        }
        Value::Array(list) => list.iter().map(parameters).sum(),
        _ => 0,
    }
}

#[test]
fn every_command_writes_json_with_a_schema_and_typed_parameters() {
    let place = with_study();
    place.good(&["replay", "t.arrow", "-o", "a.exr"]);
    let lit = ["capture", "builtin:glass", "-o", "c.arrow", "--size", "16x16", "--light", "key"];
    place.good(&[&lit[..], &["--light-trace", "l.arrow", "--light-size", "16x16"]].concat());
    // A command, and whether it tells of parameters.
    let commands: &[(&[&str], bool)] = &[
        (&["capture", "builtin:ramps", "-o", "x.arrow", "--size", "9x9"], false),
        (&["info", "t.arrow"], false),
        (&["verify", "t.arrow"], false),
        (&["diff", "t.arrow", "t.arrow"], false),
        (&["convert", "t.arrow", "-o", "e.arrow"], false),
        (&["trim", "t.arrow", "-o", "e.arrow", "--samples", "2"], false),
        (&["join", "t.arrow", "t.arrow", "-o", "e.arrow"], false),
        (&["shuffle", "t.arrow", "-o", "e.arrow"], false),
        (&["shade", "c.arrow", "l.arrow", "-o", "e.arrow", "--samples", "4"], true),
        (&["replay", "t.arrow", "--design", "slab", "--samples", "4"], true),
        (&["compare", "a.exr", "a.exr"], false),
        (&["explain", "t.arrow", "--pixel", "24,36", "--samples", "4"], true),
        (&["designs"], true),
        (&["scenes"], true),
        (&["throughput", "t.arrow", "--engines", "fast", "--runs", "1"], false),
        (&["demo", "--scene", "builtin:layers:count=1", "-o", "d"], false),
        (&["study", "s.toml", "-o", "out"], false),
        (&["report", "out"], false),
        (&["merge", "whole", "out"], false),
    ];
    let mut schemas = Vec::new();
    for (arguments, tells) in commands {
        let json = place.good(&[arguments, &["--json", "-"][..]].concat());
        let document: Value = serde_json::from_str(&json).unwrap();
        let schema = &document["schema"];
        let name = schema["name"].as_str().unwrap().to_string();
        assert!(name.starts_with("screendoor."), "{name}");
        assert!(schema["version"].as_u64().is_some_and(|v| v >= 1), "{name}");
        assert_eq!(parameters(&document) > 0, *tells, "{name}");
        // To a file it is the same; the demo takes its time, and prints its text beside it.
        if arguments[0] != "demo" {
            let text = place.good(&[arguments, &["--json", "f.json"][..]].concat());
            let file = fs::read(place.path("f.json")).unwrap();
            let file: Value = serde_json::from_slice(&file).unwrap();
            assert!(file["schema"] == *schema && text.is_empty(), "{text}");
        }
        schemas.push(name);
    }
    // Some commands write one document: those of studies, and those that write traces anew.
    schemas.dedup();
    assert_eq!(schemas.len(), 14);
    // The list is whole: a command has --json, or prints no figures.
    for name in crate::measured::commands() {
        let tried = commands.iter().any(|(arguments, _)| arguments[0] == name);
        // These take minutes at the least; their documents are tested elsewhere.
        assert!(tried || ["reproduce", "stress"].contains(&&*name), "{name} is not tried");
        assert!(place.good(&[&name, "--help"]).contains("--json <FILE>"), "{name}");
    }
    // The check can fail.
    assert!(!is_typed(&"8".into()) && !is_typed(&"true".into()) && is_typed(&"hash".into()));
}

#[test]
fn histograms_stand_under_their_own_headings() {
    let place = Workplace::with_trace();
    let info = place.good(&["info", "t.arrow"]);
    let lines: Vec<&str> = info.lines().collect();
    let at = |start: &str| {
        let found = lines.iter().position(|l| l.starts_with(start));
        found.unwrap_or_else(|| panic!("{start} in {info}"))
    };
    assert_eq!(at("  pixels by their fragments"), at("depth complexity") + 1);
    assert_eq!(at("  fragments by their alpha"), at("alpha") + 1);
    assert!(at("    1 ") > at("  pixels by") && at("    1 ") < at("layers"), "{info}");
    assert!(at("    0.0-0.1") > at("  fragments by their alpha"));
}

#[test]
fn usual_values_suit_what_is_given() {
    let place = Workplace::new();
    let capture = ["capture", "builtin:ramps", "-o", "s.arrow", "--size", "16x16"];
    place.good(&[&capture[..], &["--pattern", "standard"]].concat());
    assert!(place.good(&["info", "s.arrow"]).contains("standard-16"));
    if cfg!(target_os = "linux") {
        // No 8 samples, and no GPU.
        let output = Command::new(PROGRAM)
            .args(["throughput", "s.arrow", "--runs", "1", "--json", "-"])
            .current_dir(place.path("."))
            .env("VK_DRIVER_FILES", "/nowhere")
            .env("VK_ICD_FILENAMES", "/nowhere")
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&output.stderr).to_string();
        assert!(output.status.success() && error.contains("no GPU is measured"), "{error}");
        let document: Value = serde_json::from_slice(&output.stdout).unwrap();
        let result = &document["results"][0];
        assert_eq!((&result["samples"], &result["engine"]), (&16.into(), &"fast".into()));
    }
}

#[test]
fn reproduce_says_how_long_it_takes_and_keeps_out_of_other_folders() {
    let place = Workplace::new();
    let help = place.good(&["reproduce", "--help"]);
    // However it is wrapped.
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        help.contains("three quarters of an hour on two cores")
            && help.contains("[default: screendoor-results]"),
        "{help}"
    );
}

/// Starts the program, waits until `begun`, interrupts it and returns what it said.
#[cfg(unix)]
fn interrupted(place: &Workplace, arguments: &[&str], begun: impl Fn(u32) -> bool) -> String {
    let mut child = Command::new(PROGRAM)
        .args(arguments)
        .current_dir(place.0.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let pause = || std::thread::sleep(std::time::Duration::from_millis(20));
    let id = child.id();
    (0..3000).take_while(|_| !begun(id)).for_each(|_| pause());
    let id = id.to_string();
    // What ignores an interruption (started with &) heeds this.
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    (0..3000).take_while(|_| child.try_wait().unwrap().is_none()).for_each(|_| pause());
    let _ = child.kill();
    let output = child.wait_with_output().unwrap();
    String::from_utf8_lossy(&output.stderr).to_string()
}

#[test]
#[cfg(unix)]
fn an_interrupted_command_says_what_is_kept() {
    let place = Workplace::new();
    let partial = |id| place.has_begun(id);
    let capture =
        ["capture", "builtin:layers:count=100000", "-o", "big.arrow", "--size", "600x600"];
    let said = interrupted(&place, &capture, partial);
    assert!(said.contains("screendoor: interrupted: nothing was written"), "{said}");
    let quiet = [&["-q"], &capture[..]].concat();
    assert_eq!(interrupted(&place, &quiet, partial), "");

    let long = STUDY.replace("seeds = 2", "seeds = 100000").replace("['lk']", "['exact', 'lk']");
    fs::write(place.path("s.toml"), long).unwrap();
    let one = |_| place.path("out/runs/r.4.exact.json").exists();
    let said = interrupted(&place, &["study", "s.toml", "-o", "out"], one);
    let kept = "interrupted: 1 of 2 runs are kept; the same command goes on with the others";
    assert!(said.contains(kept), "{said}");
}
