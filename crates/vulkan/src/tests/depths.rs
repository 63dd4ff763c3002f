//! Depths: the program's own, and the order of drawing.

use super::*;
use crate::DepthRule;
use screendoor_trace::trace::Unorm32;

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn by(depth: DepthRule) -> ConvertOptions {
    ConvertOptions { depth, ..ConvertOptions::default() }
}

fn at(record: Record, z: f32) -> Record {
    Record { z, ..record }
}

fn depths(trace: &Trace) -> Vec<u32> {
    fragments(trace).iter().map(|f| f.depth.z.0).collect()
}

#[test]
fn the_program_s_depths_are_integers_and_a_reversed_range_is_turned_round() {
    for (op, reversed) in [(vk::CompareOp::LESS, false), (vk::CompareOp::GREATER_OR_EQUAL, true)] {
        let mut made = Made::new();
        let sloped = Record { dzdx: 0.25, dzdy: -0.125, ..at(grey(0, 0, 0.5), 0.25) };
        let steep = Record { dzdx: 3.0, ..at(grey(0, 1, 0.5), 0.25) };
        let events = vec![
            begin(with_depth(pass(CLEAR, BLACK), if reversed { 0.0 } else { 1.0 })),
            draw(testing(over(0), op, true)),
        ];
        made.submit(events, vec![sloped, steep]);
        let (trace, converted) = made.converted(by(DepthRule::Auto));
        assert_eq!(converted.depth, DepthRule::Program);
        let first = fragments(&trace)[0].depth;
        let expected = if reversed {
            (0xbfff_ffff, -(1 << 30), 1 << 29)
        } else {
            (0x4000_0000, 1 << 30, -(1 << 29))
        };
        assert_eq!((first.z.0, first.dzdx, first.dzdy), expected);
        let second = fragments(&trace)[1].depth;
        assert_eq!((second.z, second.dzdx), (Unorm32(expected.0), 0));
        assert_eq!(converted.dropped.flattened, 1);
        assert!(converted.warnings[0].contains("too steep"), "{:?}", converted.warnings);
    }
}

#[test]
fn what_tests_no_depth_is_warned_of_or_drawn_in_order() {
    let mut made = Made::new();
    let events = vec![
        begin(with_depth(pass(CLEAR, BLACK), 1.0)),
        draw(testing(over(0), vk::CompareOp::LESS, true)),
        draw(over(1)),
    ];
    made.submit(events, vec![grey(0, 0, 0.5), grey(1, 0, 0.5)]);
    let (_, converted) = made.converted(by(DepthRule::Auto));
    let said = &converted.warnings[0];
    assert!(said.contains("1 draw (1 fragment) test no depth"), "{said}");
    assert!(said.contains("--depth order"), "{said}");
    let (trace, converted) = made.converted(by(DepthRule::Order));
    assert_eq!(converted.warnings, Vec::<String>::new());
    let found = depths(&trace);
    assert!(found[1] < found[0] && found[0] < u32::MAX, "{found:?}");

    // Where nothing tests, order is what is taken.
    let mut made = Made::new();
    made.submit(
        vec![begin(pass(CLEAR, BLACK)), draw(over(0)), draw(over(1))],
        vec![at(grey(0, 0, 0.5), 0.1), at(grey(1, 0, 0.5), 0.9)],
    );
    let (trace, converted) = made.converted(by(DepthRule::Auto));
    assert_eq!(converted.depth, DepthRule::Order);
    let found = depths(&trace);
    assert!(found[1] < found[0], "{found:?}");
    // Asked for otherwise, it is done, and said.
    let (trace, converted) = made.converted(by(DepthRule::Program));
    assert!(depths(&trace)[0] < depths(&trace)[1]);
    assert!(converted.warnings[0].contains("2 draws (2 fragments) test no depth"));
}

#[test]
fn what_fails_the_program_s_test_is_left_out_sample_by_sample() {
    let mut made = Made::with(UNORM, 4);
    let all = |record: Record| Record { coverage: 15, ..record };
    let events = vec![
        begin(with_depth(pass(CLEAR, BLACK), 1.0)),
        draw(testing(opaque(0), vk::CompareOp::LESS, true)),
        draw(testing(over(1), vk::CompareOp::LESS, false)),
        draw(testing(over(2), vk::CompareOp::LESS, false)),
    ];
    let records = vec![
        all(at(grey(0, 0, 1.0), 0.5)),
        // Behind, on all samples.
        all(at(grey(1, 0, 0.5), 0.75)),
        // Samples lie at x of -2, 6, -6 and 2 sixteenths: nearer on the left.
        all(Record { dzdx: 1.0, ..at(grey(2, 0, 0.5), 0.5) }),
    ];
    made.submit(events, records);
    let (trace, converted) = made.converted(by(DepthRule::Order));
    let found: Vec<_> = fragments(&trace).iter().map(|f| (f.object, f.coverage.0)).collect();
    assert_eq!(found, [(0, 15), (1, 0b0101)]);
    assert_eq!(converted.dropped.hidden, 1);
    // The designs' own test does that with the program's depths.
    let (trace, _) = made.converted(by(DepthRule::Program));
    assert_eq!(trace.rows(), 3);
}

#[test]
fn draws_that_leave_no_colour_hide_others_in_order() {
    let mut made = Made::new();
    made.image(2, UNORM, 1, 4);
    let mut depth_alone = testing(opaque(0), vk::CompareOp::LESS, true);
    depth_alone.state.mask = 0;
    let elsewhere = Pass { colour: Some(attachment(2, CLEAR, BLACK)), ..pass(CLEAR, BLACK) };
    let keeping = Pass { depth: Some(attachment(9, LOAD, BLACK)), ..pass(CLEAR, BLACK) };
    let events = vec![
        // Another target, whose depth is used again.
        begin(with_depth(elsewhere, 1.0)),
        draw(testing(opaque(5), vk::CompareOp::LESS, true)),
        begin(keeping),
        draw(depth_alone),
        draw(testing(over(1), vk::CompareOp::LESS, false)),
    ];
    let records = vec![
        at(grey(5, 0, 1.0), 0.25),
        at(grey(0, 1, 1.0), 0.25),
        at(grey(1, 0, 0.5), 0.5),
        at(grey(1, 1, 0.5), 0.5),
        at(grey(1, 2, 0.5), 0.5),
    ];
    made.submit(events, records);
    let target = crate::TargetChoice::Number(2);
    let (trace, converted) = made.converted(ConvertOptions { target, ..by(DepthRule::Order) });
    assert_eq!(fragments(&trace).iter().map(|f| f.x).collect::<Vec<_>>(), [2]);
    assert_eq!((converted.dropped.hidden, converted.dropped.depth_alone), (2, 1));
}

#[test]
fn depth_that_is_cleared_again_is_known_in_order_and_warned_of_else() {
    let mut made = Made::new();
    let less = |slot| testing(over(slot), vk::CompareOp::LESS, true);
    let cleared =
        Event::Clear(Clear { depth: true, value: [1.0, 0.0, 0.0, 0.0], area: [0, 0, 1, 4] });
    let events =
        vec![begin(with_depth(pass(CLEAR, BLACK), 1.0)), draw(less(0)), cleared, draw(less(1))];
    let records =
        [0, 1].into_iter().flat_map(|x| [at(grey(0, x, 0.5), 0.25), at(grey(1, x, 0.5), 0.5)]);
    made.submit(events, records.collect());
    let (trace, _) = made.converted(by(DepthRule::Order));
    let found: Vec<_> = fragments(&trace).iter().map(|f| (f.object, f.x)).collect();
    assert_eq!(found, [(0, 0), (0, 1), (1, 0)]);
    let (_, converted) = made.converted(by(DepthRule::Program));
    assert!(converted.warnings[0].contains("depth was cleared once"), "{:?}", converted.warnings);
}

#[test]
fn ranges_of_both_kinds_are_warned_of() {
    let mut made = Made::new();
    let events = vec![
        begin(with_depth(pass(CLEAR, BLACK), 1.0)),
        draw(testing(over(0), vk::CompareOp::LESS, true)),
        draw(testing(over(1), vk::CompareOp::GREATER, true)),
    ];
    made.submit(events, vec![grey(0, 0, 0.5), grey(0, 1, 0.5), grey(1, 0, 0.5)]);
    let (_, converted) = made.converted(by(DepthRule::Program));
    assert!(converted.warnings[0].contains("1 fragment are tested for greater"));
}

/// A draw without a fragment shader, of which there are no records.
fn prepass(made: &mut Made) -> Draw {
    made.entries.push(Entry::Pipeline(Pipeline {
        number: 5,
        refused: "it has no fragment shader".into(),
        samples: 1,
        ..Pipeline::default()
    }));
    let mut draw = testing(opaque(u32::MAX), vk::CompareOp::LESS, true);
    draw.state.mask = 0;
    Draw { pipeline: 5, ..draw }
}

#[test]
fn what_asks_for_the_same_depth_is_nearest_where_that_left_no_records() {
    for (op, clear, near, far) in
        [(vk::CompareOp::LESS, 1.0, 0.25, 0.75), (vk::CompareOp::GREATER, 0.0, 0.75, 0.25)]
    {
        let mut made = Made::new();
        let first = testing(prepass(&mut made), op, true);
        // Says which way depths go.
        let other = testing(over(3), op, false);
        let events = vec![
            begin(with_depth(pass(CLEAR, BLACK), clear)),
            draw(first),
            draw(other),
            draw(testing(over(0), vk::CompareOp::EQUAL, false)),
            draw(testing(over(1), vk::CompareOp::EQUAL, false)),
        ];
        let records = vec![
            at(grey(0, 0, 0.5), far),
            at(grey(1, 0, 0.5), near),
            at(grey(0, 1, 0.5), far),
            at(grey(3, 3, 0.5), near),
        ];
        made.submit(events, records);
        let (trace, converted) = made.converted(by(DepthRule::Order));
        let found: Vec<_> = fragments(&trace).iter().map(|f| (f.object, f.x)).collect();
        assert_eq!(found, [(0, 3), (1, 1), (2, 0)], "{op:?}");
        assert_eq!(converted.dropped.hidden, 1);
    }
}

#[test]
fn what_asks_for_the_same_depth_gets_it_where_all_is_recorded() {
    let mut made = Made::new();
    let mut first = testing(opaque(5), vk::CompareOp::LESS, true);
    first.state.mask = 0;
    let events = vec![
        begin(with_depth(pass(CLEAR, BLACK), 1.0)),
        draw(first),
        draw(testing(over(0), vk::CompareOp::EQUAL, false)),
    ];
    // Of pixel 1 the first draw has discarded what lies nearest.
    let records = vec![
        at(grey(5, 0, 1.0), 0.25),
        at(grey(5, 1, 1.0), 0.75),
        at(grey(0, 0, 0.5), 0.25),
        at(grey(0, 1, 0.5), 0.25),
    ];
    made.submit(events, records);
    let (trace, _) = made.converted(by(DepthRule::Order));
    assert_eq!(fragments(&trace).iter().map(|f| f.x).collect::<Vec<_>>(), [0]);
}
