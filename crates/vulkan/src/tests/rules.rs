//! Fragments of one pass: their order, their pieces, what is left out.

use super::*;
use crate::DepthRule;
use screendoor_trace::error::Error;
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{ColourFormat, ColumnId, SampleMask};

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn options() -> ConvertOptions {
    ConvertOptions { colour: ColourFormat::F32, ..ConvertOptions::default() }
}

#[test]
fn a_pass_becomes_a_trace_in_api_order() {
    let mut made = Made::new();
    // As a GPU may append them.
    let records = vec![
        Record { primitive: 2, ..grey(4, 1, 0.25) },
        grey(4, 3, 0.5),
        grey(4, 1, 0.5),
        grey(1, 0, 0.75),
        Record { instance: 1, ..grey(4, 1, 0.125) },
    ];
    let events = vec![begin(pass(CLEAR, [0.2, 0.4, 0.6001, 1.0])), draw(over(4)), draw(over(1))];
    made.submit(events, records);
    let (trace, converted) = made.converted(options());
    let header = trace.header();
    assert_eq!([header.width, header.height, header.pattern.samples()], [4, 4, 1]);
    assert_eq!(header.pattern.name, "standard-1");
    // As the target holds it.
    assert_eq!(header.background, [0.2, 0.4, 0.6]);
    assert_eq!(header.space, Space::Encoded);
    assert_eq!(header.source, "prog on a GPU, frame 0");
    let found: Vec<_> =
        fragments(&trace).iter().map(|f| (f.object, f.primitive, f.x, f.alpha)).collect();
    // By draw, instance, primitive and pixel: slots name draws, and order nothing.
    let expected =
        [(0, 0, 1, 0.5), (0, 0, 3, 0.5), (0, 1, 1, 0.25), (0, 2, 1, 0.125), (1, 3, 0, 0.75)];
    assert_eq!(found, expected);
    assert_eq!(fragments(&trace)[0].colour, [0.5; 3]);
    assert_eq!(converted.objects.len(), 2);
    assert_eq!((converted.objects[0].fragments, converted.objects[1].fragments), (4, 1));
    assert_eq!(converted.objects[1].pipeline, "pipe");
    assert_eq!(converted.warnings, Vec::<String>::new());
}

#[test]
fn submissions_come_one_after_the_other_and_slots_begin_anew() {
    let mut made = Made::new();
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(over(0))], vec![grey(0, 0, 0.25)]);
    made.submit(vec![begin(pass(LOAD, BLACK)), draw(over(0))], vec![grey(0, 0, 0.5)]);
    let (trace, _) = made.converted(options());
    let found: Vec<_> =
        fragments(&trace).iter().map(|f| (f.object, f.primitive, f.alpha)).collect();
    assert_eq!(found, [(0, 0, 0.25), (1, 1, 0.5)]);
}

#[test]
fn pieces_of_a_primitive_in_a_pixel_are_put_together() {
    let mut made = Made::with(UNORM, 4);
    let piece = |coverage, red| Record { coverage, ..record(0, 0, 1, [red, 0.0, 0.0, 0.5]) };
    let records = vec![
        piece(0b0001, 0.1),
        // What covers most gives the colour.
        piece(0b0110, 0.2),
        // It overlaps, so it is another surface of the same primitive.
        piece(0b0011, 0.3),
        Record { primitive: 1, ..piece(0b1000, 0.4) },
    ];
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(over(0))], records);
    let (trace, converted) = made.converted(options());
    let found: Vec<_> =
        fragments(&trace).iter().map(|f| (f.primitive, f.coverage.0, f.colour[0])).collect();
    assert_eq!(found, [(0, 0b0011, 0.3), (1, 0b0111, 0.2), (2, 0b1000, 0.4)]);
    assert_eq!(converted.dropped.merged, 1);
}

#[test]
fn samples_that_were_shaded_by_themselves_stay_apart() {
    let mut made = Made::with(UNORM, 4);
    made.entries.push(Entry::Pipeline(Pipeline {
        number: 2,
        per_sample: true,
        samples: 4,
        ..Pipeline::default()
    }));
    let piece = |coverage, red| Record { coverage, ..record(0, 0, 1, [red, 0.0, 0.0, 0.5]) };
    let records = vec![piece(1, 0.1), piece(2, 0.2), piece(4, 0.1)];
    let each = Draw { pipeline: 2, ..over(0) };
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(each)], records);
    let (trace, converted) = made.converted(options());
    let found: Vec<_> =
        fragments(&trace).iter().map(|f| (f.primitive, f.coverage.0, f.colour[0])).collect();
    assert_eq!(found, [(0, 5, 0.1), (0, 2, 0.2)]);
    assert_eq!(converted.dropped.merged, 1);
}

#[test]
fn coverage_is_that_of_the_target_s_samples() {
    let mut made = Made::with(UNORM, 4);
    let front = 1 << 31;
    let covering = |coverage, x| Record { coverage, ..grey(0, x, 0.5) };
    let records = vec![covering(front | 0xff, 0), covering(front | 0xf0, 1)];
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(over(0))], records);
    let (trace, converted) = made.converted(options());
    let found = fragments(&trace);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].coverage, SampleMask(15));
    assert_eq!(converted.dropped.uncovered, 1);
    assert!(converted.warnings[0].contains("1 fragment cover none"), "{:?}", converted.warnings);
}

#[test]
fn what_a_trace_cannot_have_is_refused_by_draw_and_counted() {
    use vk::BlendFactor as F;
    let mut made = Made::new();
    made.entries.push(Entry::Pipeline(Pipeline {
        number: 2,
        refused: "it has a geometry shader".into(),
        ..Pipeline::default()
    }));
    let mut red = over(2);
    red.state.mask = 1;
    let mut depth = over(3);
    depth.state.mask = 8;
    let other = Draw { pipeline: 2, ..over(4) };
    let late = Draw { refused: "it came too late".into(), ..over(5) };
    let many = Draw { pipeline: 3, ..over(6) };
    made.entries.push(Entry::Pipeline(Pipeline { number: 3, samples: 4, ..Pipeline::default() }));
    let events = vec![
        begin(pass(CLEAR, BLACK)),
        draw(blended(0, F::SRC_ALPHA, F::ONE)),
        draw(blended(1, F::SRC_ALPHA, F::ONE)),
        draw(red),
        draw(depth),
        draw(other),
        draw(late),
        draw(many),
        draw(over(7)),
    ];
    let mut records: Vec<Record> = (0..8).map(|slot| grey(slot, 0, 0.5)).collect();
    records.push(grey(1, 1, 0.5));
    made.submit(events, records);
    let (trace, converted) = made.converted(options());
    assert_eq!(trace.rows(), 1);
    let why: Vec<_> =
        converted.refused.iter().map(|r| (r.draws, r.fragments, r.why.as_str())).collect();
    let expected = [
        (2, 3, "it blends by SRC_ALPHA, ONE: it adds light"),
        (1, 1, "it came too late"),
        (1, 1, "it draws 4 samples a pixel into an image of 1"),
        (1, 1, "it has a geometry shader"),
        (1, 1, "it writes red alone"),
    ];
    assert_eq!(why, expected);
    assert_eq!(converted.dropped.depth_alone, 1);
    let said = "2 draws (3 fragments) not in the trace: it blends by SRC_ALPHA, ONE: it adds light";
    assert_eq!(converted.warnings[0], said);
}

#[test]
fn fragments_that_show_nothing_or_cannot_be_said_are_counted() {
    use vk::BlendFactor as F;
    let mut made = Made::new();
    let premultiplied = blended(1, F::ONE, F::ONE_MINUS_SRC_ALPHA);
    let mut text = blended(2, F::CONSTANT_COLOR, F::ONE_MINUS_SRC_COLOR);
    text.state.constants = [0.1, 0.2, 0.3, 1.0];
    let records = vec![
        grey(0, 0, 0.0),
        grey(0, 1, 1e-6),
        grey(1, 0, 0.0),
        record(1, 0, 1, [0.25, 0.125, 0.0, 0.5]),
        record(2, 0, 0, [0.5, 0.5, 0.5, 1.0]),
        record(2, 0, 1, [0.5, 0.25, 0.0, 1.0]),
        record(0, 0, 2, [f32::NAN, f32::INFINITY, 0.5, 0.5]),
        record(0, 0, 3, [-2.0, 2.0, 0.5, 7.0]),
    ];
    let events = vec![begin(pass(CLEAR, BLACK)), draw(over(0)), draw(premultiplied), draw(text)];
    made.submit(events, records);
    let (trace, converted) = made.converted(options());
    let found: Vec<_> = fragments(&trace).iter().map(|f| (f.colour, f.alpha)).collect();
    let expected = [
        ([0.0, 1.0, 0.5], 0.5),
        ([0.0, 1.0, 0.5], 1.0),
        ([0.5, 0.25, 0.0], 0.5),
        ([0.1, 0.2, 0.3], 0.5),
    ];
    assert_eq!(found, expected);
    let d = converted.dropped;
    assert_eq!([d.transparent, d.additive, d.coloured, d.not_finite], [2, 1, 1, 1]);
    assert_eq!(d.beyond, 0);
}

#[test]
fn floating_point_targets_keep_what_is_beyond_one() {
    let mut made = Made::with(vk::Format::R16G16B16A16_SFLOAT, 1);
    let mut begun = pass(CLEAR, [2.0, 0.0, 0.0, 1.0]);
    begun.colour.as_mut().unwrap().format = vk::Format::R16G16B16A16_SFLOAT.as_raw();
    let records = vec![
        record(0, 0, 0, [3.0, f32::INFINITY, f32::NAN, 0.5]),
        record(0, 0, 1, [1.0, 1.0, 1.0, 1.5]),
    ];
    made.submit(vec![begin(begun), draw(over(0))], records);
    let (trace, converted) = made.converted(ConvertOptions::default());
    assert_eq!(trace.header().space, Space::Linear);
    assert_eq!(trace.header().background, [2.0, 0.0, 0.0]);
    assert_eq!(fragments(&trace)[0].colour, [3.0, 65504.0, 0.0]);
    assert_eq!((converted.dropped.beyond, converted.dropped.not_finite), (1, 1));
}

#[test]
fn targets_of_whole_numbers_and_of_many_layers_are_refused() {
    let mut made = Made::with(vk::Format::R8G8B8A8_UINT, 1);
    let mut begun = pass(CLEAR, BLACK);
    begun.colour.as_mut().unwrap().format = vk::Format::R8G8B8A8_UINT.as_raw();
    made.submit(vec![begin(begun), draw(opaque(0))], vec![grey(0, 0, 1.0)]);
    let (_, converted) = made.converted(options());
    assert!(converted.refused[0].why.contains("whole numbers (R8G8B8A8_UINT)"));

    let mut made = Made::new();
    let begun = Pass { layers: 2, ..pass(CLEAR, BLACK) };
    made.submit(vec![begin(begun), draw(opaque(0))], vec![grey(0, 0, 1.0)]);
    let (trace, converted) = made.converted(options());
    assert!(converted.refused[0].why.contains("2 layers or views at once"));
    assert_eq!(trace.rows(), 0);
    assert!(converted.warnings.iter().any(|w| w.contains("no fragment of a draw")));

    let mut made = Made::with(UNORM, 32);
    made.submit(vec![begin(pass(CLEAR, BLACK)), draw(opaque(0))], vec![grey(0, 0, 1.0)]);
    assert!(made.error(options()).contains("where its 32 samples lie"));
    let mut made = Made::with(vk::Format::E5B9G9R9_UFLOAT_PACK32, 1);
    let mut begun = pass(CLEAR, BLACK);
    begun.colour.as_mut().unwrap().format = vk::Format::E5B9G9R9_UFLOAT_PACK32.as_raw();
    made.submit(vec![begin(begun), draw(opaque(0))], vec![grey(0, 0, 1.0)]);
    assert!(made.error(options()).contains("E5B9G9R9_UFLOAT_PACK32"));
}

#[test]
fn little_memory_makes_the_same_trace() {
    let mut made = Made::with(UNORM, 4);
    let mut random = 1_u32;
    let mut next = |below: u32| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) % below
    };
    let records: Vec<Record> = (0..3000)
        .map(|_| {
            // Numbers far apart, and many in one pixel.
            let wide = [0, 1, 5, 70_000, u32::MAX][next(5) as usize];
            Record {
                place: next(4) | next(4) << 16,
                slot: next(5),
                primitive: wide.wrapping_sub(next(3)),
                instance: [0, 1, 1 << 30][next(3) as usize],
                coverage: 1 + next(15),
                z: next(1000) as f32 / 1000.0,
                colour: [next(256) as f32 / 255.0, 0.5, 0.25, next(256) as f32 / 255.0],
                ..Record::default()
            }
        })
        .collect();
    // Slot 3 is refused.
    let mut events = vec![begin(with_depth(pass(CLEAR, BLACK), 1.0))];
    for slot in [2, 4, 0, 1] {
        events.push(draw(testing(over(slot), vk::CompareOp::LESS, slot == 0)));
    }
    events.push(draw(Draw { refused: "no".into(), ..over(3) }));
    made.submit(events, records);
    let captures = made.captures();
    for depth in [DepthRule::Program, DepthRule::Order] {
        let at = |memory| {
            let options = ConvertOptions { memory, depth, ..options() };
            let (trace, converted) = convert(&captures, options).unwrap();
            (trace.content().unwrap().to_string(), trace.rows(), converted.dropped)
        };
        let whole = at(1 << 20);
        assert!(whole.1 > 1000, "{whole:?}");
        for memory in [1000, 5000, 100_000] {
            assert_eq!(at(memory), whole, "{memory}");
        }
        // Pieces of one primitive in one pixel are more than fit: they come as they were recorded.
        assert!(at(48).1 > 1000);
    }
    let none = convert(&captures, ConvertOptions { memory: 47, ..options() });
    assert!(none.map(|_| ()).unwrap_err().to_string().contains("give at least 48"));
}

#[test]
fn a_program_s_samples_are_repeated() {
    let coverages = |own: u32, samples: u32| {
        let mut made = Made::with(UNORM, own);
        let covering = |coverage, x| Record { coverage, ..grey(0, x, 0.5) };
        made.submit(
            vec![begin(pass(CLEAR, BLACK)), draw(over(0))],
            vec![covering(0b0001, 0), covering(0b0101, 1)],
        );
        let options = ConvertOptions { samples: Some(samples), ..options() };
        let (trace, _) = convert(&made.captures(), options)?;
        let header = trace.header().clone();
        Ok((fragments(&trace).iter().map(|f| f.coverage.0).collect::<Vec<_>>(), header))
    };
    let (found, header) = coverages(4, 8).unwrap();
    assert_eq!(found, [0b0001_0001, 0b0101_0101]);
    let positions = &header.pattern.positions;
    assert!(positions[..4] == positions[4..] && header.pattern.prefix(4).is_ok());
    let (found, header) = coverages(1, 64).unwrap();
    assert_eq!(found, [u64::MAX; 2]);
    assert!(header.constants.contains_key(&ColumnId::Coverage), "{header:?}");
    assert_eq!(header.pattern.positions, [[0, 0]; 64]);
    let error: Error = coverages(4, 2).unwrap_err();
    assert!(error.to_string().contains("cannot hold the program's 4"), "{error}");
}
