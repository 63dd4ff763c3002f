//! Outputs: never an input, found out before the work, whole or not at all.

use super::*;

#[test]
fn an_output_is_never_an_input_nor_another_output() {
    let place = Workplace::with_trace();
    place.good(&["replay", "t.arrow", "-o", "a.exr"]);
    let triangle = "mtllib tri.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(place.path("tri.obj"), triangle).unwrap();
    fs::write(place.path("tri.mtl"), "newmtl m\nmap_Kd a.exr\n").unwrap();
    fs::create_dir(place.path("sub")).unwrap();
    let mut cases: Vec<&[&str]> = vec![
        &["capture", "tri.obj", "-o", "tri.obj"],
        &["capture", "tri.obj", "-o", "tri.mtl"],
        &["capture", "tri.obj", "-o", "a.exr"],
        &["capture", "builtin:ramps", "--texture", "a.exr", "-o", "sub/../a.exr"],
        &["info", "t.arrow", "--json", "t.arrow"],
        &["explain", "t.arrow", "--pixel", "1,1", "--json", "./t.arrow"],
        &["replay", "t.arrow", "--json", "t.arrow"],
        &["compare", "a.exr", "a.exr", "-o", "a.exr"],
        &["compare", "a.exr", "a.exr", "--json", "a.exr"],
        &["replay", "t.arrow", "-o", "x.exr", "--json", "x.exr"],
        &["replay", "t.arrow", "-o", "x.exr", "-o", "sub/../x.exr"],
        &["demo", "--output", "sub", "--json", "sub/trace.arrow"],
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("t.arrow", place.path("link.arrow")).unwrap();
        fs::hard_link(place.path("t.arrow"), place.path("hard.arrow")).unwrap();
        cases.push(&["replay", "t.arrow", "--json", "link.arrow"]);
        cases.push(&["replay", "link.arrow", "--json", "t.arrow"]);
        cases.push(&["info", "t.arrow", "--json", "hard.arrow"]);
    }
    let inputs = ["t.arrow", "a.exr", "tri.obj", "tri.mtl"];
    let read = |name| fs::read(place.path(name)).unwrap();
    let before = inputs.map(read);
    for arguments in cases {
        let (code, error) = place.bad(arguments);
        assert_eq!(code, 2, "{arguments:?}: {error}");
        let refused = ["overwrite", "one file", "is named as a picture"];
        assert!(refused.iter().any(|says| error.contains(says)), "{error}");
        assert_eq!(before, inputs.map(read), "{arguments:?}");
    }
    assert!(!place.path("x.exr").exists());
}

/// Spoils the fragments of a trace, so that every work on it fails.
fn spoil(place: &Workplace, name: &str) {
    let mut bytes = fs::read(place.path("t.arrow")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(place.path(name), bytes).unwrap();
}

#[test]
fn what_cannot_be_written_is_found_out_before_the_work() {
    let place = Workplace::with_trace();
    place.good(&["replay", "t.arrow", "-o", "a.exr"]);
    spoil(&place, "bad.arrow");
    fs::write(place.path("file"), "").unwrap();
    let before = files(place.0.path());
    let cases: &[&[&str]] = &[
        &["replay", "bad.arrow", "-o", "gone/x.exr"],
        &["replay", "bad.arrow", "-o", "x.exr", "-o", "gone/x.exr"],
        &["replay", "t.arrow", "-o", "x.exr", "--json", "gone/x.json"],
        &["info", "bad.arrow", "--json", "gone/x.json"],
        &["explain", "bad.arrow", "--pixel", "1,1", "--json", "gone/x.json"],
        &["compare", "a.exr", "a.exr", "-o", "x.exr", "--json", "gone/x.json"],
        &["capture", "builtin:engine", "-o", "gone/x.arrow"],
        &["scenes", "--json", "gone/x.json"],
    ];
    for arguments in cases {
        let (code, error) = place.bad(arguments);
        assert_eq!(code, 1, "{arguments:?}: {error}");
        assert!(error.contains("the folder gone does not exist"), "{error}");
        assert!(!error.contains(".partial"), "{error}");
        assert_eq!(files(place.0.path()), before, "{arguments:?}");
    }
    let (_, error) = place.bad(&["replay", "t.arrow", "-o", "file/x.exr"]);
    assert!(error.contains(": file is no folder"), "{error}");
    let (code, error) = place.bad(&["demo", "--scene", "builtin:ramps", "--json", "gone/x.json"]);
    assert!(code == 1 && !place.path("screendoor-demo/trace.arrow").exists(), "{error}");
    let (code, error) = place.bad(&["reproduce", "-o", "file"]);
    assert!(code == 1, "{error}");
    fs::create_dir(place.path("RESULTS.md")).unwrap();
    let (code, error) = place.bad(&["reproduce", "-o", "."]);
    assert!(code == 1 && error.contains("RESULTS.md: it is a folder"), "{error}");
}

#[test]
#[cfg(unix)]
fn figures_are_printed_even_where_files_cannot_be_written() {
    let place = Workplace::with_trace();
    let before = files(place.0.path());
    let limited = "trap '' XFSZ; ulimit -f 1; exec \"$PROGRAM\"";
    for command in ["replay t.arrow -o p.exr -o q.png", "info t.arrow --json i.json"] {
        let (code, error) = shell(&place, &format!("{limited} {command} | cat >&2"));
        assert_eq!(code, Some(0), "that of cat");
        assert!(error.contains("fragments") && error.contains("cannot write"), "{error}");
        assert!(!error.contains(".partial"), "{error}");
        assert_eq!(files(place.0.path()), before);
    }
}

#[test]
#[cfg(unix)]
fn a_write_protected_file_stays_and_permissions_are_kept() {
    use std::os::unix::fs::PermissionsExt;
    let place = Workplace::with_trace();
    place.good(&["replay", "t.arrow", "-o", "p.png"]);
    let mode = |m| fs::set_permissions(place.path("p.png"), fs::Permissions::from_mode(m)).unwrap();
    mode(0o444);
    let before = fs::read(place.path("p.png")).unwrap();
    let (code, error) = place.bad(&["replay", "t.arrow", "--samples", "1", "-o", "p.png"]);
    assert!(code == 1 && error.contains("it is write-protected"), "{error}");
    assert_eq!(fs::read(place.path("p.png")).unwrap(), before);
    mode(0o600);
    place.good(&["replay", "t.arrow", "--samples", "1", "-o", "p.png"]);
    assert_ne!(fs::read(place.path("p.png")).unwrap(), before);
    let now = fs::metadata(place.path("p.png")).unwrap().permissions().mode();
    assert_eq!(now & 0o777, 0o600);
}

/// Whether this process was started with the signal ignored, as `nohup` and `&` do:
/// then so are those that it starts. Where the system does not say, it might be.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Starts a capture of gigabytes, sends it `signal` once its file is there and, if
/// it is to live on, the signal to terminate; how it ended.
#[cfg(unix)]
fn interrupt(
    place: &Workplace,
    before: &str,
    signal: &str,
    lives_on: bool,
) -> std::process::ExitStatus {
    let pause = || std::thread::sleep(std::time::Duration::from_millis(50));
    let command = format!(
        "{before} exec \"$PROGRAM\" capture builtin:layers:count=100000 -o big.arrow --size 600x600"
    );
    let mut child = Command::new("sh")
        .args(["-c", &command])
        .env("PROGRAM", PROGRAM)
        .current_dir(place.0.path())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let id = child.id();
    let begun = || place.has_begun(id);
    (0..600).take_while(|_| !begun()).for_each(|_| pause());
    let there = begun();
    let id = id.to_string();
    let send = |signal: &str| Command::new("kill").args([signal, &id]).status().unwrap().success();
    let mut sent = send(signal);
    if lives_on {
        (0..4).for_each(|_| pause());
        sent &= child.try_wait().unwrap().is_none() && send("-TERM");
    }
    for _ in 0..600 {
        if child.try_wait().unwrap().is_some() {
            break;
        }
        pause();
    }
    // What has not ended by now does not heed its signals.
    let _ = child.kill();
    let status = child.wait().unwrap();
    assert!(there, "the capture never began its file");
    assert!(sent, "it had ended when it was to be told to");
    status
}

#[test]
#[cfg(unix)]
fn a_program_told_to_end_leaves_nothing_half_done() {
    use std::os::unix::process::ExitStatusExt;
    let place = Workplace::new();
    fs::write(place.path("big.arrow"), "old").unwrap();
    let cases = [("", "-TERM", 15), ("", "-INT", 2), ("", "-HUP", 1), ("trap '' HUP;", "-HUP", 1)];
    for (before, signal, number) in cases {
        // Who starts the program may have it ignore a signal.
        let lives_on = number != 15 && (!before.is_empty() || is_ignored(number));
        let status = interrupt(&place, before, signal, lives_on);
        // A shell reports this as 128 and the number: 143, 130, 129.
        let expected = if lives_on { 15 } else { number };
        assert_eq!(status.signal(), Some(expected), "{before} {signal}");
        assert_eq!(files(place.0.path()), ["big.arrow"], "{signal}");
        assert_eq!(fs::read(place.path("big.arrow")).unwrap(), b"old");
    }
}

#[test]
#[cfg(unix)]
fn pipes_are_written_directly() {
    let place = Workplace::with_trace();
    for command in [
        "\"$PROGRAM\" info t.arrow --json /dev/stdout | grep -q fragments",
        "exec 3>&1; \"$PROGRAM\" capture builtin:ramps --size 9x9 -o /dev/fd/3 3>&1 >/dev/null | grep -q ARROW1",
    ] {
        let (code, error) = shell(&place, command);
        assert_eq!((code, &*error), (Some(0), ""), "{command}");
    }
}

#[test]
#[cfg(unix)]
fn a_name_of_a_folder_names_no_file() {
    let place = Workplace::with_trace();
    let before = files(place.0.path());
    for arguments in
        [&["capture", "builtin:ramps", "-o", "new/"][..], &["info", "t.arrow", "--json", "new/"]]
    {
        let (code, error) = place.bad(arguments);
        assert_eq!(code, 1, "{error}");
        assert!(error.contains("folder"), "{error}");
    }
    assert_eq!(files(place.0.path()), before);
}

#[test]
#[cfg(unix)]
fn the_demo_is_whole_although_nobody_reads_it() {
    let place = Workplace::new();
    let demo = "\"$PROGRAM\" demo --scene builtin:ramps -o out | head -n 1";
    assert_eq!(shell(&place, demo).0, Some(0));
    assert_eq!(files(&place.path("out")).len(), 20);
}

#[test]
#[cfg(unix)]
fn a_full_disk_leaves_the_good_file_and_nothing_else() {
    let place = Workplace::with_trace();
    place.good(&["replay", "t.arrow", "-o", "p.exr", "-o", "p.png"]);
    let before: Vec<_> =
        ["t.arrow", "p.exr", "p.png"].iter().map(|f| fs::read(place.path(f)).unwrap()).collect();
    // No file may grow beyond one block of 512 bytes: writes fail as on a full disk.
    let limited = "trap '' XFSZ; ulimit -f 1; exec \"$PROGRAM\"";
    for command in [
        "capture builtin:ramps -o t.arrow --size 200x200",
        "replay t.arrow -o p.exr",
        "replay t.arrow --samples 4 -o p.png",
    ] {
        let (code, error) = shell(&place, &format!("{limited} {command}"));
        assert_eq!(code, Some(1), "{command}: {error}");
        assert!(error.contains("cannot write"), "{error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    }
    assert_eq!(files(place.0.path()), ["p.exr", "p.png", "t.arrow"]);
    for (name, bytes) in ["t.arrow", "p.exr", "p.png"].iter().zip(before) {
        assert_eq!(fs::read(place.path(name)).unwrap(), bytes);
    }
    // A device that is always full, and one that takes everything.
    if Path::new("/dev/full").exists() {
        let (code, error) = shell(&place, "exec \"$PROGRAM\" capture builtin:ramps -o /dev/full");
        assert_eq!(code, Some(1), "{error}");
        assert!(error.contains("cannot write /dev/full"), "{error}");
    }
    assert_eq!(shell(&place, "exec \"$PROGRAM\" capture builtin:ramps -o /dev/null").0, Some(0));
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
}

#[test]
#[cfg(target_os = "linux")]
fn a_program_that_is_killed_leaves_nothing_where_files_need_no_names() {
    let place = Workplace::new();
    let status = interrupt(&place, "", "-KILL", false);
    assert!(!status.success());
    // Where the file system has none, the next command removes what was left.
    let left = files(place.0.path());
    assert!(left.is_empty() || left.iter().all(|name| name.ends_with(".partial")), "{left:?}");
    if !left.is_empty() {
        eprintln!("skipped: {} has no files without names", place.0.path().display());
    }
}

#[test]
#[cfg(target_os = "linux")]
fn help_that_cannot_be_written_is_an_error() {
    let place = Workplace::new();
    for arguments in ["--help", "--version", "replay --help", "designs"] {
        let (code, error) = shell(&place, &format!("\"$PROGRAM\" {arguments} > /dev/full"));
        assert_eq!(code, Some(1), "{arguments}: {error}");
        assert!(error.contains("cannot write to standard output: No space left"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let (code, error) = shell(&place, "\"$PROGRAM\" nonsense > /dev/full");
    assert_eq!(code, Some(2), "{error}");
}

#[test]
#[cfg(target_os = "linux")]
fn all_descriptors_taken_is_said_so() {
    let place = Workplace::with_trace();
    // What the program opens before its output does not fit into fewer.
    for most in 4..12 {
        let command = format!("ulimit -n {most}; \"$PROGRAM\" replay t.arrow -o x.exr 2>&1 >&-");
        let (_, said) = shell(&place, &format!("{{ {command}; }} >&2"));
        assert!(!said.contains("uncategorized") && !said.contains("panicked"), "{most}: {said}");
    }
}

#[test]
fn seeds_that_run_out_are_refused() {
    let place = Workplace::with_trace();
    let (code, error) = place.bad(&["replay", "t.arrow", "--seed", "4294967294", "--seeds", "3"]);
    assert!(code == 2 && error.contains("there are no 3 seeds from 4294967294 on"), "{error}");
    place.good(&["replay", "t.arrow", "--seed", "4294967294", "--seeds", "2", "--samples", "1"]);
}
