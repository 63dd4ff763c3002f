//! What is made of traces draws what it should, and memory is what was allowed.

use screendoor::capture::{Capture, CaptureOptions};
use screendoor::edit::{
    Area, Edit, Kept, Merge, MergeOptions, Sequence, Shuffle, ShuffleOptions, Trim, TrimOptions,
    difference, write,
};
use screendoor::scene::load;
use screendoor::trace::{Trace, TraceWriter, WriteOptions};

use crate::limits::many_pixels;
use crate::measured::{Run, has_proc};
use crate::util::{design, half_header, header, picture, random_fragments, trace};

fn made(edit: &dyn Edit) -> Trace {
    let header = edit.header().clone();
    let mut writer = TraceWriter::new(Vec::new(), "made", header, WriteOptions::default()).unwrap();
    write(edit, &mut writer, &mut |_, _| ()).unwrap();
    Trace::from_bytes(writer.finish().unwrap().0, "made").unwrap()
}

fn captured(scene: &str) -> Trace {
    let options = CaptureOptions { width: 80, height: 60, ..CaptureOptions::default() };
    Capture::new(&load(scene).unwrap(), &options).unwrap().to_memory(|_, _| ()).unwrap()
}

#[test]
fn the_first_samples_are_drawn_as_they_are_of_all() {
    let whole = captured("builtin:glass");
    for samples in [1, 8, 32] {
        let options = TrimOptions { samples: Some(samples), ..TrimOptions::default() };
        let first = made(&Trim::new(&whole, options).unwrap());
        assert_eq!(first.header().pattern.name, format!("nested-{samples}"));
        for name in ["lk", "enderton", "residual", "mlab", "exact"] {
            let [a, b] = [&first, &whole].map(|t| picture(&design(name), t, samples, 3).hash());
            assert_eq!(a, b, "{name} at {samples}");
        }
    }
}

#[test]
fn a_part_of_the_frame_is_drawn_as_it_was() {
    let whole = captured("builtin:cloth");
    let area = Area { origin: [17, 9], size: [40, 31] };
    let [x, y] = area.origin;
    let cut = |keep_frame| {
        let options = TrimOptions { area: Some(area), keep_frame, ..TrimOptions::default() };
        made(&Trim::new(&whole, options).unwrap())
    };
    // The exact picture asks for no randomness, which depends on a fragment's pixel.
    for (trace, name, moved) in
        [(cut(true), "lk", 0), (cut(true), "exact", 0), (cut(false), "exact", 1)]
    {
        let [part, all] = [&trace, &whole].map(|t| picture(&design(name), t, 8, 1));
        let mut covered = 0;
        for (dx, dy) in (0..31).flat_map(|dy| (0..40).map(move |dx| (dx, dy))) {
            let at = |n: u32, d: u32| n * (1 - moved) + d;
            let found = part.get(at(x, dx), at(y, dy));
            assert_eq!(found, all.get(x + dx, y + dy), "{name} at {dx},{dy}");
            covered += u32::from(found != [0.0; 3]);
        }
        assert!(covered > 100, "{covered}");
    }
}

#[test]
fn a_cut_view_shows_what_it_showed() {
    let whole = captured("builtin:ramps");
    let area = Area { origin: [30, 5], size: [20, 50] };
    let options = TrimOptions { area: Some(area), ..TrimOptions::default() };
    let cut = made(&Trim::new(&whole, options).unwrap());
    cut.header().check().unwrap();
    let [of_whole, of_cut] = [&whole, &cut].map(|t| t.header().view.unwrap());
    let pixel = |view: &screendoor::trace::View, point: [f64; 4], size: [f64; 2]| {
        let times = |m: &[f64; 16], v: [f64; 4]| -> [f64; 4] {
            std::array::from_fn(|row| (0..4).map(|c| m[4 * c + row] * v[c]).sum())
        };
        let clip = times(&view.view_to_clip, times(&view.world_to_view, point));
        let [x, y] = [clip[0] / clip[3], clip[1] / clip[3]];
        [(1.0 + x) / 2.0 * size[0], (1.0 - y) / 2.0 * size[1]]
    };
    for point in [[0.0, 0.0, 0.0, 1.0], [0.3, -0.2, 0.5, 1.0], [-0.7, 0.9, 0.1, 1.0]] {
        let [x, y] = pixel(&of_whole, point, [80.0, 60.0]);
        let [u, v] = pixel(&of_cut, point, [20.0, 50.0]);
        assert!((x - 30.0 - u).abs() < 1e-9 && (y - 5.0 - v).abs() < 1e-9, "{x} {y}: {u} {v}");
    }
}

#[test]
fn only_the_order_within_a_pixel_changes_a_picture() {
    let whole = captured("builtin:glass");
    let ordered = |order| {
        let options = ShuffleOptions { order, seed: 1, memory: 1 << 22 };
        made(&Shuffle::new(&whole, options).unwrap())
    };
    let found = |other: &Trace| difference([&whole, other], 1 << 20, &mut |_, _| ()).unwrap().same;
    let tiles = ordered(Sequence::Tiles);
    assert_eq!(found(&tiles), Kept::Pixels);
    let shuffled = ordered(Sequence::Random);
    assert_eq!(found(&shuffled), Kept::Fragments);
    for name in ["lk", "residual", "slab"] {
        let hash = |trace| picture(&design(name), trace, 8, 2).hash();
        assert_eq!(hash(&tiles), hash(&whole), "{name}");
        assert_ne!(hash(&shuffled), hash(&whole), "{name}");
    }
}

#[test]
fn traces_joined_are_drawn_one_after_the_other() {
    let header = header(30, 20, 4);
    let all = random_fragments(&header, 4000, 5);
    let parts = [trace(&header, &all[..1500]), trace(&header, &all[1500..])];
    let keep = made(&Merge::new(&parts, MergeOptions { keep_numbers: true }).unwrap());
    let hash = |trace| picture(&design("lk"), trace, 4, 2).hash();
    assert_eq!(hash(&keep), hash(&trace(&header, &all)));
    let narrow = half_header(30, 20, 4);
    let mixed = [trace(&narrow, &all[..1500]), trace(&header, &all[1500..])];
    let joined = made(&Merge::new(&mixed, MergeOptions::default()).unwrap());
    assert_eq!(joined.header().row_bytes(), header.row_bytes());
}

/// MiB that these commands may take beside what `--memory` says and what reading a trace takes:
/// a batch that is written, and what memory is handed out in.
const SLACK: u64 = 32;

/// Two traces that differ in every pixel, with `memory` MiB allowed: far less than what holds all
/// of their fragments.
fn hold_edits(fragments: u32, memory: u64) {
    if !has_proc() {
        return;
    }
    assert!(u64::from(fragments) * 64 > (memory + 2 * SLACK) << 20, "too few to tell");
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let folder = folder.path();
    many_pixels(&folder.join("a.arrow"), fragments, 0.01);
    many_pixels(&folder.join("b.arrow"), fragments, 0.02);
    // What a trace's reader takes, whatever is done with it.
    let reading = Run::of(folder, &["verify", "a.arrow"]).mib;
    let most = |what: &str, run: &Run, memory: u64| {
        let allowed = reading + memory + SLACK;
        assert!(run.mib <= allowed, "{what}: {} MiB, and {allowed} may be", run.mib);
    };
    let allowed = memory.to_string();
    for order in ["random", "near-to-far", "tiles"] {
        let shuffle = ["shuffle", "a.arrow", "-o", "c.arrow", "--order", order];
        let run = Run::of(folder, &[&shuffle[..], &["--memory", &allowed]].concat());
        assert!(run.status.success(), "{order}: {}", run.error);
        most(order, &run, memory);
    }
    let run = Run::of(folder, &["diff", "a.arrow", "c.arrow", "--memory", &allowed]);
    assert!(run.output.contains("replays give the same"), "{}", run.output);
    most("diff", &run, memory);
    let run = Run::of(folder, &["diff", "a.arrow", "b.arrow", "--memory", &allowed]);
    assert_eq!(run.status.code(), Some(3), "{}", run.error);
    assert!(run.output.contains("alpha") && run.output.contains("more --memory"), "{}", run.output);
    most("diff", &run, memory);
    for rest in [
        &["convert", "a.arrow", "--compress", "zstd", "--constants", "find"][..],
        &["trim", "a.arrow", "--area", "3,3,200x100"],
        &["join", "a.arrow", "b.arrow"],
    ] {
        let run = Run::of(folder, &[rest, &["-o", "d.arrow"]].concat());
        assert!(run.status.success(), "{rest:?}: {}", run.error);
        most(rest[0], &run, 0);
    }
}

#[test]
pub fn memory_is_what_was_allowed_and_a_constant() {
    hold_edits(1_500_000, 4);
}

#[test]
#[ignore = "large traces: writes 2 GB, takes minutes"]
fn so_it_is_with_twelve_million_fragments() {
    hold_edits(12_000_000, 16);
}
