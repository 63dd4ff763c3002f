//! Frames, submissions, devices: which are taken, and what is listed.

use super::*;
use crate::{Listing, Span, TargetChoice};

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn of(span: Span) -> ConvertOptions {
    ConvertOptions { span, ..ConvertOptions::default() }
}

/// Frames 3, 4 and 5 with a fragment of the alpha 0.3, 0.4 and 0.5; 5 is not presented.
fn three() -> Made {
    let mut made = Made::new();
    for frame in 3..6 {
        let alpha = frame as f32 / 10.0;
        let events = vec![begin(pass(CLEAR, BLACK)), draw(over(0))];
        made.submit_in(frame, events, vec![grey(0, 0, alpha)]);
        if frame < 5 {
            made.present(frame, &[1]);
        }
    }
    made
}

fn alpha(made: &Made, span: Span) -> f32 {
    fragments(&made.converted(of(span)).0)[0].alpha
}

fn set_needed(made: &mut Made, at: usize, needed: u64) {
    let submissions = made.entries.iter_mut().filter_map(|e| match e {
        Entry::Submission(s) => Some(s),
        _ => None,
    });
    submissions.skip(at).take(1).for_each(|s| s.needed = needed);
}

#[test]
fn the_last_whole_frame_is_taken() {
    let mut made = three();
    assert_eq!(alpha(&made, Span::First), 0.4);
    assert_eq!(alpha(&made, Span::Frames(3, 3)), 0.3);
    // An unfinished one only where it is asked for as submissions.
    let error = made.error(of(Span::Frames(5, 5)));
    assert!(error.contains("it ended within frame 5") && error.contains("--submits"), "{error}");
    assert_eq!(alpha(&made, Span::Submissions(2, 2)), 0.5);
    let (trace, converted) = made.converted(of(Span::Submissions(0, 9)));
    assert_eq!((trace.rows(), &*converted.frame), (1, "submissions 0-2"));
    assert_eq!(converted.dropped.painted_over, 2);
    // What has no memory is passed over, as long as another frame has.
    set_needed(&mut made, 1, 70_000);
    assert_eq!(alpha(&made, Span::First), 0.3);
    let error = made.error(of(Span::Frames(4, 4)));
    assert!(error.contains("frame 4 has 70000 fragments"), "{error}");
    assert!(error.contains("there was memory for 100; give --capacity 131072"), "{error}");
}

#[test]
fn frames_that_never_came_are_told_of() {
    let made = three();
    let error = made.error(of(Span::Frames(9, 9)));
    assert!(error.contains("frame 9 was not captured: prog has presented 5"), "{error}");
    let error = made.error(of(Span::Submissions(7, 8)));
    assert!(error.contains("submissions 7-8 of prog were not captured"), "{error}");
    let mut made = Made::new();
    let error = made.error(of(Span::First));
    assert!(error.contains("prog: it submitted nothing that leaves fragments"), "{error}");
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(over(0))], vec![grey(0, 0, 0.5)]);
    let error = made.error(of(Span::Frames(1, 1)));
    assert!(error.contains("has presented none") && error.contains("--submits"), "{error}");
}

#[test]
fn what_never_presents_is_whole_when_the_program_ends() {
    let mut made = Made::new();
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(over(0))], vec![grey(0, 0, 0.5)]);
    assert_eq!(alpha(&made, Span::First), 0.5);
    made.write();
    let broken = Captures::read(made.path()).unwrap().broken_off();
    let error = convert(&broken, of(Span::First)).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("it ended within frame 0"), "{error}");
}

#[test]
fn of_several_devices_the_one_with_the_target_is_taken() {
    let mut first = Made::new();
    first.submit(vec![begin(pass(CLEAR, BLACK)), draw(over(0))], vec![grey(0, 0, 0.25)]);
    first.write();
    let mut second = Made::new();
    let records = vec![grey(0, 0, 0.5), grey(0, 1, 0.5)];
    second.submit(vec![begin(pass(CLEAR, BLACK)), draw(over(0))], records);
    second.write();
    // Process 12 comes after 7, not before it as text would.
    for (from, to) in [
        (second.files().log, "12-0.log"),
        (second.files().records, "12-0.records"),
        (second.files().pictures, "12-0.pictures"),
    ] {
        fs::copy(from, first.path().join(to)).unwrap();
    }
    // One that has not got anywhere.
    fs::write(first.path().join("13-0.log"), &MAGIC[..5]).unwrap();
    fs::write(first.path().join("14-0.log"), MAGIC).unwrap();
    let captures = Captures::read(first.path()).unwrap();
    let rows = |target| {
        let options = ConvertOptions { target, ..ConvertOptions::default() };
        convert(&captures, options).unwrap().0.rows()
    };
    assert_eq!(rows(TargetChoice::Largest), 2);
    assert_eq!(rows(TargetChoice::Number(1)), 1);
    assert_eq!(rows(TargetChoice::Number(2)), 2);
    assert_eq!(Listing::new(&captures).unwrap().devices.len(), 2);
}

#[test]
fn the_listing_says_what_there_is() {
    let mut made = Made::new();
    made.entries.push(Entry::Image(Image {
        number: 2,
        name: "screen".into(),
        format: vk::Format::B8G8R8A8_SRGB.as_raw(),
        width: 8,
        height: 2,
        samples: 1,
        swapchain: true,
    }));
    let shown =
        Attachment { format: vk::Format::B8G8R8A8_SRGB.as_raw(), ..attachment(2, LOAD, BLACK) };
    let shown = Pass { colour: Some(shown), label: "a / b".into(), ..pass(CLEAR, BLACK) };
    let depth = Pass { colour: None, ..with_depth(pass(CLEAR, BLACK), 1.0) };
    let adding = blended(2, vk::BlendFactor::ONE, vk::BlendFactor::ONE);
    let events = vec![
        begin(pass(CLEAR, BLACK)),
        draw(opaque(0)),
        draw(over(1)),
        draw(adding),
        begin(shown),
        begin(depth),
        draw(opaque(3)),
    ];
    let records = vec![grey(0, 0, 1.0), grey(1, 0, 0.5), grey(2, 0, 0.5), grey(2, 1, 0.5)];
    made.submit_in(6, events, records);
    made.present(6, &[2]);
    made.submit_in(7, vec![begin(pass(LOAD, BLACK))], Vec::new());
    made.entries.push(Entry::Note(screendoor_vulkan_layer::log::Note { text: "beware".into() }));
    set_needed(&mut made, 0, 9);
    let listing = Listing::new(&made.captures()).unwrap();
    let device = &listing.devices[0];
    assert_eq!((device.presented, &*device.program, device.torn), (7, "prog", false));
    assert_eq!(device.notes, ["beware"]);
    assert_eq!(
        device.flawed,
        ["frame 6: 9 fragments, and memory for 100", "frame 7: the program ended before it did"]
    );
    let row = |i: usize| {
        let cells = device.passes[i].cells();
        cells.into_iter().map(|(_, text)| text).collect::<Vec<_>>().join("|")
    };
    assert_eq!(device.passes.len(), 4);
    assert_eq!(row(0), "#1|6|0|4x4|R8G8B8A8_UNORM|1|no|clear|3|2|4|");
    assert_eq!(row(1), "#2 screen|6|0|8x2|B8G8R8A8_SRGB|1|yes|load|0|0|0|a / b");
    assert_eq!(row(2), "-|6|0|-|-|-|-|-|1|0|0|");
    assert_eq!(row(3), "#1|7|1|4x4|R8G8B8A8_UNORM|1|no|load|0|0|0|");
    let refused = &device.passes[0].refused;
    assert_eq!((refused.len(), refused[0].draws, refused[0].fragments), (1, 1, 2));
    assert!(device.passes[2].refused.is_empty());
}
