//! The layer under a real loader and driver: a program that draws in many ways (`examples/raw`) is
//! run alone and under the layer. Its picture is the same, byte for byte, and whatever it drew is in
//! the log, recorded or refused by name.
//!
//! Without a driver the tests are skipped, which they say; with `SCREENDOOR_GPU=require` they fail.

mod run;

use std::collections::BTreeMap;

use run::{Capture, Ran, cases, raw, skipped, unheard};
use screendoor_vulkan_layer::log::{Draw, Event};
use screendoor_vulkan_layer::settings::{Settings, Span};

/// Cases of which draws are refused, and why.
const REFUSED: [(&str, &str); 15] = [
    ("integer-target", "its output is an integer"),
    ("sets-unasked", "its layout uses all"),
    ("geometry", "it has a geometry shader"),
    ("layered", "it has a geometry shader"),
    ("tessellation", "it has tessellation"),
    ("no-fragment-output", "it has no fragment shader"),
    ("secondary-twice", "its command buffer is run twice"),
    ("indirect-count", "the number of its draws lies in a buffer"),
    ("indirect-count-core", "the number of its draws lies in a buffer"),
    ("draw-id", "gl_DrawID"),
    ("multi-draw", "several instances"),
    ("conditional", "on a condition"),
    ("push-above", "pushed descriptors"),
    ("timeline-twice", "its command buffer is run twice"),
    ("very-many-draws", "more draws are recorded at a time"),
];

/// Cases that have a test of their own, since they do not come to an end by themselves.
const APART: [&str; 2] = ["forever", "killed"];

/// Runs a case alone and under the layer.
fn check(case: &str, settings: &Settings) {
    let plain = raw(case, None);
    if plain.code == Some(3) {
        println!("{case}: skipped, the device cannot: {}", plain.text.trim());
        return;
    }
    let (ran, captures) = captured(case, settings);
    assert_eq!(ran.code, plain.code, "{case}: {}", ran.text);
    assert_eq!(plain.code, Some(0), "{case}: {}", plain.text);
    assert!(!plain.picture.is_empty(), "{case} leaves no picture");
    assert!(ran.picture == plain.picture, "{case}: another picture under the layer");
    let refused: Vec<&Draw> =
        captures.iter().flat_map(Capture::draws).filter(|d| !d.refused.is_empty()).collect();
    match REFUSED.iter().find(|(name, _)| *name == case) {
        None => assert!(refused.is_empty(), "{case}: {:?}", refused[0]),
        Some((_, why)) => {
            assert!(!refused.is_empty(), "{case}: no draw is refused");
            assert!(refused.iter().all(|d| d.refused.contains(why)), "{case}: {:?}", refused[0]);
        }
    }
    let drawn = captures.iter().flat_map(Capture::draws).count();
    assert!(drawn > 0, "{case}: no draw in the log");
    for capture in &captures {
        capture.check(case);
    }
}

fn captured(case: &str, settings: &Settings) -> (Ran, Vec<Capture>) {
    let folder = tempfile();
    let settings = Settings { folder: Some(folder.clone()), ..settings.clone() };
    let ran = raw(case, Some(&settings));
    let captures = Capture::read_all(&folder, case);
    std::fs::remove_dir_all(&folder).unwrap();
    (ran, captures)
}

/// A new folder.
fn tempfile() -> std::path::PathBuf {
    use std::sync::atomic::{AtomicU32, Ordering};
    static N: AtomicU32 = AtomicU32::new(0);
    let n = N.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("screendoor-{}-{n}", std::process::id()));
    std::fs::create_dir(&folder).unwrap();
    folder
}

/// Every case, half of them by each of two threads.
fn check_all(settings: &Settings) {
    let all: Vec<String> = cases().into_iter().filter(|c| !APART.contains(&c.as_str())).collect();
    assert!(all.len() > 60, "{all:?}");
    assert!(REFUSED.iter().all(|(case, _)| all.iter().any(|c| c == case)), "{all:?}");
    let check = |part: usize| all.iter().skip(part).step_by(2).for_each(|c| check(c, settings));
    std::thread::scope(|scope| {
        scope.spawn(|| check(0));
        check(1);
    });
}

#[test]
fn pictures_are_the_same_and_all_draws_are_told() {
    if skipped() {
        return;
    }
    check_all(&Settings::default());
}

#[test]
fn where_records_have_no_address_it_is_the_same() {
    if skipped() {
        return;
    }
    let by_set = Settings { address: false, ..Settings::default() };
    for case in ["plain", "msaa4", "libraries", "set-above", "two-devices", "module-in-pnext"] {
        check(case, &by_set);
        let by_address = captured(case, &Settings::default()).1;
        let by_set = captured(case, &by_set).1;
        let sorted = |captures: &[Capture]| {
            let mut all: Vec<_> = captures.iter().flat_map(|c| c.records.clone()).collect();
            all.sort_by_key(|r| (r.slot, r.instance, r.primitive, r.place, r.coverage));
            all
        };
        assert_eq!(sorted(&by_address), sorted(&by_set), "{case}");
    }
}

#[test]
fn what_is_not_asked_for_leaves_no_record() {
    if skipped() {
        return;
    }
    let all = captured("load", &Settings::default()).1;
    let drawing = all[0].submissions().filter(|s| s.records > 0);
    let numbers: Vec<u64> = drawing.map(|s| s.number).collect();
    assert_eq!(numbers.len(), 2);
    let last = *numbers.last().unwrap();
    let settings = Settings { span: Span::Submissions(last, last), ..Settings::default() };
    check("load", &settings);
    let one = captured("load", &settings).1;
    assert_eq!(one[0].submissions().map(|s| s.number).collect::<Vec<_>>(), [last]);
    // It draws onto what was there, which is read before.
    let before = one[0].pictures().filter(|p| !p.after).count();
    assert_eq!(before, 1);
    let none = Settings { span: Span::Frames(7, 7), ..Settings::default() };
    check_nothing("plain", &none);
}

fn check_nothing(case: &str, settings: &Settings) {
    let plain = raw(case, None);
    let (ran, captures) = captured(case, settings);
    assert!(ran.picture == plain.picture, "{case}");
    assert!(captures.iter().all(|c| c.records.is_empty() && c.submissions().count() == 0));
}

#[test]
fn more_fragments_than_memory_are_counted_and_the_memory_grows() {
    if skipped() {
        return;
    }
    for address in [false, true] {
        let settings = Settings { capacity: 10_000, address, ..Settings::default() };
        let plain = raw("again", None);
        let (ran, captures) = captured("again", &settings);
        assert!(ran.picture == plain.picture);
        let all: Vec<_> = captures[0].submissions().filter(|s| s.needed > 0).collect();
        assert_eq!(all.len(), 2);
        assert!(all[0].needed > all[0].records && all[0].records <= 10_001, "{}", all[0].records);
        assert!(captures[0].notes().any(|n| n.contains("fragments in one submission")));
        // What has an address can lie elsewhere from then on.
        let fits = all[1].needed == all[1].records;
        assert_eq!(fits, address, "{} of {}", all[1].records, all[1].needed);
    }
}

#[test]
fn labels_and_names_of_the_program_are_told() {
    if skipped() {
        return;
    }
    let captures = captured("debug-labels", &Settings::default()).1;
    let labels: BTreeMap<String, usize> =
        captures[0].draws().fold(BTreeMap::new(), |mut all, draw| {
            *all.entry(draw.label.clone()).or_default() += 1;
            all
        });
    assert!(labels.keys().any(|l| l.contains(" / ")), "{labels:?}");
    assert!(captures[0].pipelines().any(|p| !p.name.is_empty()));
    assert!(captures[0].images().any(|i| !i.name.is_empty()));
}

#[test]
fn a_program_that_is_killed_leaves_whole_entries_and_no_end() {
    if skipped() {
        return;
    }
    let (ran, captures) =
        captured("killed", &Settings { span: Span::Frames(50, 60), ..Settings::default() });
    assert_eq!(ran.code, None);
    assert!(captures.iter().all(|c| !c.ended()));
}

#[test]
fn without_a_folder_nothing_is_written() {
    if skipped() {
        return;
    }
    let plain = raw("plain", None);
    let ran = raw("plain", Some(&Settings::default()));
    assert!(ran.picture == plain.picture && ran.text == plain.text, "{}", ran.text);
}

#[test]
fn clears_and_writes_between_draws_are_told() {
    if skipped() {
        return;
    }
    let count = |case: &str, what: fn(&Event) -> bool| {
        let captures = captured(case, &Settings::default()).1;
        captures[0].events().filter(|e| what(e)).count()
    };
    assert!(count("clear-attachments", |e| matches!(e, Event::Clear(c) if !c.depth)) >= 1);
    assert_eq!(count("plain", |e| matches!(e, Event::Clear(_) | Event::Write(_))), 0);
    // Between the draws before and after, and of the image that they are drawn to.
    let captures = captured("overwritten", &Settings::default()).1;
    let events: Vec<&Event> = captures[0].events().collect();
    let at = events.iter().position(|e| matches!(e, Event::Write(_))).expect("a write");
    let Event::Write(write) = events[at] else { unreachable!() };
    assert_eq!(write.command, "vkCmdCopyImage");
    let drawn = |events: &[&Event]| {
        events.iter().any(|e| {
            matches!(e, Event::Pass(p)
            if p.colour.as_ref().is_some_and(|c| c.image == write.image))
        }) && events.iter().any(|e| matches!(e, Event::Draw(_)))
    };
    assert!(drawn(&events[..at]) && drawn(&events[at..]));
}

#[test]
fn nobody_waits_long_for_what_comes_later() {
    if skipped() {
        return;
    }
    for case in ["timeline-behind", "timeline-twice", "timeline-two-queues", "events"] {
        let plain = raw(case, None);
        let ran = captured(case, &Settings::default()).0;
        let more = ran.took.saturating_sub(plain.took);
        assert!(more.as_millis() < 1000, "{case} takes {more:?} longer");
    }
}

#[test]
fn one_frame_of_many_is_captured_alone() {
    if skipped() {
        return;
    }
    let settings = Settings { span: Span::Frames(6, 6), ..Settings::default() };
    let (ran, captures) = captured("resize", &settings);
    let shown = ran.text.contains("frames are presented");
    let none = captures.iter().all(|c| c.records.is_empty());
    assert!(none, "resize has no frame 6");
    let settings = Settings { span: Span::Frames(3, 3), ..Settings::default() };
    let captures = captured("resubmit-frames", &settings).1;
    if !shown {
        println!("skipped: nothing is presented here");
        return;
    }
    let drawing: Vec<_> = captures[0].submissions().filter(|s| s.records > 0).collect();
    assert!(drawing.len() == 1 && drawing[0].frame == 3, "{} submissions", drawing.len());
    assert!(captures[0].ended());
    captures[0].check("resubmit-frames");
}

#[test]
fn nobody_has_to_listen() {
    if skipped() {
        return;
    }
    let settings = Settings { folder: Some("/nowhere/at/all".into()), ..Settings::default() };
    let plain = raw("plain", None);
    assert!(raw("plain", Some(&settings)).text.contains("cannot be written"));
    let deaf = unheard("plain", &settings);
    assert_eq!(deaf.code, Some(0));
    assert!(deaf.picture == plain.picture);
}

#[test]
fn pipelines_that_draw_nothing_leave_no_draws() {
    if skipped() {
        return;
    }
    let captures = captured("discarded", &Settings::default()).1;
    assert_eq!(captures[0].draws().count(), 4);
    assert!(captures[0].draws().all(|d| d.refused.is_empty()));
}

#[test]
fn what_is_recorded_long_before_is_the_programs_own() {
    if skipped() {
        return;
    }
    let settings = Settings { span: Span::Frames(1000, 1001), ..Settings::default() };
    check_nothing("cost", &settings);
    check_nothing("secondaries", &settings);
}
