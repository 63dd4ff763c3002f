//! What was there before the first draw, and what goes over it.

use super::*;
use crate::TargetChoice;
use screendoor_trace::trace::{ColourFormat, SampleMask, Unorm32};

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
const ALL: [i32; 4] = [0, 0, 4, 4];

fn options() -> ConvertOptions {
    ConvertOptions { colour: ColourFormat::F32, ..ConvertOptions::default() }
}

fn alphas(trace: &Trace) -> Vec<f32> {
    fragments(trace).iter().map(|f| f.alpha).collect()
}

#[test]
fn a_clear_of_all_begins_anew() {
    let again = begin(pass(CLEAR, [1.0, 0.0, 0.0, 1.0]));
    let within = clear([1.0, 0.0, 0.0, 1.0], ALL);
    for event in [again, within] {
        let mut made = Made::new();
        let refused = blended(2, vk::BlendFactor::ONE, vk::BlendFactor::ONE);
        let events =
            vec![begin(pass(CLEAR, BLACK)), draw(over(0)), draw(refused), event, draw(over(1))];
        made.submit(events, vec![grey(0, 0, 0.25), grey(2, 0, 0.5), grey(1, 0, 0.75)]);
        let (trace, converted) = made.converted(options());
        assert_eq!(alphas(&trace), [0.75]);
        assert_eq!(trace.header().background, [1.0, 0.0, 0.0]);
        assert_eq!(converted.dropped.painted_over, 2);
        assert_eq!(converted.refused, []);
        assert_eq!(fragments(&trace)[0].object, 0);
        let said = &converted.warnings[0];
        assert!(said.contains("2 fragments were drawn before all was cleared"), "{said}");
    }
}

#[test]
fn a_clear_of_a_part_is_drawn_in_order_and_warned_of_else() {
    let part = Pass { area: [1, 0, 2, 3], ..pass(CLEAR, [1.0, 0.0, 0.0, 1.0]) };
    for event in [begin(part), clear([1.0, 0.0, 0.0, 1.0], [1, 0, 2, 3])] {
        let mut made = Made::new();
        let events = vec![begin(pass(CLEAR, BLACK)), draw(over(0)), event.clone(), draw(over(1))];
        made.submit(events, vec![grey(0, 0, 0.25), grey(1, 0, 0.75)]);
        let program = ConvertOptions { depth: crate::DepthRule::Program, ..options() };
        let (trace, converted) = made.converted(program);
        assert_eq!(alphas(&trace), [0.25, 0.75]);
        let said = &converted.warnings[0];
        assert!(said.contains("a part of the target was cleared once"), "{said}");
        let (trace, converted) = made.converted(options());
        assert_eq!(converted.warnings, Vec::<String>::new());
        let found = fragments(&trace);
        assert_eq!(found.len(), 8);
        let painted: Vec<_> = found[1..7].iter().map(|f| (f.x, f.y)).collect();
        assert_eq!(painted, [(1, 0), (2, 0), (1, 1), (2, 1), (1, 2), (2, 2)]);
        let red = found[1..7].iter().all(|f| f.colour == [1.0, 0.0, 0.0] && f.alpha == 1.0);
        assert!(red && found.iter().map(|f| f.primitive).is_sorted());
        assert!(found[0].depth.z > found[1].depth.z && found[6].depth.z > found[7].depth.z);
        let objects: Vec<_> = converted.objects.iter().map(|o| (o.object, o.fragments)).collect();
        assert_eq!(objects, [(0, 1), (1, 6), (2, 1)]);
        // After the last draw, and beyond the frame.
        let mut made = Made::new();
        let late = clear(BLACK, [3, -5, 100, 6]);
        let events = vec![begin(pass(CLEAR, BLACK)), draw(over(0)), event, late];
        made.submit(events, vec![grey(0, 0, 0.25)]);
        let (trace, _) = made.converted(options());
        let last = fragments(&trace)[7];
        assert_eq!((trace.rows(), last.x, last.y), (8, 3, 0));
    }
}

#[test]
fn clears_of_other_targets_and_of_depth_change_nothing() {
    let mut made = Made::new();
    made.image(2, UNORM, 1, 4);
    let elsewhere = Pass { colour: Some(attachment(2, CLEAR, BLACK)), ..pass(CLEAR, BLACK) };
    let depth = Event::Clear(Clear { depth: true, value: [1.0; 4], area: ALL });
    let events = vec![
        begin(pass(CLEAR, BLACK)),
        draw(over(0)),
        depth,
        begin(elsewhere),
        clear(BLACK, ALL),
        begin(pass(LOAD, BLACK)),
        draw(over(1)),
    ];
    made.submit(events, vec![grey(0, 0, 0.25), grey(1, 0, 0.75)]);
    let (trace, converted) = made.converted(options());
    assert_eq!(alphas(&trace), [0.25, 0.75]);
    assert_eq!(converted.dropped.painted_over, 0);
}

#[test]
fn what_is_loaded_has_to_be_known() {
    let mut made = Made::new();
    made.submit(vec![begin(pass(LOAD, BLACK)), draw(over(0))], vec![grey(0, 0, 0.25)]);
    let error = made.error(options());
    assert!(error.contains("target #1 held before the first draw is not known"), "{error}");
    assert!(error.contains("--background R,G,B"), "{error}");
    // Linear light, as every background is given.
    let (trace, _) =
        made.converted(ConvertOptions { background: Some([0.0, 1.0, 0.214]), ..options() });
    let found = trace.header().background;
    assert!((found[2] - 0.5).abs() < 0.001 && found[..2] == [0.0, 1.0], "{found:?}");
}

#[test]
fn a_picture_of_one_colour_is_the_background() {
    let mut made = Made::new();
    made.submit(vec![begin(pass(LOAD, BLACK)), draw(over(0))], vec![grey(0, 0, 0.25)]);
    made.picture(0, false, &[[255, 0, 51, 9]; 16]);
    // Afterwards it is another.
    made.picture(0, true, &[[1, 2, 3, 4]; 16]);
    let (trace, _) = made.converted(options());
    assert_eq!(trace.header().background, [1.0, 0.0, 0.2]);
    assert_eq!(trace.rows(), 1);
}

#[test]
fn a_picture_of_several_colours_is_drawn_first() {
    let mut made = Made::with(UNORM, 1);
    made.submit(vec![begin(pass(LOAD, BLACK)), draw(over(0))], vec![grey(0, 2, 0.25)]);
    let mut pixels = [[0, 0, 0, 255]; 16];
    pixels[6] = [255, 51, 0, 0];
    made.picture(0, false, &pixels);
    for depth in [crate::DepthRule::Program, crate::DepthRule::Order] {
        let (trace, converted) = made.converted(ConvertOptions { depth, ..options() });
        let found = fragments(&trace);
        assert_eq!(found.len(), 17);
        for (i, f) in found[..16].iter().enumerate() {
            assert_eq!((f.x, f.y), (i as u16 % 4, i as u16 / 4));
            assert_eq!((f.alpha, f.coverage, f.depth.z), (1.0, SampleMask(1), Unorm32::FAR));
            assert_eq!((f.object, f.primitive), (0, 0));
        }
        assert_eq!((found[6].colour, found[5].colour), ([1.0, 0.2, 0.0], [0.0; 3]));
        assert_eq!((found[16].object, found[16].primitive), (1, 1));
        assert!(found[16].depth.z < Unorm32::FAR);
        assert_eq!(converted.objects[0].object, 1);
    }
}

#[test]
fn pictures_are_taken_while_they_are_fresh() {
    let draws = |slot| vec![begin(pass(LOAD, BLACK)), draw(over(slot))];
    let red = &[[255, 0, 0, 255]; 16];
    let span = crate::Span::Submissions(1, 1);
    // After the submission before is before this one.
    let mut made = Made::new();
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(opaque(0))], vec![grey(0, 0, 1.0)]);
    made.picture(0, true, red);
    made.submit(draws(0), vec![grey(0, 0, 0.25)]);
    let (trace, _) = made.converted(ConvertOptions { span, ..options() });
    assert_eq!(trace.header().background, [1.0, 0.0, 0.0]);
    assert_eq!(trace.rows(), 1);
    // What was written since is not known.
    let mut made = Made::new();
    made.submit(Vec::new(), Vec::new());
    made.picture(1, false, red);
    let events = [vec![write_to(1, "vkCmdClearColorImage")], draws(0)].concat();
    made.submit(events, vec![grey(0, 0, 0.25)]);
    let error = made.error(options());
    assert!(error.contains("a command that draws nothing"), "{error}");
    // A picture after that is as good as ever.
    made.submit(draws(0), vec![grey(0, 0, 0.5)]);
    made.picture(2, false, red);
    let span = crate::Span::Submissions(2, 2);
    let (trace, _) = made.converted(ConvertOptions { span, ..options() });
    assert_eq!(trace.header().background, [1.0, 0.0, 0.0]);
    // It has to be as long as its image.
    let mut made = Made::new();
    made.submit(draws(0), vec![grey(0, 0, 0.25)]);
    made.picture(0, false, &red[..15]);
    assert!(made.error(options()).contains("60 bytes, not 64"));
}

#[test]
fn what_else_writes_to_the_target_is_told() {
    let mut made = Made::new();
    made.image(2, UNORM, 1, 4);
    let resolving = Pass {
        colour: Some(attachment(2, CLEAR, BLACK)),
        resolve: Some(attachment(1, LOAD, BLACK)),
        ..pass(CLEAR, BLACK)
    };
    let events = vec![
        write_to(1, "vkCmdFillNothing"),
        begin(pass(CLEAR, BLACK)),
        draw(over(0)),
        write_to(1, "vkCmdBlitImage"),
        write_to(2, "vkCmdCopyImage"),
        begin(resolving),
    ];
    made.submit(events, vec![grey(0, 0, 0.25)]);
    let (_, converted) = made.converted(options());
    let said = converted.warnings.join("\n");
    assert!(said.contains("written by vkCmdBlitImage once after the first draw"), "{said}");
    assert!(said.contains("a resolve of another image once after"), "{said}");
    // Before the clear it does not matter.
    assert!(!said.contains("vkCmdCopyImage") && !said.contains("vkCmdFillNothing"), "{said}");
}

#[test]
fn what_nobody_cares_for_is_no_background() {
    let mut made = Made::new();
    let events = vec![begin(pass(vk::AttachmentLoadOp::DONT_CARE, [1.0; 4])), draw(over(0))];
    made.submit(events, vec![grey(0, 0, 0.25)]);
    let (trace, _) = made.converted(options());
    assert_eq!(trace.header().background, [0.0; 3]);
}

#[test]
fn other_colour_outputs_are_told_of() {
    let mut made = Made::new();
    let events = vec![begin(Pass { others: 2, ..pass(CLEAR, BLACK) }), draw(over(0))];
    made.submit(events, vec![grey(0, 0, 0.25)]);
    let (_, converted) = made.converted(options());
    let said = &converted.warnings[0];
    assert!(said.contains("2 colour attachments beside the target"), "{said}");
    assert!(said.contains("location 0"), "{said}");
}

#[test]
fn srgb_targets_are_linear_and_views_decide() {
    let mut made = Made::new();
    let mut begun = pass(CLEAR, [0.5, 0.5, 0.5, 1.0]);
    begun.colour.as_mut().unwrap().format = vk::Format::R8G8B8A8_SRGB.as_raw();
    made.submit(vec![begin(begun), draw(over(0))], vec![grey(0, 0, 0.25)]);
    let (trace, converted) = made.converted(options());
    assert_eq!(trace.header().space, screendoor_trace::picture::Space::Linear);
    // 188 of 255, in light.
    assert!((trace.header().background[0] - 0.502_886).abs() < 1e-5);
    assert_eq!(converted.format, "R8G8B8A8_SRGB");
    let space = Some(screendoor_trace::picture::Space::Encoded);
    let (trace, _) = made.converted(ConvertOptions { space, ..options() });
    assert_eq!(trace.header().space, screendoor_trace::picture::Space::Encoded);
}

#[test]
fn targets_are_chosen_by_what_a_user_knows_of_them() {
    let mut made = Made::new();
    made.image(2, UNORM, 1, 2);
    made.image(3, UNORM, 1, 4);
    let into =
        |image, load| Pass { colour: Some(attachment(image, load, BLACK)), ..pass(CLEAR, BLACK) };
    let resolved = Pass { resolve: Some(attachment(3, LOAD, BLACK)), ..into(1, CLEAR) };
    let events = vec![
        begin(into(2, CLEAR)),
        draw(over(0)),
        begin(resolved),
        draw(over(1)),
        begin(into(3, LOAD)),
        draw(over(2)),
    ];
    let mut records = vec![grey(0, 0, 0.125); 3];
    records.extend([grey(1, 0, 0.25), grey(1, 1, 0.25), grey(2, 0, 0.5)]);
    made.submit(events, records);
    made.present(0, &[3]);
    let chosen = |target: &str| {
        let target: TargetChoice = target.parse().unwrap();
        made.convert(ConvertOptions { target, background: Some([0.0; 3]), ..options() })
            .map(|(_, converted)| converted.target)
    };
    assert_eq!(chosen("largest").unwrap(), 1);
    // What is resolved into what is presented has more fragments than what is drawn there.
    assert_eq!(chosen("present").unwrap(), 2);
    assert_eq!(chosen("4x4").unwrap(), 2);
    assert_eq!(chosen("2x2").unwrap(), 1);
    assert_eq!(chosen("#3").unwrap(), 3);
    let error = chosen("5x4").unwrap_err().to_string();
    assert!(error.contains("no target 5x4") && error.contains("#1 (2x2 R8G8B8A8_UNORM"), "{error}");
    for bad in ["", "#", "#0", "0x5", "largst", "3"] {
        assert!(bad.parse::<TargetChoice>().is_err(), "{bad}");
    }

    // A copy is presented.
    let mut made = Made::new();
    made.image(2, UNORM, 1, 4);
    made.submit(
        vec![begin(pass(CLEAR, BLACK)), draw(over(0)), write_to(2, "vkCmdBlitImage")],
        vec![grey(0, 0, 0.5)],
    );
    made.present(0, &[2]);
    let error = made.error(ConvertOptions { target: TargetChoice::Present, ..options() });
    assert!(error.contains("not drawn into, but copied"), "{error}");
}

#[test]
fn layers_and_levels_of_an_image_are_targets_of_their_own() {
    let mut made = Made::new();
    let at = |layer, level| {
        let mut begun = pass(CLEAR, BLACK);
        let colour = begun.colour.as_mut().unwrap();
        (colour.layer, colour.level) = (layer, level);
        Pass { area: [0, 0, 4 >> level, 4 >> level], ..begun }
    };
    let events = vec![
        begin(at(0, 0)),
        draw(over(0)),
        begin(at(1, 0)),
        draw(over(1)),
        begin(at(0, 1)),
        draw(over(2)),
    ];
    made.submit(events, vec![grey(0, 0, 0.125), grey(1, 0, 0.25), grey(2, 0, 0.5)]);
    for (number, alpha, side) in [(1, 0.125, 4), (2, 0.25, 4), (3, 0.5, 2)] {
        let target = TargetChoice::Number(number);
        let (trace, _) = made.converted(ConvertOptions { target, ..options() });
        assert_eq!(alphas(&trace), [alpha]);
        assert_eq!(trace.header().width, side);
    }
}
