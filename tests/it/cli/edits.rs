//! `convert`, `trim`, `join`, `shuffle`, `diff`.

use screendoor::trace::{Compression, Trace};
use serde_json::Value;

use super::Workplace;

fn json(place: &Workplace, arguments: &[&str]) -> Value {
    let output = place.run(&[arguments, &["--json", "-"][..]].concat());
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_trace_is_taken_apart_and_put_together() {
    let place = Workplace::with_trace();
    place.good(&["trim", "t.arrow", "-o", "a.arrow", "--area", "0,0,24x40", "--keep-frame"]);
    place.good(&["trim", "t.arrow", "-o", "b.arrow", "--area", "24,0,24x40", "--keep-frame"]);
    place.good(&["join", "b.arrow", "a.arrow", "-o", "c.arrow", "--keep-numbers"]);
    let text = place.good(&["diff", "t.arrow", "c.arrow"]);
    assert!(text.contains("replays give the same pictures"), "{text}");
    assert!(text.contains("24x40 pixels from 24,0"), "{text}");
    let text = place.good(&["diff", "t.arrow", "t.arrow"]);
    assert!(text.contains("the same fragments in the same order"), "{text}");
    place.good(&["shuffle", "t.arrow", "-o", "s.arrow", "--seed", "3"]);
    place.good(&["shuffle", "s.arrow", "-o", "p.arrow", "--order", "primitives"]);
    assert!(place.good(&["diff", "t.arrow", "p.arrow"]).contains("in the same order"));
    for trace in ["a.arrow", "c.arrow", "s.arrow"] {
        assert!(place.good(&["verify", trace]).contains("checksums of every byte"));
    }
}

#[test]
fn a_packed_trace_stays_packed_unless_another_way_is_named() {
    let place = Workplace::with_trace();
    let stored = |trace: &str| Trace::open(place.path(trace)).unwrap().compression().unwrap();
    assert_eq!(stored("t.arrow"), Compression::None);
    for (name, way) in [("lz4", Compression::Lz4), ("zstd", Compression::Zstd)] {
        place.good(&["convert", "t.arrow", "-o", "p.arrow", "--compress", name]);
        assert_eq!(stored("p.arrow"), way);
        let verbs: [&[&str]; 4] = [
            &["trim", "p.arrow", "--samples", "2"],
            &["join", "p.arrow", "t.arrow"],
            &["shuffle", "p.arrow"],
            &["shuffle", "t.arrow", "--compress", name],
        ];
        for verb in verbs {
            place.good(&[verb, &["-o", "q.arrow"]].concat());
            assert_eq!(stored("q.arrow"), way, "{verb:?}");
        }
        for verb in [&["convert", "p.arrow"][..], &["join", "p.arrow", "--compress", "none"]] {
            place.good(&[verb, &["-o", "q.arrow"]].concat());
            assert_eq!(stored("q.arrow"), Compression::None, "{verb:?}");
        }
    }
    // Of a trace without a batch nothing is known.
    place.good(&["trim", "p.arrow", "-o", "q.arrow", "--primitives", "4000000"]);
    assert_eq!(stored("q.arrow"), Compression::None);
}

#[test]
fn a_difference_is_told_and_ends_the_program_with_1() {
    let place = Workplace::with_trace();
    place.good(&["trim", "t.arrow", "-o", "a.arrow", "--rows", "1-999999"]);
    let output = place.run(&["diff", "t.arrow", "a.arrow"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!((output.status.code(), output.stderr.is_empty()), (Some(3), true));
    assert!(text.contains("first that differs is row 0"), "{text}");
    assert!(text.contains("1 differ: 1 have not as many fragments in both"), "{text}");
    let found = json(&place, &["diff", "t.arrow", "a.arrow"]);
    assert_eq!((&found["same"], &found["fragments"]["pixels"]), (&false.into(), &1.into()));
    // Other sizes are told by their headers alone.
    place.good(&["trim", "t.arrow", "-o", "b.arrow", "--area", "8,8,16x16"]);
    let output = place.run(&["diff", "t.arrow", "b.arrow"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.code() == Some(3) && text.contains("48x40 | 16x16"), "{text}");
    assert!(json(&place, &["diff", "t.arrow", "b.arrow"])["fragments"].is_null());
}

#[test]
fn what_is_stored_otherwise_says_the_same() {
    let place = Workplace::new();
    place.good(&["capture", "builtin:glass", "-o", "t.arrow", "--size", "48x40"]);
    let content = |arguments: &[&str]| {
        let found = json(&place, &[&["convert", "t.arrow", "-o", "c.arrow"], arguments].concat());
        found["content"].as_str().unwrap().to_string()
    };
    let own = content(&[]);
    assert_eq!(own, json(&place, &["info", "t.arrow"])["content"].as_str().unwrap());
    assert_eq!(content(&["--compress", "zstd"]), own);
    assert_ne!(content(&["--float-colour"]), own);
    // Designs would store colours wider.
    let output = place.run(&["diff", "t.arrow", "c.arrow"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert!(text.contains("half precision | single precision"), "{text}");
    // A reader that wants no more changes nothing of how the program ends.
    let mut child = std::process::Command::new(super::PROGRAM)
        .args(["diff", "t.arrow", "c.arrow"])
        .current_dir(place.path("."))
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(3));
    assert!(text.contains("the same fragments under headers that differ"), "{text}");
    // Back to halves nothing is lost, and nothing is said.
    place.good(&["convert", "c.arrow", "-o", "d.arrow", "--half-colour"]);
    assert_eq!(json(&place, &["info", "d.arrow"])["content"].as_str().unwrap(), own);
    assert_ne!(content(&["--constants", "store"]), own);
    assert!(place.good(&["diff", "t.arrow", "c.arrow"]).contains("in the same order"));
}

#[test]
fn what_cannot_be_is_refused_and_nothing_is_written() {
    let place = Workplace::with_trace();
    place.good(&["capture", "builtin:ramps", "-o", "o.arrow", "--size", "40x40"]);
    let refused: &[(&[&str], &str)] = &[
        (&["trim", "t.arrow", "-o", "n.arrow", "--area", "40,0,9x9"], "it has 48x40 pixels"),
        (&["trim", "t.arrow", "-o", "n.arrow", "--area", "4"], "write it as 100,50,320x240"),
        (&["trim", "t.arrow", "-o", "n.arrow", "--objects", "9-3"], "write it as 10-19"),
        (&["join", "t.arrow", "o.arrow", "-o", "n.arrow"], "differ in their frame"),
        (&["join", "-o", "n.arrow"], "required"),
        (&["trim", "t.arrow", "-o", "n.arrow"], "which part"),
        (&["trim", "t.arrow", "-o", "n.arrow", "--keep-frame", "--samples", "2"], "--area"),
        (&["trim", "t.arrow", "-o", "none/n.arrow", "--samples", "2"], "none"),
        (&["convert", "t.arrow", "-o", "t.arrow"], "would overwrite the input"),
        (&["convert", "t.arrow", "-o", "n.png"], "name a .arrow file"),
        (&["convert", "t.arrow", "-o", "-"], "cannot go to standard output"),
        (&["convert", "t.arrow", "-o", "n.arrow", "--half-colour", "--float-colour"], "cannot be"),
        (&["shuffle", "t.arrow", "-o", "n.arrow", "--order", "randm"], "did you mean 'random'"),
        (&["shuffle", "builtin:glass", "-o", "n.arrow"], "capture it first"),
        (&["diff", "t.arrow"], "required"),
    ];
    for (arguments, part) in refused {
        let (code, error) = place.bad(arguments);
        // A folder that is not there is the system's to refuse.
        let expected = if arguments.contains(&"none/n.arrow") { 1 } else { 2 };
        assert!(code == expected && error.contains(part), "{arguments:?}: {error}");
        assert!(!place.path("n.arrow").exists(), "{arguments:?}");
    }
    // A damaged one leaves nothing either.
    let mut bytes = std::fs::read(place.path("t.arrow")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(place.path("bad.arrow"), bytes).unwrap();
    let verbs: [&[&str]; 4] = [&["convert"], &["trim", "--samples", "2"], &["join"], &["shuffle"]];
    for verb in verbs {
        let (code, error) = place.bad(&[verb, &["bad.arrow", "-o", "n.arrow"]].concat());
        assert!(code == 1 && error.contains("bad.arrow"), "{error}");
        assert!(!place.path("n.arrow").exists());
    }
    assert_eq!(place.bad(&["diff", "t.arrow", "bad.arrow"]).0, 1);
}
