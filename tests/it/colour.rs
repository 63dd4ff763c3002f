//! The width of stored colours: one meaning for every design, and what it costs.

use screendoor::design::{Configured, DESIGNS, Entry};
use screendoor::gpu::Threads;
use screendoor::picture::Picture;
use screendoor::rop::colour::PARAM;
use screendoor::rop::{Frame, Implementation, ReplayOptions, StateBits, replay};
use screendoor::trace::{ColourFormat, DepthPlane, Fragment, Header, SampleMask, Trace, Unorm32};

use crate::gpu::check;
use crate::util::{design, gpu, header, picture, random_fragments, trace, variants};

const WIDTHS: [u32; 3] = [8, 16, 32];

/// The designs that store colours: all but the reference.
fn entries() -> impl Iterator<Item = &'static Entry> {
    let entries =
        DESIGNS.iter().filter(|e| e.info.params.iter().any(|p| p.name == PARAM.param.name));
    assert_eq!(entries.clone().count(), DESIGNS.len() - 1);
    entries
}

/// A variant with colours of another width.
fn at_width(design: &Configured, width: u32) -> Configured {
    let label = design.label();
    let separator = if label.contains(':') { "," } else { ":" };
    self::design(&format!("{label}{separator}colour={width}"))
}

fn colours(format: ColourFormat, samples: u32) -> Header {
    Header { colour: format, background: [0.25, 0.5, 0.125], ..header(6, 5, samples) }
}

/// Random fragments, of which every eighth is opaque where asked.
fn made_up(header: &Header, seed: u32, opaque: bool) -> Trace {
    let mut fragments = random_fragments(header, 300, seed);
    for (i, fragment) in fragments.iter_mut().enumerate() {
        fragment.alpha = if opaque && i % 8 == 0 { 1.0 } else { fragment.alpha.min(0.99) };
    }
    trace(header, &fragments)
}

fn bits(picture: &Picture) -> String {
    picture.hash()
}

fn drawn(design: &Configured, trace: &Trace, implementation: Implementation) -> String {
    let options = ReplayOptions { implementation, ..ReplayOptions::default() };
    bits(&design.replay(trace, 4, 3, &options).unwrap().picture)
}

/// What a text says that a layout takes, worked out from the text alone.
fn arithmetic(text: &str) -> StateBits {
    let mut found = StateBits::default();
    let mut rest = text;
    while !rest.is_empty() && rest != "0" {
        // A group ends at a plus that no bracket encloses.
        let open = rest.find('(').filter(|open| !rest[..*open].contains(" + "));
        let end = match open {
            Some(_) => rest.find(')').unwrap() + 1,
            None => rest.find(" + ").unwrap_or(rest.len()),
        };
        let (group, after) = rest.split_at(end);
        rest = after.strip_prefix(" + ").unwrap_or(after);
        let (count, fields) = group.split_once(" × ").unwrap_or(("1", group));
        let fields = fields.trim_start_matches('(').trim_end_matches(')').split(" + ");
        let each: u32 = fields.map(|f| f.split(' ').next().unwrap().parse::<u32>().unwrap()).sum();
        match count.parse::<u32>() {
            Ok(count) => found.extra += count * each,
            Err(_) => found.unbounded = true,
        }
    }
    found
}

#[test]
fn layouts_say_what_bits_there_are() {
    for samples in [1, 2, 4, 8, 16, 32, 64] {
        for format in [ColourFormat::F16, ColourFormat::F32] {
            let header = colours(format, samples);
            let frame = Frame::of(&trace(&header, &[]), samples, 0).unwrap();
            for entry in DESIGNS {
                for design in variants(entry) {
                    // The application's order is not asked for here.
                    let primitive_depths = Some(Default::default());
                    let frame = Frame { primitive_depths, ..frame.clone() };
                    let layout = design.layout(&frame).unwrap();
                    let (said, bits) = (arithmetic(&layout.to_string()), layout.bits());
                    let label = format!("{} at {samples}: {layout}", design.label());
                    assert_eq!(said.total(), bits.total(), "{label}");
                    assert_eq!(said.unbounded, bits.unbounded, "{label}");
                    assert_eq!(bits, design.state_bits(&frame).unwrap(), "{label}");
                }
            }
        }
    }
    // Not everything passes.
    assert_ne!(arithmetic("8 × (32 depth + 48 colour) + 40 tracking").total(), 8 * 80);
    assert_eq!(arithmetic("8 × (32 depth + 48 colour) + 40 tracking").total(), 680);
}

#[test]
fn colours_are_as_wide_as_the_one_parameter_says() {
    let header = colours(ColourFormat::F16, 4);
    let frame = Frame::of(&trace(&header, &[]), 4, 0).unwrap();
    let frame = Frame { primitive_depths: Some(Default::default()), ..frame };
    for entry in entries() {
        for plain in variants(entry) {
            let default = plain.state_bits(&frame).unwrap().total();
            let mut totals = Vec::new();
            for width in WIDTHS {
                let design = at_width(&plain, width);
                let layout = design.layout(&frame).unwrap();
                let label = format!("{}: {layout}", design.label());
                let fields = layout.groups().iter().flat_map(|group| &group.fields);
                let mut colours = 0;
                for field in fields {
                    if field.what.contains("colour") {
                        assert_eq!(field.bits, 3 * width, "{label}");
                        colours += 1;
                    } else if field.what.contains("alpha") || field.what.contains("weight") {
                        assert_eq!(field.bits, width, "{label}");
                    }
                }
                assert!(colours > 0, "{label}");
                totals.push(layout.bits().total());
            }
            // Nothing else changes with it, and 16 is what this trace stores.
            assert_eq!(totals[2] - totals[1], 2 * (totals[1] - totals[0]), "{}", plain.label());
            assert_eq!(default, totals[1], "{}", plain.label());
        }
    }
}

#[test]
fn samples_of_what_the_trace_stores_change_no_bit() {
    let trace = made_up(&colours(ColourFormat::F16, 4), 1, true);
    for name in ["lk", "systematic", "enderton", "hashed-alpha", "alpha-to-coverage"] {
        let pictures: Vec<String> = ["trace", "16", "32"]
            .iter()
            .map(|w| drawn(&design(&format!("{name}:colour={w}")), &trace, Implementation::Fast))
            .collect();
        assert_eq!(pictures[0], pictures[1], "{name}");
        assert_eq!(pictures[0], pictures[2], "{name}");
        let bytes = drawn(&design(&format!("{name}:colour=8")), &trace, Implementation::Fast);
        assert_ne!(pictures[0], bytes, "{name}");
    }
}

#[test]
fn every_design_rounds_and_every_engine_alike() {
    let trace = made_up(&colours(ColourFormat::F32, 4), 2, true);
    for entry in entries() {
        for plain in variants(entry) {
            let pictures = WIDTHS.map(|width| {
                let design = at_width(&plain, width);
                let found = drawn(&design, &trace, Implementation::Reference);
                assert_eq!(
                    found,
                    drawn(&design, &trace, Implementation::Fast),
                    "{}",
                    design.label()
                );
                found
            });
            assert_ne!(pictures[0], pictures[1], "{}", plain.label());
            assert_ne!(pictures[1], pictures[2], "{}", plain.label());
            assert_eq!(
                pictures[2],
                drawn(&plain, &trace, Implementation::Fast),
                "{}",
                plain.label()
            );
        }
    }
}

/// One pixel of one sample over black: alpha, colour.
fn stacked(fragments: &[(f32, f32)]) -> Trace {
    let header = Header { background: [0.0; 3], ..header(1, 1, 1) };
    let fragment = |(i, (alpha, colour)): (usize, &(f32, f32))| Fragment {
        x: 0,
        y: 0,
        coverage: SampleMask::first(1),
        // Far to near.
        depth: DepthPlane { z: Unorm32(1000 - i as u32), dzdx: 0, dzdy: 0 },
        colour: [*colour; 3],
        alpha: *alpha,
        primitive: i as u32,
        object: 0,
        ..Fragment::default()
    };
    trace(&header, &fragments.iter().enumerate().map(fragment).collect::<Vec<_>>())
}

#[test]
fn stores_by_hand() {
    let red = |spec: &str, trace: &Trace| picture(&design(spec), trace, 1, 0).get(0, 0)[0];
    let byte = |n: u32| f64::from(n as f32 / 255.0);
    // 0.5 is 127.5 of 255 and becomes 128; half of that is 64.
    let two = stacked(&[(0.5, 1.0), (0.5, 0.0)]);
    assert_eq!(red("blend:colour=8", &two), byte(64));
    assert_eq!(red("sorted-blend:colour=8", &two), byte(64));
    assert_eq!(red("blend:colour=32", &two), 0.25);
    // A layer of colour times alpha 128, and one of 0 that lets 128 through.
    assert_eq!(red("kbuffer:colour=8", &two), byte(128) * byte(128));
    // An eleventh bit is lost at every step: 1/2 + 2^-12, then half of it.
    let fine = 1.0 + 0.000_488_281_25;
    let three = stacked(&[(0.5, fine), (0.5, 0.0)]);
    assert_eq!(red("blend:colour=32", &three), f64::from(fine) / 4.0);
    assert_eq!(red("blend:colour=16", &three), 0.25);
    assert_eq!(red("lk:colour=16", &stacked(&[(1.0, fine)])), 1.0);
    // Beyond the greatest half.
    assert_eq!(red("lk:colour=16", &stacked(&[(1.0, 1e6)])), 65504.0);
    assert_eq!(red("lk:colour=8", &stacked(&[(1.0, 1e6)])), 1.0);
}

#[test]
fn scenes_without_opaque_fragments_do_not_pay_for_them() {
    let header = colours(ColourFormat::F16, 4);
    let (without, with) = (made_up(&header, 4, false), made_up(&header, 4, true));
    assert!(!without.has_opaque().unwrap() && with.has_opaque().unwrap());
    let mut some = 0;
    for entry in entries() {
        for design in variants(entry) {
            let label = design.label();
            let options = ReplayOptions::default();
            let cheap = design.replay(&without, 4, 3, &options).unwrap();
            let dear = design.replay(&with, 4, 3, &options).unwrap();
            // The same trace, but nobody knows that nothing in it is opaque.
            let frame = Frame { opaque: true, ..design.frame(&without, 4, 3).unwrap() };
            let engine = design.build(&frame, Implementation::Fast).unwrap();
            let unknown = replay(&*engine, &frame, &without, &options).unwrap();
            assert_eq!(bits(&cheap.picture), bits(&unknown.picture), "{label}");
            assert_eq!((unknown.passes, unknown.state_bits), (dear.passes, dear.state_bits));
            if dear.layout.to_string().contains("opaque") {
                some += 1;
                assert_eq!(dear.passes, cheap.passes + 1, "{label}");
                let together = self::design(&format!(
                    "{label}{}opaque=together",
                    if label.contains(':') { "," } else { ":" }
                ));
                let together = together.replay(&without, 4, 3, &options).unwrap();
                assert_eq!(cheap.layout, together.layout, "{label}");
                assert_eq!(cheap.passes, together.passes, "{label}");
            } else {
                assert_eq!((dear.passes, dear.layout), (cheap.passes, cheap.layout), "{label}");
            }
        }
    }
    assert!(some > 30, "{some}");
    // Four samples of a depth and a colour.
    let kbuffer = design("kbuffer");
    let bits = |trace| kbuffer.replay(trace, 4, 0, &ReplayOptions::default()).unwrap().state_bits;
    assert_eq!(bits(&with).total() - bits(&without).total(), 4 * (32 + 48));
}

#[test]
fn a_single_opaque_fragment_is_found_wherever_it_is() {
    let header = colours(ColourFormat::F16, 4);
    let mut fragments = random_fragments(&header, 200, 9);
    fragments.iter_mut().for_each(|f| f.alpha = f.alpha.min(0.999));
    assert!(!trace(&header, &fragments).has_opaque().unwrap());
    for place in [0, 77, 199] {
        let mut fragments = fragments.clone();
        fragments[place].alpha = 1.0;
        assert!(trace(&header, &fragments).has_opaque().unwrap());
    }
    assert!(!trace(&header, &[]).has_opaque().unwrap());
    for (alpha, opaque) in [(1.0, true), (0.5, false)] {
        fragments.iter_mut().for_each(|f| f.alpha = alpha);
        assert_eq!(trace(&header, &fragments).has_opaque().unwrap(), opaque);
    }
}

#[test]
fn gpus_round_as_the_plain_text_does() {
    let Some(gpu) = gpu() else { return };
    for (i, spec) in [
        "lk:colour=8",
        "lk:colour=16",
        "lk:rounds=4,colour=8",
        "enderton:method=alpha-correction,colour=16",
        "systematic:method=depth-correction,colour=16",
        "systematic:method=depth-correction,opaque=together,colour=8",
    ]
    .iter()
    .enumerate()
    {
        check(gpu, &design(spec), 8, i as u32, Threads::Pixel);
    }
}
