//! A hundred million fragments in bounded memory, with the same picture however
//! they are batched and whoever draws them.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_screendoor");
/// 100 layers over every pixel of 1024×1024.
const FRAGMENTS: u64 = 100 << 20;
/// Resident memory that no run may exceed, in KiB.
const LIMIT: u64 = 1 << 20;

/// The largest resident memory so far of a running process, in KiB (`proc_pid_status(5)`);
/// file pages that are mapped count too.
fn peak(child: &Child) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Runs the program in `folder`; its standard output and its largest resident memory.
fn run(folder: &Path, arguments: &[&str]) -> (String, u64) {
    let mut child = Command::new(PROGRAM)
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut highest = 0;
    while child.try_wait().unwrap().is_none() {
        highest = highest.max(peak(&child).unwrap_or(0));
        std::thread::sleep(Duration::from_millis(10));
    }
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{arguments:?}");
    assert!(highest > 0, "{arguments:?}: /proc told no memory");
    (String::from_utf8(output.stdout).unwrap(), highest)
}

#[test]
#[ignore = "writes a trace of 3.3 GB, needs /proc, takes two minutes"]
fn a_hundred_million_fragments_replay_within_a_gibibyte() {
    // Beside the build: the system's own folder may lie in memory.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let scene = "builtin:layers:count=100,alpha=0.1,coloured=true";
    let capture = ["capture", scene, "-o", "t.arrow", "--size", "1024x1024", "--samples", "8"];
    let (_, capturing) = run(folder.path(), &capture);
    println!("capture: {} MiB resident at most", capturing >> 10);
    assert!(capturing < LIMIT, "{capturing} KiB");

    let mut pictures = Vec::new();
    for (threads, window) in [("1", "100000"), ("1", "4000000"), ("2", "100000"), ("2", "4000000")]
    {
        let options = ["--samples", "8", "--threads", threads, "--window", window, "--json", "-"];
        let (json, resident) = run(folder.path(), &[&["replay", "t.arrow"], &options[..]].concat());
        let record: Value = serde_json::from_str(&json).unwrap();
        println!(
            "replay, {threads} threads, windows of {window}: {} MiB resident at most, {:.1} s",
            resident >> 10,
            record["seconds"].as_f64().unwrap(),
        );
        assert!(resident < LIMIT, "{resident} KiB");
        assert_eq!(record["events"]["fragments"].as_u64(), Some(FRAGMENTS));
        pictures.push(record["picture"].as_str().unwrap().to_string());
    }
    assert!(pictures.iter().all(|picture| *picture == pictures[0]), "{pictures:?}");
}
