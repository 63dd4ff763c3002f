//! A hundred million fragments in bounded memory, with the same picture however
//! they are batched and whoever draws them.

use std::path::Path;

use serde_json::Value;

use crate::measured::Run;

/// 100 layers over every pixel of 1024×1024.
const FRAGMENTS: u64 = 100 << 20;
/// Resident memory that no run may exceed, in MiB.
const LIMIT: u64 = 1 << 10;

/// Runs the program in `folder`; its standard output and its largest resident memory.
fn run(folder: &Path, arguments: &[&str]) -> (String, u64) {
    let run = Run::changed(folder, arguments, |_| ());
    assert!(run.status.success(), "{arguments:?}: {}", run.error);
    assert!(run.mib > 0, "{arguments:?}: /proc told no memory");
    (run.output, run.mib)
}

#[test]
#[ignore = "writes a trace of 3.3 GB, needs /proc, takes two minutes"]
fn a_hundred_million_fragments_replay_within_a_gibibyte() {
    // Beside the build: the system's own folder may lie in memory.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let scene = "builtin:layers:count=100,alpha=0.1,coloured=true";
    let capture = ["capture", scene, "-o", "t.arrow", "--size", "1024x1024", "--samples", "8"];
    let (_, capturing) = run(folder.path(), &capture);
    println!("capture: {} MiB resident at most", capturing);
    assert!(capturing < LIMIT, "{capturing} MiB");

    let mut pictures = Vec::new();
    for (threads, window) in [("1", "100000"), ("1", "4000000"), ("2", "100000"), ("2", "4000000")]
    {
        let options = ["--samples", "8", "--threads", threads, "--window", window, "--json", "-"];
        let (json, resident) = run(folder.path(), &[&["replay", "t.arrow"], &options[..]].concat());
        let record: Value = serde_json::from_str(&json).unwrap();
        println!(
            "replay, {threads} threads, windows of {window}: {} MiB resident at most, {:.1} s",
            resident,
            record["seconds"].as_f64().unwrap(),
        );
        assert!(resident < LIMIT, "{resident} MiB");
        assert_eq!(record["events"]["fragments"].as_u64(), Some(FRAGMENTS));
        pictures.push(record["picture"].as_str().unwrap().to_string());
    }
    assert!(pictures.iter().all(|picture| *picture == pictures[0]), "{pictures:?}");
}
