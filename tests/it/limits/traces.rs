//! Traces of hostile sizes.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use screendoor::capture::DIRECT;
use screendoor::design::DESIGNS;
use screendoor::trace::{
    DepthPlane, Fragment, Header, SampleMask, TraceWriter, Unorm32, WriteOptions,
};

use crate::measured::{BESIDE, PROGRAM, Run, has_proc};
use crate::util::{gpu, header};

/// A fragment's depth.
fn depth(i: u32) -> u32 {
    i.wrapping_mul(0x9e37_79b9)
}

/// Writes a trace of `count` fragments, the place of each as `pixel` has it, each of a
/// primitive of its own and so faint that nothing can be left out.
pub(super) fn write(path: &Path, header: &Header, count: u32, pixel: impl Fn(u32) -> (u16, u16)) {
    write_with(path, header, count, |i| (pixel(i), 0.01), WriteOptions::default());
}

/// As [`write`], with alphas.
pub(super) fn write_with(
    path: &Path,
    header: &Header,
    count: u32,
    fragment: impl Fn(u32) -> ((u16, u16), f32),
    options: WriteOptions,
) {
    let file = fs::File::create(path).unwrap();
    let file = std::io::BufWriter::new(file);
    let mut writer = TraceWriter::new(file, "test", header.clone(), options).unwrap();
    for i in 0..count {
        let ((x, y), alpha) = fragment(i);
        let fragment = Fragment {
            x,
            y,
            coverage: SampleMask::first(header.pattern.samples()),
            depth: DepthPlane { z: Unorm32(depth(i)), dzdx: 0, dzdy: 0 },
            colour: [0.5, 0.25, 0.125],
            alpha,
            primitive: i,
            object: 0,
            ..Fragment::default()
        };
        writer.push(&fragment).unwrap();
    }
    writer.finish().unwrap();
}

/// The places of fragments that are spread over 256 × 256 pixels.
pub(super) fn many(i: u32) -> (u16, u16) {
    ((i % 256) as u16, (i / 256 % 256) as u16)
}

/// Every design and every command that reads traces, on one pixel of `deep` fragments and on
/// a frame of `spread`, with `memory` MiB allowed.
fn hold_all(deep: u32, spread: u32, memory: u64) {
    if !has_proc() {
        return;
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let folder = folder.path();
    let header = header(256, 256, 4);
    write(&folder.join("deep.arrow"), &header, deep, |_| (100, 100));
    write(&folder.join("many.arrow"), &header, spread, many);
    let allowed = memory.to_string();
    let mut lit = header.clone();
    lit.optional = DIRECT.into_iter().collect();
    write(&folder.join("lit.arrow"), &lit, spread, many);
    for trace in ["deep.arrow", "many.arrow"] {
        for design in ["lk", "mlab", "exact"] {
            let shade = ["shade", "lit.arrow", trace, "-o", "shaded.arrow", "--design", design];
            let run = Run::of(folder, &[&shade[..], &["--memory", &allowed]].concat());
            run.is_within(memory, &format!("shade by {design} from {trace}"));
        }
        for design in DESIGNS {
            let name = design.info.name;
            let run = Run::of(folder, &["replay", trace, "-d", name, "--memory", &allowed]);
            run.is_within(memory, &format!("{name} on {trace}"));
        }
        Run::of(folder, &["verify", trace]).is_good(BESIDE, "verify");
        Run::of(folder, &["info", trace, "--memory", &allowed]).is_good(memory + BESIDE, "info");
        let designs = ["--designs", "lk,exact,sorted-blend", "--runs", "1"];
        let throughput = [&["throughput", trace, "--memory", &allowed], &designs[..]].concat();
        let on_cpu = [&throughput[..], &["--engines", "fast,reference"]].concat();
        Run::of(folder, &on_cpu).is_within(memory, "throughput");
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
pub(super) fn memory_is_what_was_allowed_and_a_constant() {
    hold_all(20_000, 200_000, 4);
}

/// So many that what keeps 30 bytes of each is told from what keeps none.
#[test]
#[ignore = "writes traces of 800 MB, takes two minutes"]
fn so_it_is_with_twelve_million_fragments() {
    hold_all(12_000_000, 12_000_000, 16);
}

#[test]
pub(super) fn a_story_that_is_too_long_is_refused_with_what_it_needs() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("t.arrow"), &header(8, 8, 8), 30_000, |_| (3, 3));
    let explain = ["explain", "t.arrow", "--pixel", "3,3", "--memory", "16"];
    let run = Run::of(folder.path(), &explain);
    let error = &run.error;
    assert_eq!(run.status.code(), Some(2), "{error}");
    assert!(error.contains("holds 30000 fragments, whose story takes"), "{error}");
    // What is proposed fits.
    let (_, after) = error.split_once("show the last ").unwrap();
    let last = after.split_whitespace().next().unwrap();
    let run = Run::of(folder.path(), &[&explain[..], &["--last", last]].concat());
    assert!(run.status.success(), "{}", run.error);
}

#[test]
pub(super) fn the_end_of_a_long_story_is_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    // An opaque fragment, behind all others, asks for a pass of its own, which looks at no other.
    let count = 60_000;
    let last = (0..count).max_by_key(|i| depth(*i)).unwrap();
    let fragment = |i| ((3, 3), if i == last { 1.0 } else { 0.01 });
    let path = folder.path().join("t.arrow");
    write_with(&path, &header(8, 8, 8), count, fragment, WriteOptions::default());
    let explain = ["explain", "t.arrow", "--pixel", "3,3", "-d", "sorted-blend"];
    let run = Run::of(folder.path(), &explain);
    assert_eq!(run.status.code(), Some(2), "{}", run.error);
    assert!(run.error.contains("composites anew for each of"), "{}", run.error);
    let run = Run::of(folder.path(), &[&explain[..], &["--last", "5"]].concat());
    assert!(run.status.success(), "{}", run.error);
    assert!(run.output.contains("fragment 60000 of 60000"), "{}", run.output);
    assert!(run.seconds < 10.0, "{} s", run.seconds);
}

#[test]
pub(super) fn one_depth_for_each_primitive_is_refused_where_there_are_too_many() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("t.arrow"), &header(64, 64, 4), 100_000, |i| ((i % 64) as u16, 5));
    let sorted = ["replay", "t.arrow", "-d", "sorted-blend", "--memory"];
    let run = Run::of(folder.path(), &[&sorted[..], &["8"]].concat());
    let error = &run.error;
    assert_eq!(run.status.code(), Some(2), "{error}");
    let (_, after) = error.split_once("takes up to ").unwrap();
    let needed = after.split_whitespace().next().unwrap();
    let run = Run::of(folder.path(), &[&sorted[..], &[needed]].concat());
    assert!(run.status.success(), "{}", run.error);
}

#[test]
pub(super) fn a_vast_frame_costs_what_is_drawn_in_it() {
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
        assert!(run.status.success(), "{command:?}: {}", run.error);
        // The frame has 16 million tiles, of which seven are touched.
        assert!(run.mib < 1024, "{command:?}: {} MiB", run.mib);
        assert!(run.seconds < 30.0, "{command:?}: {} s", run.seconds);
    }
}

#[test]
pub(super) fn a_large_picture_costs_what_it_shows() {
    if !has_proc() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("t.arrow"), &header(3072, 3072, 1), 100, |i| (3071 - i as u16, 3071));
    // All values at once would be 108 MiB, the pixels of both pictures 432.
    for command in [&["replay", "t.arrow", "-o", "a.exr"][..], &["compare", "a.exr", "a.exr"]] {
        let run = Run::of(folder.path(), command);
        assert!(run.status.success(), "{command:?}: {}", run.error);
        assert!(run.mib < 100, "{command:?}: {} MiB", run.mib);
    }
}

#[test]
fn large_batches_cost_a_few_of_them() {
    if !has_proc() {
        return;
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = folder.path().join("t.arrow");
    let rows = 1 << 21;
    let options = WriteOptions { batch_rows: rows, ..WriteOptions::default() };
    write_with(&path, &header(256, 256, 4), 4 * rows as u32, |i| (many(i), 0.01), options);
    let batch = (fs::metadata(&path).unwrap().len() / 4) >> 20;
    for command in [&["info"][..], &["verify"], &["replay"], &["replay", "-d", "exact"]] {
        let run = Run::of(
            folder.path(),
            &[
                command,
                &["t.arrow"],
                if command[0] == "verify" { &[] } else { &["--memory", "16"] },
            ]
            .concat(),
        );
        run.is_good(16 + 4 * batch + BESIDE, &format!("{command:?}"));
    }
}

/// What a GPU's own driver takes, which may be a program for the processor, in MiB.
const DRIVER: u64 = 512;

#[test]
fn throughput_on_a_gpu_is_held_too() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("t.arrow"), &header(256, 256, 4), 200_000, many);
    let throughput = ["throughput", "t.arrow", "--memory", "4", "--runs", "1", "--engines", "gpu"];
    Run::of(folder.path(), &throughput).is_good(4 + BESIDE + DRIVER, "throughput");
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
