//! What the ROPs are said to have done, against counts made by hand.

use screendoor::rop::{EventCounts, Frame, ReplayOptions, Site, StateBits};
use screendoor::trace::{ColourFormat, DepthPlane, Fragment, Header, SampleMask, Trace, Unorm32};

use crate::util::{all_variants, design, header, random_fragments, trace};

/// Three opaque fragments in one pixel of 4 samples.
fn three_fragments() -> Trace {
    let fragment = |i: u32, coverage, z| Fragment {
        x: 0,
        y: 0,
        coverage: SampleMask(coverage),
        depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
        colour: [1.0; 3],
        alpha: 1.0,
        primitive: i,
        object: 0,
        ..Fragment::default()
    };
    let fragments = [
        // Two samples of a cleared pixel.
        fragment(0, 0b0011, 100),
        // Three, one of which the first fragment holds: in front of it.
        fragment(1, 0b1110, 50),
        // All; only sample 0, at 100, lies behind it.
        fragment(2, 0b1111, 70),
    ];
    trace(&Header { colour: ColourFormat::F16, ..header(1, 1, 4) }, &fragments)
}

/// All but multiplications, which not all designs tell: `multiplications.rs` has them.
fn events(spec: &str) -> EventCounts {
    let options = ReplayOptions { count_events: true, ..ReplayOptions::default() };
    let replayed = design(spec).replay(&three_fragments(), 4, 0, &options).unwrap();
    EventCounts { multiplications: None, ..replayed.events.unwrap() }
}

/// Counts with sorts given by how many of them were of 2, 3 and 4 samples.
fn counts(
    [tested, passed, written]: [u64; 3],
    hashes: u64,
    sorts: [u64; 3],
    surfaces: u64,
    state: [u64; 2],
) -> EventCounts {
    let mut expected = EventCounts {
        fragments: 3,
        samples_tested: tested,
        samples_passed: passed,
        samples_written: written,
        hashes,
        surfaces,
        multiplications: None,
        state_bits_read: state[0],
        state_bits_written: state[1],
        ..EventCounts::default()
    };
    expected.sorts_by_length[2..5].copy_from_slice(&sorts);
    expected
}

#[test]
fn three_fragments_cost_what_they_cost() {
    // 2 + 3 + 4 samples tested, 2 + 3 + 1 passed, and all of these written: a
    // depth is 32 bits, a colour 48, a sample 80.
    let (samples, depths, writes) = ([9, 6, 6], 9 * 32, 6 * 80);
    // LK hashes for each sample that passed and sorts these; the second fragment
    // meets sample 1, which the first holds. Surface number and mask are 32 + 4
    // bits, read and written by each fragment.
    let lk = |sorts, surfaces, tracking: u64| {
        counts(samples, 6, sorts, surfaces, [depths + 3 * tracking, writes + 3 * tracking])
    };
    assert_eq!(events("lk"), lk([1, 1, 0], 1, 36));
    assert_eq!(events("lk:sort=false"), lk([0, 0, 0], 1, 36));
    // No mask; each fragment a surface.
    assert_eq!(events("lk:surfaces=every-fragment"), lk([1, 1, 0], 3, 32));
    // The last primitive beside the mask, and each fragment another primitive.
    assert_eq!(events("lk:surfaces=primitive"), lk([1, 1, 0], 2, 68));
    // A counter from 0 to 4; the third fragment meets samples behind which it lies.
    assert_eq!(events("lk:track=covered"), lk([1, 1, 0], 2, 39));
    // All covered samples are numbered, hashed for, sorted and tracked.
    let all = counts(samples, 9, [1, 1, 1], 2, [depths + 3 * 36, writes + 3 * 36]);
    assert_eq!(events("lk:compact=false"), all);
    assert_eq!(events("lk:compact=false,track=covered"), all);
    // 16 bits merge the depths: the third fragment passes everywhere, and meets the
    // second.
    let merged = counts([9, 9, 9], 9, [1, 1, 1], 2, [9 * 16 + 3 * 36, 9 * 64 + 3 * 36]);
    assert_eq!(events("lk:depth-bits=16"), merged);

    // A hash for each sample to choose from, and with strata one for their number.
    let enderton = |hashes| counts(samples, hashes, [0; 3], 0, [depths, writes]);
    assert_eq!(events("enderton"), enderton(6 + 3));
    assert_eq!(events("enderton:among=covered"), enderton(9 + 3));
    assert_eq!(events("enderton:mask=naive"), enderton(6));

    // No depth test; each fragment is kept: mask, plane, colour and alpha.
    let kept = 3 * (4 + 96 + 48 + 32);
    assert_eq!(events("exact"), counts([0, 0, 9], 0, [0; 3], 0, [0, kept]));

    // Without a z-buffer, all 9 samples are blended or summed: a colour is 48 bits;
    // colour, weight and transmittance are 80.
    let all = |bits: u64| counts([0, 0, 9], 0, [0; 3], 0, [bits, bits]);
    assert_eq!(events("blend:opaque=together"), all(9 * 48));
    assert_eq!(events("sorted-blend:opaque=together"), all(9 * 48));
    assert_eq!(events("wboit:opaque=together"), all(9 * 80));
    assert_eq!(events("wboit:opaque=together,coverage=share"), all(3 * 80));
    // 5 moments in the first pass; they and 64 bits of colour and weight in the second.
    let state = [9 * 160 + 9 * 224, 9 * 160 + 9 * 64];
    let twice = EventCounts { fragments: 6, ..counts([0, 0, 18], 0, [0; 3], 0, state) };
    assert_eq!(events("mboit:opaque=together"), twice);
    // With one, opaque fragments meet that and nothing else.
    let first = EventCounts { fragments: 6, ..counts(samples, 0, [0; 3], 0, [depths, writes]) };
    assert_eq!(events("blend"), first);
}

#[test]
fn state_per_pixel() {
    let trace = three_fragments();
    let frame = Frame::of(&trace, 4, 0).unwrap();
    for (spec, samples, extra) in [
        ("lk", 320, 36),
        ("lk:surfaces=every-fragment", 320, 32),
        ("lk:surfaces=object", 320, 68),
        ("lk:track=covered", 320, 39),
        ("lk:track=covered,compact=false", 320, 36),
        ("lk:track=covered,surfaces=every-fragment", 320, 32),
        ("lk:depth-bits=24", 288, 36),
        ("enderton", 320, 0),
        ("enderton:depth-bits=16", 256, 0),
        // Layers of a depth, a mask, a colour and an alpha beside the opaque samples.
        ("kbuffer", 320, 8 * (32 + 4 + 48 + 16)),
        ("kbuffer:coverage=share,opaque=together,layers=2", 0, 2 * (32 + 48 + 16)),
        ("mlab", 320, 8 * 100),
        ("abuffer", 320, 8 * 100 + 4),
        ("abuffer:overflow=blend", 320, 8 * 100 + 4 + 4 * 64),
        // Three sums of colour, one of alpha, a count.
        ("hybrid", 320, 8 * 100 + 5 * 16),
        // Nodes have no colour; its sum has three parts.
        ("adaptive", 320, 8 * (32 + 4 + 32) + 3 * 16),
        // Two depths, colours and alphas a sample, and where asked numbers.
        ("depth-peeling", 320, 4 * 2 * (32 + 48 + 16)),
        ("depth-peeling:ties=kept", 320, 4 * 2 * (64 + 48 + 16) + 32),
        ("slab:normalise=none", 320, 8 * 100),
        ("slab:normalise=none,opacity=discrete", 320, 8 * (32 + 4 + 48 + 16)),
        // A transmittance a sample, a colour, an alpha.
        ("slab", 320, 8 * 100 + 4 * 16 + 3 * 16 + 16),
        // Into the opaque buffer's own colours; without it, colours alone.
        ("blend", 320, 0),
        ("sorted-blend", 320, 0),
        ("blend:opaque=together", 4 * 48, 0),
        ("wboit", 320, 4 * 80),
        ("wboit:coverage=share", 320, 80),
        ("mboit", 320, 4 * (5 * 32 + 64)),
        ("mboit:moments=8,coverage=share,opaque=together", 0, 9 * 32 + 64),
        // All colours, and what stands beside them, at another width.
        ("lk:colour=8", 4 * (32 + 24), 36),
        ("kbuffer:colour=32", 4 * (32 + 96), 8 * (32 + 4 + 96 + 32)),
        ("enderton:method=depth-correction,colour=8", 4 * (32 + 24) + 4 * 32, 4 * 8 + 24 + 8),
    ] {
        let expected = StateBits { samples, extra, unbounded: false };
        assert_eq!(design(spec).state_bits(&frame).unwrap(), expected, "{spec}");
    }
    assert!(design("exact").state_bits(&frame).unwrap().unbounded);
}

#[test]
fn what_is_counted_is_what_is_explained() {
    let header = header(5, 4, 8);
    let trace = trace(&header, &random_fragments(&header, 300, 8));
    for design in all_variants() {
        let options = ReplayOptions { count_events: true, ..ReplayOptions::default() };
        let counted = design.replay(&trace, 8, 3, &options).unwrap().events.unwrap();
        let mut explained = EventCounts::default();
        for (x, y) in (0..5).flat_map(|x| (0..4).map(move |y| (x, y))) {
            let pixel = design.explain(&trace, 8, 3, Site { x, y }, &|_, _| ()).unwrap();
            explained.fragments += pixel.steps.len() as u64;
            let steps = pixel.steps.iter().map(|step| &step.record);
            for record in steps.chain(&pixel.ended) {
                explained.samples_tested += u64::from(record.samples_tested);
                explained.samples_passed += u64::from(record.samples_passed);
                explained.samples_written += u64::from(record.written.count());
                explained.hashes += u64::from(record.hashes);
                if let Some(order) = record.order.as_ref().filter(|order| order.len() > 1) {
                    explained.sorts_by_length[order.len()] += 1;
                }
                explained.layers_compared += u64::from(record.layers_compared);
                let products = u64::from(record.multiplications);
                explained.multiplications = explained.multiplications.map(|n| n + products);
                explained.surfaces += u64::from(record.surface.is_some());
                explained.state_bits_read += u64::from(record.state_bits_read);
                explained.state_bits_written += u64::from(record.state_bits_written);
            }
        }
        // A design that does not say tells of none either.
        if counted.multiplications.is_none() {
            assert_eq!(explained.multiplications.take(), Some(0), "{}", design.label());
        }
        assert_eq!(counted, explained, "{}", design.label());
    }
}
