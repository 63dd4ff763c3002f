//! What every design must do, whatever it is: the suite runs over the registry.

use std::sync::Mutex;

use screendoor::design::Configured;
use screendoor::metrics::{Errors, ROUNDING, Region, errors};
use screendoor::random::Stream;
use screendoor::rop::{Family, OpaquePromise, OrderPromise, Promise, ReplayOptions, Site};
use screendoor::trace::{Fragment, SampleMask, Trace, Unorm32, WriteOptions, tied_fragments};

use crate::util::{
    AWKWARD, all_variants, design, header, in_sequence_at_equal_depths, layered, nearly_bare,
    not_bare, picture, random_fragments, trace, trace_bytes,
};

fn rmse(a: &screendoor::picture::Picture, b: &screendoor::picture::Picture) -> f64 {
    errors(a, b, &Region::frame(a.grid())).rmse
}

#[test]
fn threads_windows_and_batches_change_no_bit() {
    for samples in [1, 8, 64] {
        let header = header(83, 41, samples);
        let fragments = random_fragments(&header, 6000, samples);
        let whole = trace(&header, &fragments);
        let options = WriteOptions { batch_rows: 61, ..WriteOptions::default() };
        let cut = trace_bytes(&header, &fragments, options);
        let cut = Trace::from_bytes(cut, "cut").unwrap();
        for design in all_variants() {
            let expected = picture(&design, &whole, samples, 3).hash();
            for threads in [1, 2, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                for (trace, window) in [(&whole, 1 << 20), (&whole, 97), (&cut, 1000), (&cut, 1)] {
                    if window == 1 && (threads != 2 || samples != 8) {
                        continue;
                    }
                    let options = ReplayOptions { window, ..ReplayOptions::default() };
                    let replayed =
                        pool.install(|| design.replay(trace, samples, 3, &options)).unwrap();
                    assert_eq!(
                        replayed.picture.hash(),
                        expected,
                        "{}: {threads} threads, windows of {window}",
                        design.label()
                    );
                }
            }
        }
    }
}

#[test]
fn a_memory_limit_changes_no_bit() {
    let header = header(50, 50, 4);
    let mut fragments = random_fragments(&header, 5000, 2);
    // One tile, and within it one pixel, that holds much.
    let crowd = fragments[..2000].to_vec();
    fragments.extend(crowd.into_iter().enumerate().map(|(i, f)| Fragment {
        x: (i % 8) as u16,
        y: if i % 4 == 0 { 3 } else { 0 },
        ..f
    }));
    let trace = trace(&header, &fragments);
    for design in all_variants() {
        let expected = picture(&design, &trace, 4, 0).hash();
        for memory in [1 << 30, 300_000, 60_000, 40_000] {
            let options = ReplayOptions { memory, ..ReplayOptions::default() };
            let replayed = design.replay(&trace, 4, 0, &options).unwrap();
            assert_eq!(replayed.picture.hash(), expected, "{} in {memory}", design.label());
        }
    }
    // Where one pixel alone is too much, the error names it.
    let options = ReplayOptions { memory: 8000, ..ReplayOptions::default() };
    let error = design("exact").replay(&trace, 4, 0, &options).unwrap_err().to_string();
    assert!(error.contains("pixel") && error.contains("--memory"), "{error}");
}

#[test]
fn an_empty_trace_shows_the_background() {
    let mut header = header(20, 20, 8);
    header.background = [0.25, 0.5, 0.75];
    let trace = trace(&header, &[]);
    for design in all_variants() {
        let picture = picture(&design, &trace, 8, 0);
        assert_eq!(picture.get(19, 19), [0.25, 0.5, 0.75], "{}", design.label());
    }
}

#[test]
fn what_nothing_covers_is_the_background_bit_for_bit_whether_its_tile_is_touched_or_not() {
    for samples in [1, 2, 4, 8, 16, 32, 64] {
        for (i, value) in AWKWARD.into_iter().enumerate() {
            let background = [value, AWKWARD[(i + 1) % AWKWARD.len()], 0.0];
            let trace = nearly_bare(samples, background);
            for design in all_variants() {
                let wrong = not_bare(&picture(&design, &trace, samples, 1), background);
                let label = design.label();
                assert!(wrong.is_empty(), "{label} at {samples}, {background:?}: {wrong:?}");
            }
        }
    }
    // The check can fail: the covered pixels are another colour.
    let trace = nearly_bare(8, [0.1; 3]);
    assert!(!not_bare(&picture(&design("exact"), &trace, 8, 1), [0.2; 3]).is_empty());
}

#[test]
fn opaque_fragments_give_the_exact_picture() {
    // Whether pieces, and whether whole pixels, gave another picture.
    let mut broken = vec![[false; 2]; all_variants().len()];
    for samples in [1, 2, 4, 8, 16, 32, 64] {
        let mut header = header(40, 40, samples);
        header.background = [0.5, 0.25, 0.125];
        // Whole pixels and pieces, many at equal depths; in the upper left, more pieces
        // than anyone keeps.
        for whole in [true, false] {
            let mut fragments = random_fragments(&header, 4000, samples);
            fragments[..1000].iter_mut().for_each(|f| (f.x, f.y) = (f.x % 3, f.y % 3));
            for (i, f) in fragments.iter_mut().enumerate() {
                f.alpha = 1.0;
                // Sums of few bits, exact in any precision; depths that 16 bits tell apart.
                f.colour = f.colour.map(|c| (c * 64.0).floor() / 64.0);
                f.depth.z = Unorm32((i as u32).wrapping_mul(40503) << 16);
                (f.depth.dzdx, f.depth.dzdy) = (0, 0);
                // Primitives that no single depth describes.
                f.primitive = i as u32 % 100;
                if whole {
                    f.coverage = SampleMask::first(samples);
                }
                if i % 2 == 0 {
                    f.depth.z = Unorm32(1 << 31);
                }
            }
            let trace = trace(&header, &fragments);
            let exact = picture(&design("exact"), &trace, samples, 0);
            for (design, broken) in all_variants().iter().zip(&mut broken) {
                let same = picture(design, &trace, samples, 9).hash() == exact.hash();
                let promised = match design.promises().exact_opaque {
                    OpaquePromise::Always => true,
                    OpaquePromise::WholePixels => whole,
                    OpaquePromise::Never => false,
                };
                assert!(same || !promised, "{} at {samples}, whole: {whole}", design.label());
                broken[usize::from(whole)] |= !same;
            }
        }
    }
    let mut wrong = Vec::new();
    for (design, broken) in all_variants().iter().zip(broken) {
        let found = match broken {
            [false, false] => OpaquePromise::Always,
            [_, false] => OpaquePromise::WholePixels,
            [_, true] => OpaquePromise::Never,
        };
        if found != design.promises().exact_opaque {
            wrong.push(format!("{} is exact {found:?}", design.label()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn alpha_0_leaves_nothing_and_one_fragment_is_right_on_average() {
    let header = header(64, 64, 8);
    let invisible = trace(&header, &layered(&header, 3, |i| (i, [1.0; 3], 0.0)));
    let single = trace(&header, &layered(&header, 1, |_| (5, [1.0; 3], 0.3)));
    for design in all_variants() {
        assert_eq!(picture(&design, &invisible, 8, 0).get(7, 7), [0.0; 3], "{}", design.label());
        // A power of the random number is another alpha: that is what it is there to show.
        if design.label().contains("power=") {
            continue;
        }
        let limit = match (design.promises().seeded, design.info().family) {
            // 64 × 64 pixels: the mean's deviation is below 0.0072 even where a pixel's
            // samples are decided together; six of them.
            (true, _) => 0.043,
            // Half a sample.
            (false, Family::Stochastic) => 0.5 / 8.0,
            (false, _) => ROUNDING / 255.0,
        };
        let exact = picture(&self::design("exact"), &single, 8, 0);
        let picture = picture(&design, &single, 8, 0);
        let mean = errors(&picture, &exact, &Region::frame(picture.grid())).mean;
        assert!(mean.abs() <= limit * 255.0, "{}: {mean}", design.label());
    }
}

#[test]
fn of_64_equal_depths_the_last_opaque_one_lies_in_front() {
    // Where opaque fragments are promised to be drawn as they are.
    let header = header(8, 8, 16);
    let fragments = layered(&header, 64, |i| (77, [i as f32 / 64.0; 3], 1.0));
    let trace = trace(&header, &fragments);
    let exact = |d: &Configured| d.promises().exact_opaque != OpaquePromise::Never;
    for design in all_variants().iter().filter(|d| exact(d)) {
        let picture = picture(design, &trace, 16, 0);
        assert_eq!(picture.get(3, 3), [63.0 / 64.0; 3], "{}", design.label());
    }
}

#[test]
fn thousands_of_layers_in_one_pixel() {
    let header = header(4, 4, 8);
    let mut random = Stream::new([4]);
    let fragments = layered(&header, 5000, |_| (0, [0.0; 3], 0.01));
    let fragments: Vec<Fragment> = fragments
        .into_iter()
        .map(|mut f| {
            f.depth.z = Unorm32(random.word());
            f.colour = [random.unit(); 3];
            f
        })
        .collect();
    let trace = trace(&header, &fragments);
    let exact = picture(&design("exact"), &trace, 8, 0);
    for design in all_variants().iter().filter(|d| d.promises().unbiased == Promise::Always) {
        // The mean of 16 pixels and 8 seeds: a spread of 0.29/√128 even where a pixel's
        // samples are decided together; 6σ.
        let mean = (0..8)
            .map(|seed| picture(design, &trace, 8, seed))
            .map(|p| errors(&p, &exact, &Region::frame(p.grid())).mean / 255.0 / 8.0)
            .sum::<f64>();
        assert!(mean.abs() < 0.155, "{}: {mean}", design.label());
    }
}

/// Random fragments at distinct depths so close that fewer than 32 bits merge them.
fn distinct_depths(samples: u32) -> (screendoor::trace::Header, Vec<Fragment>) {
    let header = header(16, 16, samples);
    let mut fragments = random_fragments(&header, 3000, 12);
    for (i, f) in fragments.iter_mut().enumerate() {
        // 3001 is prime: no depth comes twice.
        f.depth.z = Unorm32(i as u32 * 1103 % 3001);
        (f.depth.dzdx, f.depth.dzdy) = (0, 0);
    }
    (header, fragments)
}

/// Distinct depths in few pixels, most so faint that more layers can be seen than
/// anyone keeps, and a few that hide what lies behind them.
fn crowded_depths(samples: u32) -> (screendoor::trace::Header, Vec<Fragment>) {
    let (_, mut fragments) = distinct_depths(samples);
    for (i, f) in fragments.iter_mut().enumerate() {
        (f.x, f.y) = (f.x % 4, f.y % 4);
        f.depth.z.0 <<= 20;
        if i % 16 == 0 {
            f.coverage = SampleMask::first(samples);
        } else {
            f.alpha *= 0.1;
        }
    }
    (header(4, 4, samples), fragments)
}

#[test]
fn order_changes_the_picture_only_where_that_is_not_ruled_out() {
    let (header, close) = distinct_depths(8);
    // The whole range of depths, and primitives that come to a pixel several times.
    let mut wide = close.clone();
    for f in &mut wide {
        f.depth.z.0 <<= 20;
        f.primitive %= 40;
    }
    // Two to a pixel: two terms of a sum are rounded alike in either order.
    let mut seen = std::collections::HashMap::new();
    let mut pairs = wide.clone();
    pairs.retain(|f| {
        let count = seen.entry((f.x, f.y)).or_insert(0);
        *count += 1;
        *count <= 2
    });
    let (small, crowded) = crowded_depths(8);
    // Few depths far apart, which several fragments of a pixel share.
    let mut tied = close.clone();
    for (i, f) in tied.iter_mut().enumerate() {
        f.depth.z = Unorm32((i as u32 * 5 % 7 + 1) << 28);
    }
    let orders = [
        (header.clone(), pairs),
        (header.clone(), wide),
        (header.clone(), close),
        (small, crowded),
        (header, tied),
    ];
    let orders = orders.map(|(header, fragments)| {
        let mut shuffled = fragments.clone();
        Stream::new([99]).shuffle(&mut shuffled);
        let shuffled = in_sequence_at_equal_depths(&fragments, shuffled);
        [trace(&header, &fragments), trace(&header, &shuffled)]
    });
    let tied = orders.each_ref().map(|[trace, _]| tied_fragments(trace, 8).unwrap() > 0);
    assert_eq!(tied, [false, false, false, false, true]);
    let mut wrong = Vec::new();
    for design in all_variants() {
        let changes = orders.each_ref().map(|traces| {
            let [a, b] = traces.each_ref().map(|trace| picture(&design, trace, 8, 1));
            (a.hash() != b.hash()).then(|| errors(&a, &b, &Region::frame(a.grid())))
        });
        let slight = |e: &Option<Errors>| e.as_ref().is_none_or(|e| e.max < ROUNDING);
        let found = match &changes {
            [None, None, None, None, None] => OrderPromise::Independent,
            _ if changes.iter().all(slight) => OrderPromise::UpToRounding,
            // A quarter of an 8-bit step, where depths lie apart.
            [None, Some(wide), _, crowded, tied]
                if wide.rmse < 0.25
                    && [crowded, tied].iter().all(|e| e.as_ref().is_none_or(|e| e.rmse < 0.25)) =>
            {
                OrderPromise::AmplifiedRounding
            }
            _ => OrderPromise::Dependent,
        };
        if found != design.promises().order {
            wrong.push(format!("{} is {found:?}: {changes:?}", design.label()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn more_samples_come_nearer_where_that_is_promised_and_only_there() {
    let header = header(24, 24, 64);
    // So close that a narrow depth buffer merges them.
    let coherent = layered(&header, 8, |i| (i, [(i % 3) as f32 / 2.0; 3], 0.3));
    let mut random = random_fragments(&header, 24 * 24 * 8, 31);
    for f in &mut random {
        f.coverage = SampleMask(u64::MAX);
    }
    // More layers than anyone keeps or merges well, of one object.
    let mut deep = layered(&header, 100, |i| (i * 37 % 100, [(i % 7) as f32 / 6.0; 3], 0.05));
    deep.iter_mut().for_each(|f| f.object = 0);
    // Far to near, so that every sample passes every depth test.
    let backwards = layered(&header, 4, |i| ((4 - i) << 20, [(i % 2) as f32; 3], 0.4));
    // The same as at random, covering some of the samples.
    let mut pieces = random.clone();
    let some = random_fragments(&header, pieces.len(), 32);
    for (f, other) in pieces.iter_mut().zip(&some) {
        f.coverage = SampleMask(other.coverage.0 | 3);
    }
    // All at one depth; and few depths, which such pieces share.
    let equal = layered(&header, 4, |i| (1 << 31, [(i % 2) as f32; 3], 0.4));
    let mut shared = pieces.clone();
    for f in &mut shared {
        f.depth.z.0 = f.depth.z.0 >> 30 << 30 | 1;
        (f.depth.dzdx, f.depth.dzdy) = (0, 0);
        // Opaque ones before and behind transparent ones of the same depth.
        if f.primitive.is_multiple_of(8) {
            f.alpha = 1.0;
        }
    }
    let traces = [&coherent, &random, &deep, &backwards, &pieces, &equal, &shared]
        .map(|fragments| trace(&header, fragments));
    let tied = traces.each_ref().map(|trace| tied_fragments(trace, 64).unwrap() > 0);
    assert_eq!(tied, [false, false, false, false, false, true, true]);
    // Errors with two samples, each on its own.
    let independent = traces.each_ref().map(|trace| {
        let exact = picture(&design("exact"), trace, 2, 0);
        rmse(&picture(&design("enderton:mask=naive"), trace, 2, 5), &exact)
    });
    // A quarter of an 8-bit step.
    const NEARLY_EXACT: f64 = 0.25;
    let mut wrong = Vec::new();
    for design in all_variants() {
        let gains = traces.each_ref().map(|trace| {
            let error = |samples| {
                let exact = picture(&self::design("exact"), trace, samples, 0);
                rmse(&picture(&design, trace, samples, 5), &exact)
            };
            // From 2 to 64 samples independent sampling gains √32 = 5.7.
            (error(2), error(64))
        });
        // What holds where so much is gained on every trace, or on every one without ties: over
        // its own error or, where that is asked for, over that of independent samples. There is
        // nothing to gain for what is nearly exact.
        let held = |least: f64, independent: &[f64; 7], nothing: f64| {
            let gained = |i: usize| {
                let (few, many) = gains[i];
                many * least <= few.max(independent[i]) || many < nothing
            };
            match std::array::from_fn(gained) {
                [true, true, true, true, true, true, true] => Promise::Always,
                [true, true, true, true, true, ..] => Promise::DistinctDepths,
                _ => Promise::Never,
            }
        };
        // One seed each: what gains 3.5 may be consistent, and what gains 5 must be called so.
        let (most, least) = (held(3.5, &independent, NEARLY_EXACT), held(5.0, &[0.0; 7], ROUNDING));
        if !(least..=most).contains(&design.promises().consistent) {
            let name = design.label();
            wrong.push(format!("{name} is consistent {least:?} to {most:?}: {gains:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn counts_add_up_and_counting_changes_nothing() {
    let header = header(40, 40, 16);
    let fragments = random_fragments(&header, 5000, 21);
    let trace = trace(&header, &fragments);
    for samples in [4, 16] {
        let mask = SampleMask::first(samples);
        let covered: Vec<u32> =
            fragments.iter().map(|f| (f.coverage & mask).count()).filter(|n| *n > 0).collect();
        for design in all_variants() {
            let options = ReplayOptions { count_events: true, ..ReplayOptions::default() };
            let counted = design.replay(&trace, samples, 3, &options).unwrap();
            assert_eq!(counted.picture.hash(), picture(&design, &trace, samples, 3).hash());
            let events = counted.events.unwrap();
            let label = design.label();
            let passes = u64::from(counted.passes);
            assert_eq!(events.fragments, covered.len() as u64 * passes, "{label}");
            let tested = covered.iter().map(|n| u64::from(*n)).sum::<u64>() * passes;
            if passes == 1 {
                // Who has no depth test must not claim any.
                assert!([0, tested].contains(&events.samples_tested), "{label}");
            }
            assert!(events.samples_passed <= events.samples_tested, "{label}");
            assert!(events.samples_written <= tested, "{label}");
            assert!(events.samples_written > 0 && events.state_bits_written > 0, "{label}");
        }
    }
}

#[test]
fn explaining_a_pixel_tells_how_its_colour_came_about() {
    let header = header(20, 20, 8);
    let trace = trace(&header, &random_fragments(&header, 4000, 6));
    for design in all_variants() {
        let whole = picture(&design, &trace, 8, 2);
        for (x, y) in [(0, 0), (7, 13), (19, 19)] {
            let calls = Mutex::new(0);
            let explanation = design
                .explain(&trace, 8, 2, Site { x, y }, &|_, _| *calls.lock().unwrap() += 1)
                .unwrap();
            let expected = whole.get(x.into(), y.into());
            assert_eq!(explanation.colour, expected, "{}", design.label());
            assert!(!explanation.steps.is_empty() && *calls.lock().unwrap() > 0);
            assert!(explanation.steps.iter().any(|s| !s.record.written.is_empty()));
            for step in &explanation.steps {
                assert_eq!((step.fragment.x, step.fragment.y), (x, y));
                let record = &step.record;
                assert_eq!(record.covered, step.fragment.coverage);
                let passed = record.passed.unwrap_or(record.covered);
                assert_eq!(record.written & passed, record.written, "{}", design.label());
            }
        }
        let outside = Site { x: 20, y: 0 };
        let error = design.explain(&trace, 8, 2, outside, &|_, _| ()).unwrap_err().to_string();
        assert!(error.contains("outside the frame"), "{error}");
    }
}

#[test]
fn seeds_name_pictures() {
    let header = header(20, 20, 8);
    let mut fragments = random_fragments(&header, 3000, 6);
    // More layers in one pixel than anyone keeps.
    fragments[..200].iter_mut().for_each(|f| (f.x, f.y) = (3, 3));
    let trace = trace(&header, &fragments);
    for design in all_variants() {
        let hash = |seed| picture(&design, &trace, 8, seed).hash();
        assert_eq!(hash(4), hash(4));
        assert_eq!(hash(4) != hash(5), design.promises().seeded, "{}", design.label());
    }
}

#[test]
fn labels_name_designs() {
    let labels: Vec<String> = all_variants().iter().map(Configured::label).collect();
    for label in &labels {
        assert_eq!(&design(label).label(), label);
    }
}
