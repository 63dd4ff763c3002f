//! What `crates/trace/include/screendoor_trace.h` writes is what the library writes. Where there
//! is no compiler of C (`CC` names one, `cc` otherwise) these tests are skipped, and say so;
//! with `SCREENDOOR_CC=require` they fail.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use half::f16;
use screendoor::capture::{PatternKind, pattern};
use screendoor::gpu::capture::{RawFragment, in_order};
use screendoor::picture::Space;
use screendoor::random::Stream;
use screendoor::trace::{Checksums, ColourFormat, Fragment, Header, Projection, Trace, statistics};

use crate::util::{self, design, picture, random_fragments};

pub fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The compiler that `variable` names, or the system's own, for tests of `what`.
pub fn compiler(variable: &str, own: &str, what: &str) -> Option<String> {
    let name = std::env::var(variable).unwrap_or(own.into());
    let found = Command::new(&name).arg("--version").output();
    if found.is_ok_and(|output| output.status.success()) {
        return Some(name);
    }
    absent(&name, what);
    None
}

/// Says that a test of `what` is skipped; with `SCREENDOOR_CC=require` it fails.
pub fn absent(name: &str, what: &str) {
    let required = std::env::var_os("SCREENDOOR_CC").is_some_and(|v| v == "require");
    assert!(!required, "SCREENDOOR_CC=require, but there is no {name}");
    // Not by the macro, of which a passed test's words are not shown.
    let said = format!("skipped a test of {what}: there is no {name}\n");
    std::io::stderr().write_all(said.as_bytes()).unwrap();
}

/// A program in a folder of its own, where it runs.
struct Program {
    folder: tempfile::TempDir,
    path: PathBuf,
}

impl Program {
    fn build(compiler: &str, flags: &[&str], source: &str) -> Program {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("program");
        let output = Command::new(compiler)
            .args(flags)
            .args(["-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror"])
            .arg("-I")
            .arg(place("crates/trace/include"))
            .arg(place(source))
            .arg("-o")
            .arg(&path)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Program { folder, path }
    }

    fn run(&self, words: &[&str]) -> Output {
        // Where there is this locale, its numbers have a comma.
        let mut command = Command::new(&self.path);
        command.args(words).current_dir(self.folder.path()).env("LC_ALL", "de_DE.UTF-8");
        command.output().unwrap()
    }

    fn run_well(&self, words: &[&str]) {
        let output = self.run(words);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// `tests/c/check.c`.
fn check() -> Option<Program> {
    let cc = compiler("CC", "cc", "the C header")?;
    Some(Program::build(&cc, &["-std=c99", "-Wconversion", "-Wshadow"], "tests/c/check.c"))
}

const EXAMPLE: &str = "crates/trace/include/example.c";

#[test]
fn the_document_has_the_example() {
    let document = fs::read_to_string(place("docs/TRACE_FORMAT.md")).unwrap();
    let example = fs::read_to_string(place(EXAMPLE)).unwrap();
    assert!(document.contains(&format!("```c\n{example}```\n")), "{EXAMPLE} is another");
}

#[test]
fn the_example_writes_what_it_says() {
    let Some(cc) = compiler("CC", "cc", "the C header") else { return };
    let example = Program::build(&cc, &["-std=c99", "-Wconversion", "-Wshadow"], EXAMPLE);
    example.run_well(&[]);
    let trace = Trace::open(example.file("discs.arrow")).unwrap();
    trace.verify(|_| ()).unwrap();
    assert_eq!(trace.checksums(), Checksums::All);
    let header = trace.header();
    assert_eq!(header.pattern, pattern(PatternKind::Standard, 8).unwrap());
    assert_eq!((header.source.as_str(), header.camera.as_str()), ("three discs from C", "unknown"));
    assert_eq!(header.view.unwrap().projection, Projection::Orthographic);
    let found = statistics(&trace, |_| ()).unwrap();
    assert_eq!((found.depth_complexity.max, found.objects.count), (3, 3));
    // In the green disc alone, over the background.
    let pixel = picture(&design("exact"), &trace, 8, 0).get(160, 210);
    let half = |c: f32| f64::from(f16::from_f32(c).to_f32());
    let expected = [0.1, 0.8, 0.1].map(|c| half(c) * f64::from(0.4_f32));
    let behind = f64::from(0.8_f32) * (1.0 - f64::from(0.4_f32));
    for (found, front) in pixel.iter().zip(expected) {
        assert!((found - front - behind).abs() < 1e-6, "{pixel:?}");
    }
}

#[test]
fn the_example_is_cpp_too() {
    let Some(cc) = compiler("CC", "cc", "the C header") else { return };
    let Some(cpp) = compiler("CXX", "c++", "the C header") else { return };
    let bytes = [(cc, ["-x", "c", "-std=c99"]), (cpp, ["-x", "c++", "-std=c++11"])].map(
        |(compiler, flags)| {
            let example = Program::build(&compiler, &flags, EXAMPLE);
            example.run_well(&[]);
            fs::read(example.file("discs.arrow")).unwrap()
        },
    );
    assert!(bytes[0] == bytes[1]);
}

/// The header that `check.c` has.
fn header(samples: u32, colour: ColourFormat) -> Header {
    Header {
        background: [0.1, 1e-7, -3e10],
        source: "test ä".into(),
        colour,
        view: None,
        ..util::header(100, 70, samples)
    }
}

/// Colours that half precision rounds in all its ways.
const ROUNDED: [f32; 16] = [
    0.0,
    -0.0,
    65519.996,
    -65504.0,
    0.333_333_34,
    1.000_488_3,
    1.001_464_8,
    6.097_555e-5,
    6.1e-5,
    5.960_464_5e-8,
    2.980_232_2e-8,
    2.980_233e-8,
    8.940_697e-8,
    -1e-30,
    1e-45,
    2049.0,
];

fn fragments(header: &Header, count: usize, seed: u32) -> Vec<Fragment> {
    let mut fragments = random_fragments(header, count, seed);
    for (f, colour) in fragments.iter_mut().zip(ROUNDED) {
        f.colour = [colour, -colour, colour * 0.5];
    }
    if let [first, second, ..] = &mut fragments[..] {
        (first.alpha, second.alpha) = (0.0, 1.0);
        (first.depth.dzdx, first.depth.dzdy) = (i32::MIN, i32::MAX);
        (first.primitive, first.object) = (u32::MAX, u32::MAX);
    }
    fragments
}

/// The fragments as words, which `check.c` reads.
fn words(fragments: &[Fragment]) -> Vec<u8> {
    let row = |f: &Fragment| {
        let [r, g, b] = f.colour.map(f32::to_bits);
        let [low, high] = [f.coverage.0 as u32, (f.coverage.0 >> 32) as u32];
        let (z, dzdx, dzdy) = (f.depth.z.0, f.depth.dzdx as u32, f.depth.dzdy as u32);
        let [x, y] = [f.x, f.y].map(u32::from);
        [x, y, low, high, z, dzdx, dzdy, r, g, b, f.alpha.to_bits(), f.primitive, f.object]
    };
    fragments.iter().flat_map(row).flat_map(u32::to_ne_bytes).collect()
}

/// As a file has them.
fn stored(header: &Header, fragments: &[Fragment]) -> Vec<Fragment> {
    let half = |c: f32| match header.colour {
        ColourFormat::F16 => f16::from_f32(c).to_f32(),
        ColourFormat::F32 => c,
    };
    fragments.iter().map(|f| Fragment { colour: f.colour.map(half), ..*f }).collect()
}

/// Writes fragments by `check.c`, and holds the trace against that of the library.
fn compare(check: &Program, header: &Header, fragments: &[Fragment], more: &[&str]) {
    fs::write(check.file("fragments"), words(fragments)).unwrap();
    let numbers = [header.width, header.height, header.pattern.samples()].map(|n| n.to_string());
    let mut command = vec!["write", "written.arrow", "fragments"];
    command.extend(numbers.iter().map(String::as_str));
    command.extend(more);
    if header.colour == ColourFormat::F32 {
        command.push("float");
    }
    check.run_well(&command);
    assert!(!check.file("written.arrow.partial").exists());
    let trace = Trace::open(check.file("written.arrow")).unwrap();
    let what = format!("{} rows, {command:?}", fragments.len());
    let sealed = !more.contains(&"unsealed");
    let checksums = if sealed { Checksums::All } else { Checksums::None };
    assert_eq!(trace.checksums(), checksums, "{what}");
    assert_eq!(trace.header(), header, "{what}");
    assert_eq!(trace.rows(), fragments.len() as u64, "{what}");
    assert_eq!(trace.converted_columns().count(), 0, "{what}");
    assert!(trace.extra_columns().is_empty(), "{what}");
    let read: Vec<Fragment> =
        trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect();
    assert!(read == stored(header, fragments), "{what}");
    // The same words of metadata and the same bytes of columns.
    let ours = util::trace(header, fragments);
    assert_eq!(trace.verify(|_| ()).unwrap(), ours.content().unwrap(), "{what}");
    assert_eq!(trace.content(), sealed.then(|| ours.content().unwrap()), "{what}");
}

#[test]
fn traces_are_those_of_the_library() {
    let Some(check) = check() else { return };
    for samples in [1, 2, 4, 8, 16, 32, 64] {
        for colour in [ColourFormat::F16, ColourFormat::F32] {
            let plain = header(samples, colour);
            let viewed = Header { view: Some(util::view()), ..plain.clone() };
            let encoded = Header { space: Space::Encoded, ..plain.clone() };
            let both = Header { space: Space::Encoded, ..viewed.clone() };
            let fragments = fragments(&plain, 333, samples);
            compare(&check, &plain, &fragments, &[]);
            compare(&check, &plain, &fragments, &["unsealed"]);
            compare(&check, &viewed, &fragments, &["view", "arrays"]);
            compare(&check, &viewed, &fragments, &["view", "unsealed"]);
            compare(&check, &encoded, &fragments, &["encoded"]);
            compare(&check, &both, &fragments, &["encoded", "view"]);
            for rows in [0, 1] {
                compare(&check, &plain, &fragments[..rows], &[]);
                compare(&check, &plain, &fragments[..rows], &["unsealed"]);
            }
        }
    }
}

#[test]
fn traces_of_many_batches_are_those_of_the_library() {
    let Some(check) = check() else { return };
    for (samples, colour) in [(4, ColourFormat::F16), (64, ColourFormat::F32)] {
        let header = header(samples, colour);
        let fragments = fragments(&header, 200_000, samples);
        compare(&check, &header, &fragments, &[]);
        compare(&check, &header, &fragments, &["unsealed", "arrays"]);
        // Just full, and one more.
        compare(&check, &header, &fragments[..65_536], &[]);
        compare(&check, &header, &fragments[..65_537], &["arrays"]);
    }
}

#[test]
fn standard_positions_are_ours() {
    let Some(check) = check() else { return };
    for samples in [1, 2, 4, 8, 16] {
        let pattern = pattern(PatternKind::Standard, samples).unwrap();
        let header = Header { pattern, ..header(samples, ColourFormat::F16) };
        compare(&check, &header, &fragments(&header, 5, samples), &["standard"]);
    }
}

#[test]
fn no_bit_of_a_sealed_file_can_change() {
    let Some(check) = check() else { return };
    let header = Header { view: Some(util::view()), ..header(4, ColourFormat::F16) };
    compare(&check, &header, &fragments(&header, 20, 1), &["view"]);
    let good = fs::read(check.file("written.arrow")).unwrap();
    for bit in 0..good.len() * 8 {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let read = Trace::from_bytes(bytes, "flipped").and_then(|trace| trace.verify(|_| ()));
        assert!(read.is_err(), "bit {bit} passes");
    }
}

#[test]
fn raw_fragments_become_those_of_the_library() {
    let Some(check) = check() else { return };
    let header = header(4, ColourFormat::F32);
    let mut random = Stream::new([0xc0de]);
    let mut raw: Vec<RawFragment> = Vec::new();
    for i in 0..20_000 {
        let mut real = |low: f32, high: f32| low + (high - low) * random.unit();
        let z = real(-0.1, 1.1);
        let slopes = [real(-0.6, 0.6), real(-1e-3, 1e-3)];
        let colour = [real(-1.0, 2.0), real(0.0, 1.0), real(0.0, 1e6)];
        let alpha = real(-0.1, 1.1);
        let primitive = random.below(20);
        raw.push(RawFragment {
            pixel: random.below(40) | random.below(30) << 16,
            primitive,
            object: primitive / 3,
            coverage: 1 + random.below(15),
            z,
            slopes,
            colour,
            alpha,
        });
        let awkward = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1.0, 0.5, -0.5];
        if i < 64 {
            raw[i].z = awkward[i / 8];
            raw[i].slopes = [awkward[i % 8], 0.25];
        }
    }
    let bytes = |f: &RawFragment| {
        let [red, green, blue] = f.colour.map(f32::to_bits);
        let [z, right, down] = [f.z, f.slopes[0], f.slopes[1]].map(f32::to_bits);
        let words = [f.pixel, f.primitive, f.object, f.coverage, z, right, down];
        let colour = [red, green, blue, f.alpha.to_bits()];
        words.into_iter().chain(colour).flat_map(u32::to_ne_bytes).collect::<Vec<u8>>()
    };
    fs::write(check.file("raw"), raw.iter().flat_map(bytes).collect::<Vec<u8>>()).unwrap();
    check.run_well(&["raw", "written.arrow", "raw", "100", "70", "4"]);
    let trace = Trace::open(check.file("written.arrow")).unwrap();
    let expected: Vec<Fragment> = in_order(raw).iter().map(RawFragment::fragment).collect();
    assert!(expected.len() < 17_000, "some are put together");
    let ours = util::trace(&header, &expected);
    assert_eq!(trace.verify(|_| ()).unwrap(), ours.content().unwrap());
}

#[test]
fn refusals_say_where_and_leave_nothing() {
    let Some(check) = check() else { return };
    let folder = check.file("refused");
    fs::create_dir_all(folder.join("folder.arrow")).unwrap();
    fs::write(folder.join("kept.arrow"), "old").unwrap();
    // What is written there meets a full disk.
    #[cfg(unix)]
    std::os::unix::fs::symlink("/dev/full", folder.join("full.arrow.partial")).unwrap();
    let output = check.run(&["refuse", "refused"]);
    assert!(output.status.success());
    let said = String::from_utf8(output.stdout).unwrap();
    let expected: [(&str, &str); 43] = [
        ("x", "row 2, column 'x': 8 lies outside the frame, which is 8 pixels wide"),
        ("x-wide", "row 2, column 'x': 65537 lies"),
        ("y", "row 2, column 'y': 9 lies outside the frame, which is 9 pixels high"),
        ("none", "row 2, column 'coverage': it is 0"),
        ("stray", "row 2, column 'coverage': 0x10 has samples that do not exist"),
        ("stray-high", "row 2, column 'coverage': 0x8000000000000000 has samples"),
        ("r", "row 2, column 'r': it is not finite"),
        ("g", "row 2, column 'g': it is not finite"),
        ("b", "row 2, column 'b': -65520 is beyond 65504: set float_colours"),
        ("alpha", "row 2, column 'alpha': it is not finite"),
        ("alpha-more", "row 2, column 'alpha': 1.0000001 is not 0 to 1"),
        ("alpha-less", "row 2, column 'alpha': -0.00"),
        ("late", "row 70000, column 'x'"),
        ("kept", "row 2, column 'x'"),
        ("width-none", "width is 0, not 1 to 65536"),
        ("width", "width is 65537"),
        ("height", "height is 70000"),
        ("samples", "samples is 12, not 1, 2, 4"),
        ("samples-many", "samples is 128"),
        ("positions", "of 32 samples there are no standard positions"),
        ("position", "position 2 is -4,8"),
        ("background", "background is not finite"),
        ("source", "source is not UTF-8"),
        ("camera", "camera is not UTF-8"),
        ("pattern", "pattern is not UTF-8"),
        ("near", "view: near_plane is not before the eye"),
        ("far", "view: near_plane is not below far_plane"),
        ("far-infinite", "view: near_plane or far_plane is not finite"),
        ("world", "view: world_to_view does more than turn, mirror and move"),
        ("world-row", "view: world_to_view's last row"),
        ("world-nan", "view: world_to_view is not finite"),
        ("clip-row", "view: view_to_clip's last row is not 0 0 -k 0"),
        ("clip-kind", "view: view_to_clip's last row is not 0 0 0 k"),
        ("clip-x", "view: view_to_clip's depth depends on x or y"),
        ("clip-singular", "view: view_to_clip is singular"),
        ("clip-near", "view: view_to_clip does not give near_plane the depth 0"),
        ("clip-far", "view: view_to_clip does not give far_plane the depth 1"),
        ("missing", "cannot create: "),
        ("folder", "cannot write: "),
        ("full", "cannot "),
        ("abandoned", "it was abandoned"),
        ("null", "out of memory"),
        ("closed", "it is closed"),
    ];
    assert_eq!(said.lines().count(), expected.len(), "{said}");
    for (line, (name, what)) in said.lines().zip(expected) {
        let (found, error) = line.split_once(": ").unwrap();
        assert_eq!(found, name, "{line}");
        let named = name == "null" || error.starts_with("refused/");
        assert!(named && error.contains(what), "{line}, not {what}");
    }
    let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string();
    let mut left: Vec<String> =
        fs::read_dir(&folder).unwrap().map(|entry| name(entry).unwrap()).collect();
    left.sort();
    assert_eq!(left, ["closed.arrow", "folder.arrow", "kept.arrow"]);
    assert_eq!(fs::read(folder.join("kept.arrow")).unwrap(), b"old");
    // What was closed stands.
    let closed = Trace::open(folder.join("closed.arrow")).unwrap();
    assert_eq!(closed.rows(), 1);
    closed.verify(|_| ()).unwrap();
}
