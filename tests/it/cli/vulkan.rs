//! `capture --vulkan` around a program that leaves what the layer would.

use super::*;

use screendoor_vulkan_layer::log::{End, Entry, Event, Picture, Present};
use screendoor_vulkan_layer::vk;

use crate::left::{Left, over, pass, record};

/// Leaves what was prepared, as the layer would.
const LEAVE: &str = "cp prepared/* \"$SCREENDOOR_VULKAN_FOLDER\"";

/// A folder with what the layer is to leave: a draw of two fragments over a clear of 2 x 2 pixels,
/// and another that cannot be in a trace. `presented` says whether the frame ends.
fn prepared(presented: bool) -> Workplace {
    let place = Workplace::new();
    fs::create_dir(place.path("prepared")).unwrap();
    let mut adding = over(1);
    adding.state.destination = vk::BlendFactor::ONE.as_raw();
    let events = vec![Event::Pass(pass(2)), Event::Draw(over(0)), Event::Draw(adding)];
    let pixels = [[153, 51, 77, 0], [102, 77, 115, 0], [51, 102, 153, 255], [51, 102, 153, 255]];
    let mut left = Left::new("some\u{1b}program", 2);
    left.submit(events, 3);
    left.entries.push(Entry::Picture(Picture {
        image: 1,
        after: true,
        bytes: 16,
        ..Picture::default()
    }));
    if presented {
        left.entries.push(Entry::Present(Present { frame: 0, images: vec![1] }));
        left.entries.push(Entry::End(End { frame: 0 }));
    }
    let records = [record(0, 0, 0.5), record(0, 1, 0.25), record(1, 0, 0.5)];
    left.write(&place.path("prepared"), records, &pixels.concat());
    place
}

/// `capture --vulkan` with more arguments, of a script.
fn capture<'a>(more: &[&'a str], script: &'a str) -> Vec<&'a str> {
    [&["capture", "--vulkan"], more, &["--", "sh", "-c", script]].concat()
}

fn names(place: &Workplace) -> Vec<String> {
    let name = |e: std::io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(place.path(".")).unwrap().map(name).collect();
    names.sort();
    names
}

#[test]
fn what_a_program_draws_becomes_a_trace() {
    let place = prepared(true);
    let output = place.run(&capture(&["-o", "t.arrow", "--check"], LEAVE));
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(output.status.success(), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    let said = "1 draw (1 fragment) not in the trace: it blends by SRC_ALPHA, ONE: it adds light";
    assert!(error.contains(said), "{error}");
    let text = String::from_utf8_lossy(&output.stdout).to_string();
    assert!(text.contains("frame 0, target #1: 1 draws into 2 x 2 pixels"), "{text}");
    assert!(text.contains("t.arrow: 2 fragments"), "{text}");
    // The picture was made without the draw that adds.
    assert!(text.contains("of 4 pixels 3 are exact, 1 by more than 0.6"), "{text}");
    // Nothing else is left.
    assert_eq!(names(&place), ["prepared", "t.arrow"]);
    assert!(place.good(&["verify", "t.arrow"]).contains("2 fragments"));
    let info = place.good(&["info", "t.arrow"]);
    assert!(info.contains("some\\u{1b}program on a GPU, frame 0"), "{info}");

    let json = place.good(&capture(&["-o", "t.arrow", "--json", "-"], LEAVE));
    let document: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(document["schema"]["name"], "screendoor.vulkan");
    assert_eq!(document["fragments"], 2);
    assert_eq!(document["objects"][0]["label"], "glass");
    assert_eq!(document["refused"][0]["fragments"], 1);
    assert_eq!(document["dropped"]["transparent"], 0);
    assert!(document["check"].is_null() && document["depth"] == "order");
    let strict = place.run(&capture(&["-o", "u.arrow", "--strict"], LEAVE));
    assert_eq!(strict.status.code(), Some(1));
    assert_eq!(names(&place), ["prepared", "t.arrow"]);
}

#[test]
fn what_there_is_is_listed() {
    let place = prepared(true);
    let text = place.good(&capture(&["--list"], LEAVE));
    assert!(!text.contains('\u{1b}') && text.contains("some\\u{1b}program, process 7"), "{text}");
    assert!(text.contains("1 frames presented") || text.contains("1 frame presented"), "{text}");
    let row = text.lines().find(|l| l.starts_with("#1 ")).unwrap();
    let cells: Vec<&str> = row.split_whitespace().collect();
    let expected = ["#1", "0", "0", "2x2", "R8G8B8A8_UNORM", "1", "yes", "clear", "2", "2", "3"];
    assert_eq!(cells, expected, "{text}");
    assert!(text.contains("1 draws (1 fragments) cannot be in a trace: it blends by"), "{text}");
    let json = place.good(&capture(&["--list", "--json", "-"], LEAVE));
    let document: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(document["schema"]["name"], "screendoor.vulkan-list");
    let pass = &document["devices"][0]["passes"][0];
    assert_eq!((&pass["fragments"], &pass["target"]["number"]), (&3.into(), &1.into()));
    assert_eq!(names(&place), ["prepared"]);
}

#[test]
fn what_is_kept_can_be_taken_again() {
    let place = prepared(true);
    let content = |text: &str| text.split("content ").nth(1).unwrap()[..16].to_string();
    let first = place.good(&capture(&["-o", "a.arrow", "--keep", "kept"], LEAVE));
    let kept: Vec<String> = fs::read_dir(place.path("kept"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(kept.len(), 3, "{kept:?}");
    let again = place.good(&["capture", "--vulkan", "--from", "kept", "-o", "b.arrow"]);
    assert_eq!(content(&first), content(&again));
    let (code, error) = place.bad(&capture(&["-o", "c.arrow", "--keep", "kept"], LEAVE));
    assert!(code == 2 && error.contains("kept is not empty"), "{error}");
    let from = |folder| place.bad(&["capture", "--vulkan", "--from", folder, "-o", "c.arrow"]);
    for (folder, code, says) in
        [("a.arrow", 2, "is no folder"), (".", 2, "holds no capture"), ("none", 1, "cannot read")]
    {
        let (found, error) = from(folder);
        assert!(found == code && error.contains(says), "{error}");
    }
    let (code, error) = place.bad(&capture(&["-o", "c.arrow", "--keep", "x.arrow"], LEAVE));
    assert!(code == 2 && error.contains("name a folder"), "{error}");
    assert_eq!(names(&place), ["a.arrow", "b.arrow", "kept", "prepared"]);
}

#[test]
fn what_goes_wrong_is_told_with_what_to_do() {
    let place = prepared(true);
    let vulkan = |more: &[&'static str], script| place.bad(&capture(more, script));
    let out = &["-o", "t.arrow"];
    let (code, error) = vulkan(out, "exit 3");
    assert!(code == 1 && error.contains("sh: it has opened no Vulkan device"), "{error}");
    assert!(error.contains("sh ended with exit code 3"), "{error}");
    let (_, error) = vulkan(out, "true");
    assert!(error.contains("give --opengl"), "{error}");
    let (code, error) = place.bad(&["capture", "--vulkan", "-o", "t.arrow", "--", "./none"]);
    assert!(code == 1 && error.contains("cannot run ./none: "), "{error}");
    let (code, error) = place.bad(&["capture", "--vulkan", "-o", "t.arrow"]);
    assert!(code == 2 && error.contains("no program is given to run"), "{error}");
    let (code, error) = vulkan(&["-o", "t.arrow", "--target", "5x5"], LEAVE);
    assert!(code == 2 && error.contains("#1 (2x2 R8G8B8A8_UNORM, 3 fragments)"), "{error}");
    assert!(error.contains("--keep FOLDER keeps it"), "{error}");
    let (code, error) = vulkan(&["-o", "t.arrow", "--frame", "4"], LEAVE);
    assert!(code == 2 && error.contains("frame 4 was not captured"), "{error}");
    let (code, error) = vulkan(&["-o", "t.exr"], LEAVE);
    assert!(code == 2 && error.contains("name a .arrow file"), "{error}");
    let (code, error) = vulkan(&["-o", "-"], LEAVE);
    assert!(code == 2 && error.contains("standard output"), "{error}");
    // The whole frame stands although the program fails after it.
    let failing = format!("{LEAVE}; kill -SEGV $$");
    let output = place.run(&capture(&["-o", "t.arrow"], &failing));
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(output.status.success() && error.contains("sh was ended by signal 11"), "{error}");
    // One that is never presented does not.
    let place = prepared(false);
    let (code, error) = place.bad(&capture(&["-o", "t.arrow"], &failing));
    assert!(code == 1 && error.contains("it ended within frame 0"), "{error}");
    place.good(&capture(&["-o", "t.arrow"], LEAVE));
    assert_eq!(names(&place), ["prepared", "t.arrow"]);
}

#[test]
fn options_for_scenes_and_for_programs_do_not_go_together() {
    let place = Workplace::new();
    let cases: &[(&[&str], &[&str])] = &[
        (&["builtin:ramps", "--vulkan", "-o", "t.arrow"], &["[SCENE]", "--vulkan"]),
        (&["builtin:ramps", "--list"], &["[SCENE]", "--list"]),
        (&["builtin:ramps", "-o", "t.arrow", "--", "true"], &["[SCENE]", "[PROGRAM]"]),
        (&["--vulkan", "--size", "4x4", "-o", "t.arrow", "--", "true"], &["--size", "--vulkan"]),
        (&["--vulkan", "--gpu", "-o", "t.arrow", "--", "true"], &["--gpu", "--vulkan"]),
        (&["--vulkan", "--from", "k", "-o", "t.arrow", "--", "true"], &["--from", "[PROGRAM]"]),
        (&["--vulkan", "--from", "k", "--keep", "l", "-o", "t.arrow"], &["--from", "--keep"]),
        (&["--vulkan", "--frame", "1", "--submits", "2", "--list"], &["--frame", "--submits"]),
        (&["--vulkan", "--list", "--check"], &["--list", "--check"]),
        (&["builtin:ramps", "-o", "t.arrow", "--check"], &["--gpu", "--vulkan"]),
        (&["--list", "--", "true"], &["--vulkan"]),
        (&["--vulkan", "--", "true"], &["--output"]),
        (&["--vulkan", "--target", "big", "--list"], &["big", "800x600"]),
        (&["-o", "t.arrow"], &["SCENE"]),
    ];
    for (arguments, names) in cases {
        let (code, error) = place.bad(&[&["capture"], *arguments].concat());
        assert!(code == 2, "{arguments:?}: {error}");
        // One conflict, by both names, and no list of all that there is.
        let said = error.split("Usage").next().unwrap();
        assert!(names.iter().all(|name| said.contains(name)), "{arguments:?}: {error}");
        assert!(said.lines().count() <= 5, "{error}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_program_is_ended_when_all_is_captured() {
    let place = prepared(true);
    let start = std::time::Instant::now();
    let script = format!("{LEAVE}; echo $$ > pid; exec sleep 100");
    let output = place.run(&capture(&["-o", "t.arrow", "--stop"], &script));
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(output.status.success() && !error.contains("signal"), "{error}");
    assert!(start.elapsed().as_secs() < 50);
    assert!(!lives(&place));
}

/// Whether the process whose number is in the file `pid` lives.
#[cfg(target_os = "linux")]
fn lives(place: &Workplace) -> bool {
    let id = fs::read_to_string(place.path("pid")).unwrap();
    // One that has ended and was not waited for yet has no command line.
    fs::read(format!("/proc/{}/cmdline", id.trim())).is_ok_and(|line| !line.is_empty())
}

/// Starts a capture, waits until the program has begun, and hands the child to `act`.
#[cfg(target_os = "linux")]
fn during(place: &Workplace, script: &str, act: impl FnOnce(u32)) -> Output {
    let child = Command::new(PROGRAM)
        .args(capture(&["-o", "t.arrow"], script))
        .current_dir(place.0.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = || fs::read(place.path("pid")).is_ok_and(|id| id.ends_with(b"\n"));
    let pause = || std::thread::sleep(std::time::Duration::from_millis(20));
    (0..3000).take_while(|_| !begun()).for_each(|_| pause());
    act(child.id());
    child.wait_with_output().unwrap()
}

#[cfg(target_os = "linux")]
fn send(signal: &str, process: u32) {
    assert!(Command::new("kill").args([signal, &process.to_string()]).status().unwrap().success());
}

#[test]
#[cfg(target_os = "linux")]
fn whoever_ends_the_capture_ends_the_program() {
    let place = prepared(true);
    let output = during(&place, "echo $$ > pid; exec sleep 100", |id| send("-TERM", id));
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(!output.status.success() && error.contains("interrupted"), "{error}");
    let pause = || std::thread::sleep(std::time::Duration::from_millis(20));
    (0..500).take_while(|_| lives(&place)).for_each(|_| pause());
    assert!(!lives(&place));
    assert_eq!(names(&place), ["pid", "prepared"]);
}

#[test]
#[cfg(target_os = "linux")]
fn an_interruption_is_the_program_s() {
    let place = prepared(true);
    // As a terminal sends it to both; the program heeds it and draws.
    // Of what was ignored when it began, a shell hears nothing: so it may be where tests run behind
    // others. It does not wait for ever either.
    let inner = format!(
        "trap '{LEAVE}; exit 0' INT; echo $$ > pid; \
         for i in $(seq 300); do sleep 0.1; done; exit 9"
    );
    let quoted = inner.replace('\'', r"'\''");
    let script = format!("exec env --default-signal=INT sh -c '{quoted}'");
    let output = during(&place, &script, |id| {
        send("-INT", id);
        let program = fs::read_to_string(place.path("pid")).unwrap();
        send("-INT", program.trim().parse().unwrap());
    });
    let error = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(output.status.success(), "{error}");
    assert_eq!(names(&place), ["pid", "prepared", "t.arrow"]);
}
