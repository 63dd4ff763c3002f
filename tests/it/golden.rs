//! The traces in `traces/`, and the pictures that designs make of them.
//!
//! Each trace is captured anew and must have the content hash that stands in
//! `traces/README.md`; each design must give the pictures whose hashes are hashed in
//! `traces/golden.txt`. To accept a change that is meant:
//! `cargo test write_golden -- --ignored`, and say in the commit why.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use screendoor::capture::{Capture, CaptureOptions, Order};
use screendoor::gpu::capture::GpuCapture;
use screendoor::rop::ReplayOptions;
use screendoor::trace::{Compression, Fragment, Header, Trace, TraceWriter, WriteOptions};

use crate::util::{all_variants, gpu, picture};

/// A trace of the folder: its name, its scene, and how it is captured.
struct Golden {
    name: &'static str,
    scene: &'static str,
    order: Order,
}

const SIDE: u32 = 64;

const TRACES: [Golden; 8] = [
    Golden { name: "ramps", scene: "builtin:ramps", order: Order::Api },
    Golden { name: "layers", scene: "builtin:layers:alpha=0.3,coloured=true", order: Order::Api },
    Golden { name: "engine", scene: "builtin:engine:rows=1,detail=2", order: Order::Api },
    Golden { name: "cloth", scene: "builtin:cloth:sheets=3,cells=24", order: Order::Random },
    Golden { name: "hair", scene: "builtin:hair:strands=300", order: Order::Api },
    Golden { name: "smoke", scene: "builtin:smoke:puffs=300", order: Order::FarToNear },
    Golden { name: "foliage", scene: "builtin:foliage:cards=500", order: Order::NearToFar },
    Golden { name: "glass", scene: "builtin:glass", order: Order::Api },
];

/// The trace that a GPU has captured, at 4 samples.
const BY_GPU: Golden = Golden { name: "glass-gpu", scene: "builtin:glass", order: Order::Api };

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("traces")
}

impl Golden {
    fn path(&self) -> PathBuf {
        folder().join(format!("{}.arrow", self.name))
    }

    /// Captures the scene anew: the file's bytes and the content hash.
    fn capture(&self) -> (Vec<u8>, String) {
        let scene = screendoor::scene::load(self.scene).unwrap();
        let options = CaptureOptions {
            width: SIDE,
            height: SIDE,
            order: self.order,
            ..CaptureOptions::default()
        };
        let capture = Capture::new(&scene, &options).unwrap();
        let write = WriteOptions { compression: Compression::Zstd, ..WriteOptions::default() };
        let mut writer =
            TraceWriter::new(Vec::new(), self.name, capture.header().clone(), write).unwrap();
        capture.draw(&mut writer, |_, _| ()).unwrap();
        let (bytes, written) = writer.finish().unwrap();
        (bytes, written.content)
    }

    fn command(&self) -> String {
        let order = match self.order {
            Order::Api => "",
            Order::Random => " --order random",
            Order::NearToFar => " --order near-to-far",
            Order::FarToNear => " --order far-to-near",
        };
        format!(
            "screendoor capture {} -o {}.arrow --size {SIDE}x{SIDE} --compress zstd{order}",
            self.scene, self.name
        )
    }
}

fn by_gpu_options() -> CaptureOptions {
    CaptureOptions { width: SIDE, height: SIDE, samples: 4, ..CaptureOptions::default() }
}

fn readme(contents: &[(u64, String)]) -> String {
    let mut text = String::from(
        "# Traces\n\n\
         Small traces of the built-in scenes, 64 nested samples per pixel, for tests and benches. Each\n\
         is made by the command beside it, and a test makes it again and compares the content hash.\n\
         `golden.txt` holds a hash over the pictures that each design makes of them; `hostile/` holds\n\
         files that must be refused.\n\n\
         | trace | fragments | content hash | made by |\n|---|---:|---|---|\n",
    );
    for (golden, (rows, content)) in TRACES.iter().zip(contents) {
        let _ = writeln!(
            text,
            "| {}.arrow | {rows} | `{content}` | `{}` |",
            golden.name,
            golden.command()
        );
    }
    let (rows, content) = summary(&BY_GPU);
    let _ = write!(
        text,
        "\nCaptured by a GPU, the one that the trace names; a test holds it against our own rasteriser's\n\
         capture, and where that GPU is found captures it again:\n\n\
         | trace | fragments | content hash | made by |\n|---|---:|---|---|\n\
         | {}.arrow | {rows} | `{content}` | `{} --gpu` |\n",
        BY_GPU.name,
        BY_GPU.command()
    );
    text
}

fn summary(golden: &Golden) -> (u64, String) {
    let trace = Trace::open(golden.path()).unwrap();
    (trace.rows(), trace.content().unwrap().to_string())
}

/// A line for each design and sample count, at seed 1: a hash over the hashes of the pictures
/// of all traces. They are older than views, and those that ask for one are left out. Which of
/// them has changed, `cargo run -p xtask -- same` tells.
fn pictures() -> String {
    let traces = TRACES.map(|golden| Trace::open(golden.path()).unwrap());
    let mut text = String::new();
    for design in all_variants().iter().filter(|design| !design.asks_for_view()) {
        let label = design.label();
        let counts: &[u32] = if label.contains(':') { &[8] } else { &[1, 4, 8, 16, 64] };
        for samples in counts {
            let mut hasher = blake3::Hasher::new();
            for trace in &traces {
                hasher.update(picture(design, trace, *samples, 1).hash().as_bytes());
            }
            let _ = writeln!(text, "{label} {samples} {}", hasher.finalize().to_hex());
        }
    }
    text
}

fn on_disk() -> Vec<(u64, String)> {
    TRACES.iter().map(summary).collect()
}

#[test]
fn the_gpu_s_trace_is_what_our_rasteriser_finds() {
    let trace = Trace::open(BY_GPU.path()).unwrap();
    assert_eq!(trace.verify(|_| ()).unwrap(), summary(&BY_GPU).1);
    let (scene, options) = (screendoor::scene::load(BY_GPU.scene).unwrap(), by_gpu_options());
    let ours = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    assert_eq!(trace.header().pattern, ours.header().pattern);
    let all = |trace: &Trace| -> Vec<Fragment> {
        trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
    };
    assert_eq!(all(&trace), all(&ours));

    let Some(gpu) = gpu() else { return };
    let found = GpuCapture::new(gpu, &scene, &options).unwrap();
    // The trace is older than views.
    let bare = Header { view: None, ..found.header().clone() };
    if bare == *trace.header() {
        let again = found.to_memory(|_, _| ()).unwrap();
        assert_eq!(again.content().unwrap(), trace.content().unwrap());
    }
}

#[test]
fn the_traces_are_what_their_commands_make() {
    let found = on_disk();
    assert_eq!(fs::read_to_string(folder().join("README.md")).unwrap(), readme(&found));
    for (golden, (_, content)) in TRACES.iter().zip(found) {
        assert_eq!(golden.capture().1, content, "{}", golden.name);
        let trace = Trace::open(golden.path()).unwrap();
        assert_eq!(trace.verify(|_| ()).unwrap(), content);
    }
}

#[test]
fn the_pictures_are_the_golden_ones() {
    let expected = fs::read_to_string(folder().join("golden.txt")).unwrap();
    let found = pictures();
    for (expected, found) in expected.lines().zip(found.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(expected.lines().count(), found.lines().count());
}

#[test]
fn what_asks_for_a_view_refuses_traces_without_one() {
    let trace = Trace::open(TRACES[0].path()).unwrap();
    assert_eq!(trace.header().view, None);
    let asking: Vec<_> = all_variants().into_iter().filter(|d| d.asks_for_view()).collect();
    let labels: Vec<String> = asking.iter().map(|design| design.label()).collect();
    assert_eq!(labels, ["wboit:lens=camera", "mboit:lens=camera"]);
    for design in asking {
        let error = design.replay(&trace, 8, 1, &ReplayOptions::default()).unwrap_err();
        assert!(error.is_config());
        let error = error.to_string();
        let words = ["lens=camera", "does not say; capture the trace again", "lens=perspective"];
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

#[test]
#[ignore = "writes the traces and golden.txt"]
fn write_golden() {
    for golden in &TRACES {
        fs::write(golden.path(), golden.capture().0).unwrap();
    }
    if let Some(gpu) = gpu() {
        let (scene, options) = (screendoor::scene::load(BY_GPU.scene).unwrap(), by_gpu_options());
        let capture = GpuCapture::new(gpu, &scene, &options).unwrap();
        let write = WriteOptions { compression: Compression::Zstd, ..WriteOptions::default() };
        let header = capture.header().clone();
        let mut writer = TraceWriter::new(Vec::new(), BY_GPU.name, header, write).unwrap();
        capture.draw(&mut writer, |_, _| ()).unwrap();
        fs::write(BY_GPU.path(), writer.finish().unwrap().0).unwrap();
    }
    fs::write(folder().join("README.md"), readme(&on_disk())).unwrap();
    fs::write(folder().join("golden.txt"), pictures()).unwrap();
}
