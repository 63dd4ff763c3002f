//! Peak memory and time of commands on hostile sizes: within `--memory` and a constant, or
//! refused at once.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use screendoor::design::DESIGNS;
use screendoor::trace::{
    DepthPlane, Fragment, Header, SampleMask, TraceWriter, Unorm32, WriteOptions,
};

use crate::util::header;

const PROGRAM: &str = env!("CARGO_BIN_EXE_screendoor");

/// MiB that a command may take beside what `--memory` says: the program itself, windows of
/// fragments for a few threads, and the touched tiles' state.
const BESIDE: u64 = 320;

/// The largest resident memory so far of a running process, in KiB (`proc_pid_status(5)`).
/// What `wait4` tells would be no less than this test's own.
fn peak(child: &Child) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// What a run said, its largest resident memory in MiB, and how long it took.
struct Run {
    output: Output,
    mib: u64,
    seconds: f64,
}

impl Run {
    fn of(folder: &Path, arguments: &[&str]) -> Self {
        let start = Instant::now();
        let mut child = Command::new(PROGRAM)
            .args(arguments)
            .args(["--threads", "2"])
            .current_dir(folder)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut highest = 0;
        while child.try_wait().unwrap().is_none() {
            highest = highest.max(peak(&child).unwrap_or(0));
            std::thread::sleep(Duration::from_millis(2));
        }
        let output = child.wait_with_output().unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let run = Run { output, mib: highest >> 10, seconds };
        println!("{arguments:?}: {} MiB, {seconds:.1} s; {}", run.mib, run.error().trim());
        run
    }

    fn error(&self) -> String {
        String::from_utf8_lossy(&self.output.stderr).to_string()
    }

    /// Holds it to a limit: done within it, or refused with what it needs.
    fn is_within(&self, mib: u64, what: &str) {
        let error = self.error();
        let refused = self.output.status.code() == Some(2) && error.contains("MiB");
        assert!(self.output.status.success() || refused, "{what}: {error}");
        assert!(self.mib <= mib + BESIDE, "{what}: {} MiB; {error}", self.mib);
    }
}

/// Writes a trace of `count` fragments, the place of each as `pixel` has it, each of a
/// primitive of its own and so faint that nothing can be left out.
fn write(path: &Path, header: &Header, count: u32, pixel: impl Fn(u32) -> (u16, u16)) {
    let file = fs::File::create(path).unwrap();
    let file = std::io::BufWriter::new(file);
    let options = WriteOptions::default();
    let mut writer = TraceWriter::new(file, "test", header.clone(), options).unwrap();
    for i in 0..count {
        let (x, y) = pixel(i);
        let fragment = Fragment {
            x,
            y,
            coverage: SampleMask::first(header.pattern.samples()),
            depth: DepthPlane { z: Unorm32(i.wrapping_mul(0x9e37_79b9)), dzdx: 0, dzdy: 0 },
            colour: [0.5, 0.25, 0.125],
            alpha: 0.01,
            primitive: i,
            object: 0,
            ..Fragment::default()
        };
        writer.push(&fragment).unwrap();
    }
    writer.finish().unwrap();
}

fn has_proc() -> bool {
    let has = Path::new("/proc/self/status").exists();
    if !has {
        eprintln!("skipped: memory is measured by way of /proc");
    }
    has
}

/// Every design and every command that reads traces, on one pixel of `deep` fragments and on
/// a frame of `many`, with `memory` MiB allowed.
fn hold_all(deep: u32, many: u32, memory: u64) {
    if !has_proc() {
        return;
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let folder = folder.path();
    let header = header(256, 256, 4);
    write(&folder.join("deep.arrow"), &header, deep, |_| (100, 100));
    write(&folder.join("many.arrow"), &header, many, |i| {
        ((i % 256) as u16, (i / 256 % 256) as u16)
    });
    let allowed = memory.to_string();
    for trace in ["deep.arrow", "many.arrow"] {
        for design in DESIGNS {
            let name = design.info.name;
            let run = Run::of(folder, &["replay", trace, "-d", name, "--memory", &allowed]);
            run.is_within(memory, &format!("{name} on {trace}"));
        }
        for command in [&["info", trace][..], &["verify", trace]] {
            let run = Run::of(folder, command);
            assert!(run.output.status.success(), "{}", run.error());
            // `info` holds the fragments of a tile to find those of one depth.
            let tile = (u64::from(deep) * 64) >> 20;
            run.is_within(tile, &format!("{command:?}"));
        }
        for design in ["lk", "exact", "sorted-blend", "hybrid"] {
            for last in [None, Some("5")] {
                let pixel = ["explain", trace, "--pixel", "100,100", "-d", design];
                let last = last.map_or(vec![], |last| vec!["--last", last]);
                let arguments = [&pixel[..], &["--memory", &allowed], &last].concat();
                Run::of(folder, &arguments).is_within(memory, &format!("{arguments:?}"));
            }
        }
    }
}

#[test]
fn memory_is_what_was_allowed_and_a_constant() {
    hold_all(20_000, 200_000, 4);
}

#[test]
#[ignore = "writes traces of 2 GB, takes many minutes"]
fn so_it_is_with_tens_of_millions_of_fragments() {
    hold_all(30_000_000, 30_000_000, 64);
}

#[test]
fn a_story_that_is_too_long_is_refused_with_what_it_needs() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("t.arrow"), &header(8, 8, 8), 30_000, |_| (3, 3));
    let explain = ["explain", "t.arrow", "--pixel", "3,3", "--memory", "16"];
    let run = Run::of(folder.path(), &explain);
    let error = run.error();
    assert_eq!(run.output.status.code(), Some(2), "{error}");
    assert!(error.contains("holds 30000 fragments, whose story takes"), "{error}");
    // What is proposed fits.
    let (_, after) = error.split_once("show the last ").unwrap();
    let last = after.split_whitespace().next().unwrap();
    let run = Run::of(folder.path(), &[&explain[..], &["--last", last]].concat());
    assert!(run.output.status.success(), "{}", run.error());
}

#[test]
fn one_depth_for_each_primitive_is_refused_where_there_are_too_many() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("t.arrow"), &header(64, 64, 4), 100_000, |i| ((i % 64) as u16, 5));
    let sorted = ["replay", "t.arrow", "-d", "sorted-blend", "--memory"];
    let run = Run::of(folder.path(), &[&sorted[..], &["8"]].concat());
    let error = run.error();
    assert_eq!(run.output.status.code(), Some(2), "{error}");
    let (_, after) = error.split_once("takes up to ").unwrap();
    let needed = after.split_whitespace().next().unwrap();
    let run = Run::of(folder.path(), &[&sorted[..], &[needed]].concat());
    assert!(run.output.status.success(), "{}", run.error());
}

#[test]
fn a_vast_frame_costs_what_is_drawn_in_it() {
    if !has_proc() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let header = header(65536, 65536, 1);
    write(&folder.path().join("t.arrow"), &header, 100, |i| (65535 - i as u16, 65535));
    let commands = [
        &["info", "t.arrow"][..],
        &["verify", "t.arrow"],
        &["replay", "t.arrow"],
        &["replay", "t.arrow", "-d", "exact"],
        &["replay", "t.arrow", "--exact"],
        &["explain", "t.arrow", "--pixel", "65535,65535"],
    ];
    for command in commands {
        let run = Run::of(folder.path(), command);
        assert!(run.output.status.success(), "{command:?}: {}", run.error());
        // The frame has 16 million tiles, of which seven are touched.
        assert!(run.mib < 1024, "{command:?}: {} MiB", run.mib);
        assert!(run.seconds < 30.0, "{command:?}: {} s", run.seconds);
    }
}

#[test]
fn a_large_picture_costs_what_it_shows() {
    if !has_proc() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("t.arrow"), &header(3072, 3072, 1), 100, |i| (3071 - i as u16, 3071));
    // All values at once would be 108 MiB, the pixels of both pictures 432.
    for command in [&["replay", "t.arrow", "-o", "a.exr"][..], &["compare", "a.exr", "a.exr"]] {
        let run = Run::of(folder.path(), command);
        assert!(run.output.status.success(), "{command:?}: {}", run.error());
        assert!(run.mib < 100, "{command:?}: {} MiB", run.mib);
    }
}

/// Writes over a trace again and again while it is replayed: each run gives the right picture
/// or one line of error.
#[test]
#[cfg(unix)]
fn a_trace_that_is_written_over_while_it_is_read_is_an_error() {
    use std::os::unix::fs::FileExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.arrow");
    let header = header(64, 64, 4);
    write(&path, &header, 400_000, |i| ((i % 64) as u16, (i / 64 % 64) as u16));
    let good = fs::read(&path).unwrap();
    let picture = |text: &[u8]| -> String {
        let json: serde_json::Value = serde_json::from_slice(text).unwrap();
        json["picture"].as_str().unwrap().to_string()
    };
    let start = || {
        Command::new(PROGRAM)
            .args(["replay", "t.arrow", "-d", "exact", "--memory", "1", "--json", "-"])
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let right = picture(&start().wait_with_output().unwrap().stdout);
    let mut refused = 0;
    for round in 0..12_u64 {
        fs::write(&path, &good).unwrap();
        let child = start();
        std::thread::sleep(Duration::from_millis(30 * (round + 1)));
        let file = fs::File::options().write(true).open(&path).unwrap();
        match round % 3 {
            0 => file.write_all_at(&vec![0xff; good.len() / 2], good.len() as u64 / 4).unwrap(),
            1 => file.set_len(good.len() as u64 / 3).unwrap(),
            _ => file.set_len(0).unwrap(),
        }
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).to_string();
        match output.status.code() {
            Some(0) => assert_eq!(picture(&output.stdout), right, "round {round}"),
            Some(1) => {
                refused += 1;
                assert_eq!(error.lines().count(), 1, "round {round}: {error}");
                assert!(error.starts_with("screendoor: error: "), "round {round}: {error}");
            }
            code => panic!("round {round}: {code:?}: {error}"),
        }
    }
    assert!(refused > 0, "no run was met while it read");
}
