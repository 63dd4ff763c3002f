//! Replays whole, in windows and in groups give one result.

use std::sync::Mutex;

use super::*;
use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::Probe;
use crate::contract::frame::Site;
use screendoor_trace::random::Stream;
use screendoor_trace::trace::{
    DepthPlane, Fragment, Header, SampleMask, SamplePattern, TraceWriter, Unorm32, WriteOptions,
};

/// A pixel that holds a hash of all that was drawn, in its order.
struct Trail {
    passes: u32,
    bytes: Option<usize>,
}

impl Design for Trail {
    type Pixel = u32;

    fn passes(&self) -> u32 {
        self.passes
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        self.bytes
    }

    fn layout(&self) -> Layout {
        Layout::default()
    }

    fn clear(&self, site: Site) -> u32 {
        u32::from(site.x) << 16 | u32::from(site.y)
    }

    fn draw<P: Probe>(&self, pass: u32, site: Site, pixel: &mut u32, f: &Fragment, _: &mut P) {
        let words = [*pixel, pass, f.primitive, f.coverage.0 as u32, f.depth.z.0, site.x.into()];
        *pixel = Stream::new(words).word();
    }

    fn end_pass<P: Probe>(&self, pass: u32, _: Site, pixel: &mut u32, _: &mut P) {
        *pixel = Stream::new([*pixel, pass]).word();
    }

    fn resolve(&self, _: Site, pixel: &u32) -> [f64; 3] {
        [f64::from(*pixel); 3]
    }

    fn contents(&self, _: &u32) -> Contents {
        Contents::default()
    }
}

/// Random fragments at 8 samples. Those on the right cover the last sample alone.
fn file() -> Vec<u8> {
    let mut header = Header { width: 90, height: 60, ..Header::default() };
    let positions = (0..8).map(|i| [i, -i]).collect();
    header.pattern = SamplePattern { name: "p".into(), positions, nested: true };
    let options = WriteOptions { batch_rows: 300, ..WriteOptions::default() };
    let mut writer = TraceWriter::new(Vec::new(), "t", header, options).unwrap();
    let mut random = Stream::new([8]);
    let mut x = 0;
    for i in 0..4000 {
        if i % 5 == 0 {
            x = random.below(85) as u16;
        }
        x += 1;
        let mask = if x >= 64 { 1 << 7 } else { 1 + u64::from(random.below(255)) };
        let fragment = Fragment {
            x,
            y: random.below(60).min(random.below(60)) as u16,
            coverage: SampleMask(mask),
            depth: DepthPlane { z: Unorm32(random.word()), dzdx: 0, dzdy: 0 },
            alpha: 0.5,
            primitive: i,
            ..Fragment::default()
        };
        writer.push(&fragment).unwrap();
    }
    writer.finish().unwrap().0
}

/// The picture's hash, the touched tiles, the events; what was told is looked at.
fn result(
    trace: &Trace,
    samples: u32,
    design: &Trail,
    options: ReplayOptions<'_>,
) -> (String, usize, Option<EventCounts>) {
    let told = Mutex::new(Vec::new());
    let progress = |done, total| told.lock().unwrap().push((done, total));
    let options = ReplayOptions { count_events: true, progress: &progress, ..options };
    let frame = Frame::of(trace, samples, 1).unwrap();
    let Replayed { picture, touched_tiles, events, .. } =
        replay(design, &frame, trace, &options).unwrap();
    let told = told.into_inner().unwrap();
    assert!(told.is_sorted() && told.iter().all(|(done, total)| done <= total));
    let (done, total) = *told.last().unwrap();
    assert!(done == total && total >= trace.rows() * u64::from(design.passes));
    (picture.hash(), touched_tiles, events)
}

#[test]
fn whole_kept_and_in_windows_give_one_result() {
    let bytes = file();
    for (passes, samples) in [(1, 8), (1, 4), (3, 8), (2, 1)] {
        let design = Trail { passes, bytes: None };
        let whole = ReplayOptions { keep: false, ..ReplayOptions::default() };
        let trace = Trace::from_bytes(bytes.clone(), "t").unwrap();
        let expected = result(&trace, samples, &design, whole);
        // The right edge is untouched where its sample is not replayed.
        assert_eq!(expected.1, if samples == 8 { 24 } else { 16 });
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let kept = ReplayOptions::default();
                assert!(result(&trace, samples, &design, kept) == expected);
                assert!(result(&trace, samples, &design, kept) == expected);
                for (window, memory) in [(97, 1 << 29), (1000, 1 << 29), (usize::MAX, 50_000)] {
                    let options = ReplayOptions { window, memory, ..kept };
                    assert!(result(&trace, samples, &design, options) == expected, "{window}");
                }
                // State that grows takes groups of tiles, or its share of the memory.
                let growing = Trail { passes, bytes: Some(100) };
                for memory in [1 << 29, 300_000, 60_000, 20_000, 5000] {
                    let options = ReplayOptions { memory, ..kept };
                    assert!(result(&trace, samples, &growing, options) == expected, "{memory}");
                }
            });
        }
    }
}

#[test]
fn replays_of_one_trace_at_the_same_time_share_its_bins() {
    let trace = Trace::from_bytes(file(), "t").unwrap();
    let design = Trail { passes: 2, bytes: None };
    let expected = result(&trace, 8, &design, ReplayOptions::default());
    std::thread::scope(|scope| {
        for i in 0..4 {
            let (trace, design, expected) = (&trace, &design, &expected);
            scope.spawn(move || {
                for _ in 0..5 {
                    if i == 0 {
                        Trace::forget_bins();
                    }
                    assert!(result(trace, 8, design, ReplayOptions::default()) == *expected);
                }
            });
        }
    });
}

#[test]
fn a_file_that_changes_between_replays_is_noticed() {
    let folder = std::env::temp_dir().join(format!("screendoor-bins-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("t.arrow");
    std::fs::write(&path, file()).unwrap();
    let trace = Trace::open(&path).unwrap();
    let design = Trail { passes: 1, bytes: None };
    result(&trace, 8, &design, ReplayOptions::default());
    std::fs::write(&path, [0; 50]).unwrap();
    let frame = Frame::of(&trace, 8, 1).unwrap();
    let error = replay(&design, &frame, &trace, &ReplayOptions::default()).unwrap_err();
    assert!(error.to_string().contains("another program has changed or cut it"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}
