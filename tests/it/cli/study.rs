//! Studies: interrupted, in parts, with what cannot be done.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use screendoor::random::Stream;
use screendoor::study::record::Record;
use screendoor::trace::{Header, Trace, TraceWriter, View};
use serde_json::Value;

use super::{PROGRAM, Workplace};

const STUDY: &str = "
name = 'small'
designs = ['enderton', 'lk', 'kbuffer:layers={n}', 'blend']
samples = [4, 8]
seeds = 3
timing = 0
metrics = ['flip', 'spectrum', 'filtered']
pictures = [8]
[[scene]]
name = 'glass'
source = 'builtin:glass'
size = [40, 33]
[[scene]]
name = 'ramps'
source = 'builtin:ramps'
size = [32, 32]
captured_samples = 32
";

/// A folder with the study `s.toml`, changed by `change`.
fn with_study(change: &[(&str, &str)]) -> Workplace {
    let place = Workplace::new();
    let mut text = STUDY.to_string();
    for (from, to) in change {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    fs::write(place.path("s.toml"), text).unwrap();
    place
}

/// Changes a record, as a program that measured something else would have written it.
fn rewrite(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut record: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    change(&mut record);
    record.as_object_mut().unwrap().remove("checksum").unwrap();
    let checksum = blake3::hash(&serde_json::to_vec(&record).unwrap()).to_hex().to_string();
    record["checksum"] = checksum.into();
    fs::write(path, record.to_string()).unwrap();
}

/// What must be the same however a study came to its end.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for kind in ["runs", "scenes", "traces", "pictures", "explain"] {
        for entry in fs::read_dir(folder.join(kind)).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{kind}/{}", entry.file_name().to_string_lossy());
            files.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    for name in ["study.toml", "results.jsonl"] {
        files.insert(name.to_string(), fs::read(folder.join(name)).unwrap());
    }
    files
}

#[test]
fn killed_fifty_times_a_study_ends_with_the_same_results() {
    let place = with_study(&[]);
    let start = Instant::now();
    place.good(&["study", "s.toml", "-o", "whole"]);
    let time = start.elapsed().as_micros() as u32;
    let whole = results(&place.path("whole"));
    assert_eq!(whole.keys().filter(|k| k.starts_with("runs/")).count(), 16);
    assert_eq!(whole.keys().filter(|k| k.starts_with("pictures/")).count(), 8);

    let mut random = Stream::new([0x6b11, 50]);
    let (mut kills, mut round, mut amidst) = (0, 0, 0);
    while kills < 50 {
        let folder = place.path(&format!("killed-{round}"));
        let mut child = Command::new(PROGRAM)
            .args(["study", "s.toml", "-o", &format!("killed-{round}")])
            .current_dir(place.0.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_micros(u64::from(random.below(time / 2))));
        child.kill().unwrap();
        if child.wait().unwrap().success() {
            // It was done before.
            assert!(results(&folder) == whole, "round {round} differs");
            round += 1;
            continue;
        }
        kills += 1;
        // What lies there under a good name is whole.
        let mut there = 0;
        for entry in fs::read_dir(folder.join("runs")).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if !name.starts_with('.') {
                there += 1;
                let key = format!("runs/{name}");
                assert!(whole[&key] == fs::read(entry.path()).unwrap(), "{key} differs");
            }
        }
        amidst += u32::from((1..16).contains(&there));
    }
    let last = format!("killed-{round}");
    place.good(&["study", "s.toml", "-o", &last]);
    assert!(results(&place.path(&last)) == whole, "the last round differs");
    assert!(amidst > 10, "of 50 kills {amidst} met a study that was half done");
}

#[test]
fn an_interrupted_study_with_times_differs_in_times_alone() {
    let place = with_study(&[("timing = 0", "timing = 1")]);
    place.good(&["study", "s.toml", "-o", "a"]);
    place.good(&["study", "s.toml", "-o", "b", "--shard", "1/3"]);
    place.good(&["study", "s.toml", "-o", "b"]);
    let records = |folder: &str| -> Vec<Record> {
        let text = fs::read_to_string(place.path(folder).join("results.jsonl")).unwrap();
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let (mut a, mut b) = (records("a"), records("b"));
    for record in a.iter_mut().chain(&mut b) {
        let fast = &record.speed["fast"];
        assert!(fast.seconds.unwrap().median > 0.0 && fast.same_bits == Some(true));
        // Short replays have a thread each.
        assert_eq!(fast.threads, Some(1));
        record.speed.clear();
    }
    assert_eq!(a, b);
}

#[test]
fn parts_make_the_whole() {
    let place = with_study(&[]);
    place.good(&["study", "s.toml", "-o", "whole"]);
    for part in 1..=3 {
        let (shard, folder) = (format!("{part}/3"), format!("p{part}"));
        place.good(&["study", "s.toml", "-o", &folder, "--shard", &shard]);
    }
    let said = place.good(&["merge", "merged", "p1", "p3"]);
    assert!(said.contains("11 of 16 runs"), "{said}");
    place.good(&["merge", "merged", "p1", "p2", "p3"]);
    assert!(results(&place.path("merged")) == results(&place.path("whole")));
    // Once more changes nothing.
    place.good(&["merge", "merged", "p2", "merged"]);
    assert!(results(&place.path("merged")) == results(&place.path("whole")));
    // The report can be written again from the folder alone.
    fs::remove_file(place.path("merged/report.html")).unwrap();
    place.good(&["report", "merged"]);
    assert!(fs::read_to_string(place.path("merged/report.html")).unwrap().contains("kbuffer"));
}

#[test]
fn parts_of_different_studies_or_traces_are_refused() {
    let place = with_study(&[]);
    place.good(&["study", "s.toml", "-o", "a", "--shard", "1/2"]);
    let other = STUDY.replace("seeds = 3", "seeds = 2");
    fs::write(place.path("t.toml"), other).unwrap();
    place.good(&["study", "t.toml", "-o", "b", "--shard", "2/2"]);
    let (code, error) = place.bad(&["merge", "m", "a", "b"]);
    assert!(code == 2 && error.contains("parts of different studies"), "{error}");

    place.good(&["study", "s.toml", "-o", "c", "--shard", "1/2"]);
    let scene = place.path("c/scenes/glass.json");
    rewrite(&scene, |facts| facts["content"] = "0".repeat(64).into());
    let (code, error) = place.bad(&["merge", "m2", "a", "c"]);
    assert!(code == 1 && error.contains("different traces of scene 'glass'"), "{error}");

    // The same fragments, seen from elsewhere.
    place.good(&["study", "s.toml", "-o", "e", "--shard", "1/2"]);
    let scene = place.path("e/scenes/glass.json");
    rewrite(&scene, |facts| facts["view"]["far"] = 1e3.into());
    let (code, error) = place.bad(&["merge", "m4", "a", "e"]);
    assert!(code == 1 && error.contains("different traces of scene 'glass'"), "{error}");

    // Errors that differ: two versions of the program, say.
    place.good(&["study", "s.toml", "-o", "d", "--shard", "1/2"]);
    let run = place.path("d/runs/glass.4.lk.json");
    rewrite(&run, |record| record["covered"]["rmse"]["value"] = 1.0.into());
    let (code, error) = place.bad(&["merge", "m3", "a", "d"]);
    assert!(code == 1 && error.contains("different errors for one run"), "{error}");
    // What is refused leaves no folder.
    for folder in ["m", "m2", "m3", "m4"] {
        assert!(!place.path(folder).exists(), "{folder}");
    }
}

#[test]
fn a_trace_s_view_is_asked_for_and_stays_the_same() {
    let place = Workplace::new();
    let study = "
name = 'viewed'
designs = ['blend', 'wboit:lens=camera']
samples = [4]
seeds = 1
timing = 0
metrics = []
[[scene]]
name = 'ramps'
trace = 't.arrow'
";
    fs::write(place.path("s.toml"), study).unwrap();
    place.good(&["capture", "builtin:ramps", "-o", "good.arrow", "--size", "32x32"]);
    let good = Trace::open(place.path("good.arrow")).unwrap();
    let view = good.header().view.unwrap();
    let with = |view: Option<View>| {
        let header = Header { view, ..good.header().clone() };
        let mut writer =
            TraceWriter::create(place.path("t.arrow"), header, Default::default()).unwrap();
        let fragments = good.batches().flat_map(|b| b.unwrap().iter().collect::<Vec<_>>());
        fragments.for_each(|f| writer.push(&f).unwrap());
        let (file, written) = writer.finish().unwrap();
        file.commit().unwrap();
        assert_eq!(Some(&written.content[..]), good.content());
    };
    with(None);
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    let words = "scene 'ramps': t.arrow does not say its view, for 'wboit:lens=camera'; capture";
    assert!(code == 2 && error.contains(words), "{error}");
    assert!(!place.path("out").exists());

    with(Some(view));
    place.good(&["study", "s.toml", "-o", "out", "--shard", "1/2"]);
    // As if the eye had stood elsewhere before the same fragments.
    let mut aside = view;
    aside.world_to_view[12] += 1.0;
    with(Some(aside));
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 1 && error.contains("scene 'ramps' was another one"), "{error}");
    with(Some(view));
    place.good(&["study", "s.toml", "-o", "out"]);
}

#[test]
fn a_folder_is_one_study_and_nothing_else_is_overwritten() {
    let place = with_study(&[]);
    place.good(&["study", "s.toml", "-o", "out", "--shard", "1/16"]);
    fs::write(place.path("t.toml"), STUDY.replace("'blend'", "'wboit'")).unwrap();
    let (code, error) = place.bad(&["study", "t.toml", "-o", "out"]);
    assert!(code == 2 && error.contains("holds another study"), "{error}");

    fs::create_dir(place.path("mine")).unwrap();
    fs::write(place.path("mine/report.html"), "mine").unwrap();
    let (code, error) = place.bad(&["study", "s.toml", "-o", "mine"]);
    assert!(code == 2 && error.contains("is not empty and holds no study"), "{error}");
    assert_eq!(fs::read_to_string(place.path("mine/report.html")).unwrap(), "mine");

    let lock = fs::File::options().write(true).open(place.path("out/.lock")).unwrap();
    lock.lock().unwrap();
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 2 && error.contains("at work in out"), "{error}");
    lock.unlock().unwrap();

    // A damaged result is told, not taken and not overwritten.
    fs::write(place.path("out/runs/glass.4.enderton.json"), "{").unwrap();
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 1 && error.contains("remove it to have it measured again"), "{error}");
    let (code, error) = place.bad(&["report", "nowhere"]);
    assert!(code == 1 && error.contains("no study has been measured there"), "{error}");
}

#[test]
fn what_was_changed_after_it_was_measured_is_refused() {
    let place = with_study(&[]);
    place.good(&["study", "s.toml", "-o", "out"]);
    let refused = |what: &str| {
        for arguments in [&["report", "out"][..], &["study", "s.toml", "-o", "out"]] {
            let (code, error) = place.bad(arguments);
            assert!(code == 1 && error.contains(what), "{arguments:?}: {error}");
        }
    };
    // A digit of a record, and of a scene's facts.
    for (name, at) in [("runs/glass.4.lk.json", "\"rmse\""), ("scenes/glass.json", "\"fragments\"")]
    {
        let path = place.path("out").join(name);
        let good = fs::read_to_string(&path).unwrap();
        let after = good.find(at).unwrap() + at.len();
        let digit = after + good[after..].find(|c: char| c.is_ascii_digit()).unwrap();
        let other = if &good[digit..=digit] == "7" { "8" } else { "7" };
        fs::write(&path, format!("{}{other}{}", &good[..digit], &good[digit + 1..])).unwrap();
        refused("its checksum differs");
        // Spaces are no values.
        let value: Value = serde_json::from_str(&good).unwrap();
        fs::write(&path, value.to_string()).unwrap();
        place.good(&["report", "out"]);
        fs::write(&path, good).unwrap();
    }
    // A record of another trace, and another trace in place of the one that was measured.
    let path = place.path("out/runs/glass.4.lk.json");
    let good = fs::read(&path).unwrap();
    rewrite(&path, |record| record["trace"] = "0".repeat(64).into());
    let (code, error) = place.bad(&["report", "out"]);
    assert!(code == 1 && error.contains("measured on another trace"), "{error}");
    fs::write(&path, good).unwrap();
    let trace = place.path("out/traces/glass.arrow");
    let good = fs::read(&trace).unwrap();
    place.good(&["capture", "builtin:ramps", "-o", "out/traces/glass.arrow", "--size", "40x33"]);
    let (code, error) = place.bad(&["report", "out"]);
    assert!(code == 1 && error.contains("not the trace that scene 'glass' was"), "{error}");
    fs::write(&trace, good).unwrap();
    place.good(&["report", "out"]);
}

#[test]
fn names_that_differ_in_case_alone_are_refused() {
    let place = with_study(&[("name = 'ramps'", "name = 'Glass'")]);
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 2 && error.contains("'glass' and 'Glass' differ in case alone"), "{error}");
    assert!(!place.path("out").exists());
}

#[test]
fn who_loses_a_race_for_a_folder_is_told_of_it() {
    let place = with_study(&[]);
    // As it is when another program has the lock and has not written the study yet.
    fs::create_dir_all(place.path("out/runs")).unwrap();
    let lock = fs::File::create(place.path("out/.lock")).unwrap();
    lock.lock().unwrap();
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 2 && error.contains("another screendoor is at work in out"), "{error}");
    lock.unlock().unwrap();
    drop(lock);
    // Many at once: one measures, the others are told, and nobody is told anything else.
    let start = || {
        Command::new(PROGRAM)
            .args(["study", "s.toml", "-o", "race", "--shard", "1/16"])
            .current_dir(place.0.path())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let all: Vec<_> = (0..6).map(|_| start()).collect();
    let mut good = 0;
    for child in all {
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).to_string();
        good += u32::from(output.status.success());
        let told = error.contains("another screendoor is at work in race");
        assert!(output.status.success() || told, "{error}");
    }
    assert!(good > 0);
}

#[test]
fn what_cannot_be_done_is_missing_and_the_rest_goes_on() {
    let scene = "[[scene]]\nname = 'ramps'";
    let trace = "[[scene]]\nname = 'few'\ntrace = 'few.arrow'\n[[scene]]\nname = 'ramps'";
    // It is there, and that it is damaged is known only when it is loaded.
    let damaged = "[[scene]]\nname = 'damaged'\nsource = 'damaged.glb'\n";
    let place = with_study(&[(scene, &format!("{damaged}{trace}"))]);
    fs::write(place.path("damaged.glb"), "glTF and nothing more").unwrap();
    place.good(&["capture", "builtin:glass", "-o", "few.arrow", "--size", "16x16"]);
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 1 && error.contains("damaged.4.enderton and 7 more runs could"), "{error}");
    // Where it takes long there are signs of life beside it.
    assert_eq!(error.lines().filter(|l| l.contains("error: ")).count(), 1, "{error}");
    let text = fs::read_to_string(place.path("out/results.jsonl")).unwrap();
    assert_eq!(text.lines().count(), 24);
    assert!(!text.contains("\"damaged\""));
    let page = fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("8 runs of the study without") && page.contains("damaged.glb"));

    // What is measured later must be of the same trace.
    fs::remove_file(place.path("out/runs/few.8.lk.json")).unwrap();
    place.good(&["capture", "builtin:glass", "-o", "few.arrow", "--size", "16x20"]);
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 1 && error.contains("was another one when the study was begun"), "{error}");
}

#[test]
fn what_can_be_found_out_is_before_the_first_run_and_leaves_no_folder() {
    let glass = "source = 'builtin:glass'";
    let ramps = "source = 'builtin:ramps'";
    let cases = [
        (glass, "source = 'builtin:glas'", 2, "did you mean 'glass'?"),
        (ramps, "source = 'builtin:ramps:cuont=3'", 2, "builtin:ramps"),
        (ramps, "source = 'ramps'", 2, "did you mean 'builtin:ramps'?"),
        (ramps, "source = 'no.glb'", 1, "no.glb: No such file"),
        (ramps, "source = 'model.step'", 2, "do not come as '.step'"),
        (ramps, "source = 'few.arrow'", 2, "is a trace, and a scene is asked for"),
        (ramps, "trace = 'no.arrow'", 1, "no.arrow: No such file"),
        (ramps, "trace = 's.toml'", 1, "s.toml"),
        (ramps, "trace = 'few.arrow'", 2, "8 samples"),
        (ramps, "source = 'builtin:ramps'\ntexture = 'no.png'", 1, "no.png"),
        (ramps, "source = 'builtin:ramps'\ntexture = 's.toml'", 1, "no picture"),
    ];
    for (from, to, code, says) in cases {
        let place = with_study(&[(from, to)]);
        let few =
            ["capture", "builtin:glass", "-o", "few.arrow", "--size", "9x9", "--samples", "4"];
        place.good(&few);
        let (found, error) = place.bad(&["study", "s.toml", "-o", "out"]);
        assert!(found == code && error.contains(says), "{to}: {found}: {error}");
        assert!(error.contains("scene '") && error.lines().count() == 1, "{error}");
        assert!(!place.path("out").exists(), "{to}");
    }
    let camera = "source = 'surf.obj'\ncamera = 'c.json'";
    for (more, code, says) in [
        ("camera = 'no.json'", 1, "no.json: No such file"),
        ("camera = 'bad.json'", 1, "bad.json: it is no JSON"),
        ("camera_name = 'b'", 2, "unknown camera 'b'"),
        ("source = 'a.gltf'\ncamera = 'frnt'", 2, "unknown camera 'frnt'; did you mean 'front'"),
        ("source = 'a.gltf'\ncamera = '1'", 2, "unknown camera '1'"),
        ("source = 'surf.obj'\ncamera = 'front'", 2, "the scene's file has none"),
        ("size = [40, 40]", 2, "is one of 24x16 pixels, and not of the shape of 40x40"),
        ("pixel = [24, 0]", 2, "'pixel' cannot be 24, 0"),
    ] {
        let key = more.split(' ').next().unwrap();
        let lines = match key {
            "source" => more.to_string(),
            "camera" => format!("source = 'surf.obj'\n{more}"),
            _ => format!("{camera}\n{more}"),
        };
        let place = with_camera(&lines);
        fs::write(place.path("bad.json"), "{").unwrap();
        fs::write(place.path("a.gltf"), OWN_CAMERA).unwrap();
        let (found, error) = place.bad(&["study", "s.toml", "-o", "out"]);
        assert!(found == code && error.contains(says), "{more}: {found}: {error}");
        assert!(error.contains("scene 'ramps'") && !error.contains("--"), "{error}");
        assert!(error.lines().count() == 1 && !place.path("out").exists(), "{error}");
    }
    if cfg!(target_os = "linux") {
        let place = with_study(&[("timing = 0", "timing = 0\nengines = ['fast', 'gpu']")]);
        let output = Command::new(PROGRAM)
            .args(["study", "s.toml", "-o", "out"])
            .current_dir(place.path("."))
            .env("VK_DRIVER_FILES", "/nowhere")
            .env("VK_ICD_FILENAMES", "/nowhere")
            .output()
            .unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(error.contains("engine 'gpu'") && error.contains("no adapter"), "{error}");
        assert!(!output.status.success() && !place.path("out").exists());
    }
}

/// A triangle in a file that has a camera of its own.
const OWN_CAMERA: &str = r#"{"asset": {"version": "2.0"},
"buffers": [{"byteLength": 36, "uri":
    "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
"nodes": [{"mesh": 0}, {"camera": 0, "name": "front", "translation": [0, 0, 3]}],
"scenes": [{"nodes": [0, 1]}], "scene": 0}"#;

/// A camera of 24 x 16 pixels that stands so far before a triangle.
fn camera(place: &Workplace, distance: f64) {
    let matrix = format!("[[1,0,0,0],[0,1,0,0],[0,0,1,{distance}],[0,0,0,1]]");
    let frame = format!(r#"{{"file_path": "a", "transform_matrix": {matrix}}}"#);
    let text = format!(r#"{{"fl_x": 20, "w": 24, "h": 16, "k1": 0.1, "frames": [{frame}]}}"#);
    fs::write(place.path("c.json"), text).unwrap();
}

/// The study with `lines` in place of what its second scene says of source and size.
fn with_camera(lines: &str) -> Workplace {
    let place = with_study(&[("source = 'builtin:ramps'\nsize = [32, 32]", lines)]);
    fs::write(place.path("surf.obj"), "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    camera(&place, 3.0);
    place
}

#[test]
fn a_camera_of_a_file_has_its_frame_and_stays_the_same() {
    let lines = "source = 'surf.obj'\ncamera = 'c.json'";
    let facts = |place: &Workplace| -> Value {
        serde_json::from_slice(&fs::read(place.path("out/scenes/ramps.json")).unwrap()).unwrap()
    };
    // What is said comes before what the camera has, whatever is said.
    for (more, size) in [("", [24, 16]), ("\nsize = [48, 32]", [48, 32])] {
        let place = with_camera(&format!("{lines}{more}"));
        place.good(&["study", "s.toml", "-o", "out"]);
        let facts = facts(&place);
        assert_eq!((&facts["size"][0], &facts["size"][1]), (&size[0].into(), &size[1].into()));
        assert_eq!(facts["camera"], "camera a");
        assert!(facts["warnings"][0].as_str().unwrap().contains("distortion"), "{facts}");
    }

    let place = with_camera(lines);
    place.good(&["study", "s.toml", "-o", "out"]);
    let (before, told) = (results(&place.path("out")), facts(&place)["warnings"].clone());
    let run = place.path("out/runs/ramps.8.lk.json");
    // With another camera since, what is measured is what was drawn.
    camera(&place, 4.0);
    fs::remove_file(&run).unwrap();
    place.good(&["study", "s.toml", "-o", "out"]);
    assert!(results(&place.path("out")) == before);
    // Nor is anything measured of another view.
    fs::remove_file(&run).unwrap();
    fs::remove_file(place.path("out/traces/ramps.arrow")).unwrap();
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 1 && error.contains("was another one when the study was begun"), "{error}");
    assert!(!run.exists());
    // As where the process ended between the trace and its facts.
    fs::remove_dir_all(place.path("out/runs")).unwrap();
    fs::remove_file(place.path("out/scenes/ramps.json")).unwrap();
    place.good(&["study", "s.toml", "-o", "out"]);
    assert_eq!(facts(&place)["warnings"], told);
}

#[test]
fn a_folder_in_which_nothing_was_measured_can_be_used_again() {
    let ramps = "source = 'builtin:ramps'";
    let glass = "source = 'builtin:glass'";
    let place = with_study(&[(ramps, "source = 'bad.glb'"), (glass, "source = 'bad.glb'")]);
    fs::write(place.path("bad.glb"), "glTF and nothing more").unwrap();
    place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(place.path("out/runs/glass.4.lk.failed").exists());
    fs::write(place.path("s.toml"), STUDY).unwrap();
    place.good(&["study", "s.toml", "-o", "out"]);
    place.good(&["study", "s.toml", "-o", "new"]);
    assert!(results(&place.path("out")) == results(&place.path("new")));
    // With results in it it is not.
    fs::write(place.path("s.toml"), STUDY.replace("seeds = 3", "seeds = 2")).unwrap();
    let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
    assert!(code == 2 && error.contains("holds another study"), "{error}");
    assert!(results(&place.path("out")) == results(&place.path("new")));
}

#[test]
fn one_sample_count_needs_no_list_of_pictures() {
    let place = with_study(&[("samples = [4, 8]", "samples = [4]"), ("pictures = [8]\n", "")]);
    place.good(&["study", "s.toml", "-o", "out", "--shard", "1/8"]);
    assert!(place.path("out/pictures/glass.4.enderton.exr").exists());
}

#[test]
fn a_wrong_study_file_is_one_line_of_error() {
    for (from, to, says) in [
        ("seeds = 3", "sedes = 3", "did you mean 'seeds'?"),
        ("'lk'", "'lk:srot=false'", "did you mean 'sort'?"),
        ("builtin:glass'\nsize", "builtin:glass'\nsizes", "did you mean 'size'?"),
        ("samples = [4, 8]", "samples = [4, 7]", "'samples' cannot be 7"),
        ("name = 'small'", "name = 'small", "line 2"),
    ] {
        let place = with_study(&[(from, to)]);
        let (code, error) = place.bad(&["study", "s.toml", "-o", "out"]);
        assert!(code == 2 && error.contains(says) && error.contains("s.toml"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(!place.path("out").exists());
    }
    let place = Workplace::new();
    let (code, error) = place.bad(&["study", "none.toml", "-o", "out"]);
    assert!(code == 1 && error.contains("none.toml"), "{error}");
}

#[test]
fn what_of_a_scene_is_not_drawn_is_told_by_a_study_too() {
    let place = with_study(&[("source = 'builtin:glass'", "source = 'surf.obj'")]);
    let scene = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\n";
    fs::write(place.path("surf.obj"), scene).unwrap();
    let run = || place.run(&["study", "s.toml", "-o", "out"]);
    let said = String::from_utf8(run().stderr).unwrap();
    assert!(said.contains("warning: glass: "), "{said}");
    let facts = || {
        let bytes = fs::read(place.path("out/scenes/glass.json")).unwrap();
        serde_json::from_slice::<Value>(&bytes).unwrap()["warnings"].clone()
    };
    let told = facts();
    assert!(told[0].as_str().unwrap().contains("1 lines beside surfaces are not drawn"), "{told}");
    let page = fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("Not drawn of glass"));
    // As where the process ended between the trace and its facts.
    fs::remove_file(place.path("out/scenes/glass.json")).unwrap();
    fs::remove_dir_all(place.path("out/runs")).unwrap();
    run();
    assert_eq!(facts(), told);
}

const LIT: &str = "
name = 'lit'
designs = ['lk', 'exact']
samples = [4]
seeds = 1
timing = 0
metrics = []
pictures = []
[[scene]]
name = 'engine'
source = 'builtin:engine:rows=1,detail=2'
size = [64, 64]
light = 'directional:yaw=-50,pitch=40'
[scene.shadow]
design = ['enderton', 'merging:layers={n}']
samples = [1, 4]
pcf = [1, 4]
size = [96, 80]
";

#[test]
fn a_study_of_shadows_finds_what_shade_finds() {
    let place = Workplace::new();
    fs::write(place.path("s.toml"), LIT).unwrap();
    place.good(&["study", "s.toml", "-o", "lit"]);
    let facts = |scene: &str| -> Value {
        let path = place.path("lit/scenes").join(format!("{scene}.json"));
        serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
    };
    let scenes = fs::read_dir(place.path("lit/scenes")).unwrap().count();
    let shared = fs::read_dir(place.path("lit/shadows")).unwrap().count();
    assert_eq!((scenes, shared), (8, 2), "a camera's trace and a light's for all");

    let light = ["--light", "directional:yaw=-50,pitch=40", "--light-trace", "l.arrow"];
    let capture = ["capture", "builtin:engine:rows=1,detail=2", "-o", "c.arrow", "--size", "64x64"];
    place.good(&[&capture[..], &light, &["--light-size", "96x80"]].concat());
    let shade = ["shade", "c.arrow", "l.arrow", "-o", "s.arrow", "--design", "merging:layers=4"];
    let more = ["--samples", "4", "--pcf", "4", "--json", "-"];
    let shaded: Value = serde_json::from_str(&place.good(&[&shade[..], &more].concat())).unwrap();
    let found = facts("engine-merging-layers-4-4-4");
    assert_eq!(found["content"], shaded["content"]);
    assert_eq!(found["shadow"]["error"], shaded["error"]);
    assert_eq!(found["shadow"]["cost"], shaded["cost"]);
    assert_eq!(found["shadow"]["design"], shaded["design"]);
    assert_ne!(found["content"], facts("engine-enderton-1-1")["content"]);

    let text = fs::read_to_string(place.path("lit/results.md")).unwrap();
    let section = text.split("## Visibility").nth(1).expect("a section");
    let rmse = format!("{:.4}", found["shadow"]["error"]["rmse"].as_f64().unwrap());
    let row = section.lines().find(|l| l.contains("| engine-merging-layers-4-4-4 |")).unwrap();
    assert!(row.contains(&rmse), "{row}");
    let page = fs::read_to_string(place.path("lit/report.html")).unwrap();
    assert!(page.contains("id=\"visibility-by-state\"") && page.contains(&rmse));

    // Ended between the trace and what is known of it, and again without what was shared.
    let whole = results(&place.path("lit"));
    fs::remove_file(place.path("lit/scenes/engine-enderton-1-1.json")).unwrap();
    fs::remove_dir_all(place.path("lit/shadows")).unwrap();
    for entry in fs::read_dir(place.path("lit/runs")).unwrap() {
        fs::remove_file(entry.unwrap().path()).unwrap();
    }
    place.good(&["study", "s.toml", "-o", "lit"]);
    assert!(results(&place.path("lit")) == whole);
}

#[test]
fn a_study_without_shadows_says_nothing_of_them() {
    let place = with_study(&[]);
    place.good(&["study", "s.toml", "-o", "plain"]);
    let facts = fs::read_to_string(place.path("plain/scenes/glass.json")).unwrap();
    let page = fs::read_to_string(place.path("plain/report.html")).unwrap();
    let text = fs::read_to_string(place.path("plain/results.md")).unwrap();
    assert!(!facts.contains("shadow") && !text.contains("## Visibility"));
    assert!(!page.contains("visibility-by-state"));
}

#[test]
fn filters_are_measured_as_replay_applies_them() {
    let place = with_study(&[
        ("metrics = [", "filters = ['alpha', 'gaussian:sigma=2']\nmetrics = ["),
        ("'kbuffer:layers={n}', ", ""),
    ]);
    place.good(&["study", "s.toml", "-o", "whole"]);
    let text = fs::read_to_string(place.path("whole/results.jsonl")).unwrap();
    let records: Vec<Record> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert!(records.iter().all(|r| r.post.len() == 2 && r.post[0].flip.is_some()));
    let is = |r: &&Record| (&*r.scene, &*r.series, r.samples) == ("glass", "enderton", 8);
    let record = records.iter().find(is).unwrap();
    let replay = |filter: &[&str]| -> Value {
        let run = ["replay", "whole/traces/glass.arrow", "--design", "enderton", "--samples", "8"];
        let more = ["--seeds", "3", "--json", "-"];
        serde_json::from_str(&place.good(&[&run[..], &more, filter].concat())).unwrap()
    };
    let plain = replay(&[]);
    assert_eq!(plain["filter"], Value::Null);
    for post in &record.post {
        let found = replay(&["--filter", &post.filter]);
        let rmse = found["errors"]["covered"]["rmse"]["value"].as_f64().unwrap();
        assert!((rmse / post.covered.value - 1.0).abs() < 1e-9, "{rmse} {post:?}");
        assert_eq!(found["filter"], post.filter.as_str());
        assert_ne!(found["picture"], plain["picture"]);
        assert!(post.blur > 0.0 && rmse != record.covered.rmse.value);
    }
    let report = fs::read_to_string(place.path("whole/report.html")).unwrap();
    let table = fs::read_to_string(place.path("whole/results.md")).unwrap();
    assert!(report.contains("id=\"filters-table\"") && table.contains("## Filters"));
    assert!(table.contains("| `lk` | `gaussian:sigma=2` |"), "{table}");
    let (_, error) = place.bad(&["replay", "whole/traces/glass.arrow", "--filter", "median"]);
    assert!(error.contains("unknown filter 'median'"), "{error}");
    fs::write(place.path("s.toml"), STUDY.replace("metrics", "filters = ['alpa']\nmetrics"))
        .unwrap();
    let (_, error) = place.bad(&["study", "s.toml", "-o", "none"]);
    assert!(error.contains("did you mean 'alpha'?"), "{error}");
}
