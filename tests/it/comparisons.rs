//! Comparisons of layers against counts made by hand, and events as the replay passes
//! them on against those that a design tells.

use std::collections::BTreeMap;

use screendoor::design::{self as designs, Configured, DESIGNS};
use screendoor::rop::layers::LAYERS;
use screendoor::rop::{
    Blueprint, Design, Event, EventCounts, Frame, Implementation, Listen, Probe, ReplayOptions,
    Site,
};
use screendoor::trace::{DepthPlane, Fragment, SampleMask, Trace, Unorm32};

use crate::util::{design, header, random_fragments, trace, variants};

fn fragment(depth: u32, coverage: u64, alpha: f32) -> Fragment {
    Fragment {
        x: 0,
        y: 0,
        coverage: SampleMask(coverage),
        depth: DepthPlane { z: Unorm32(depth), dzdx: 0, dzdy: 0 },
        colour: [1.0; 3],
        alpha,
        primitive: depth,
        object: 0,
        ..Fragment::default()
    }
}

/// A trace of one pixel of 4 samples.
fn pixel(fragments: &[Fragment]) -> Trace {
    trace(&header(1, 1, 4), fragments)
}

/// The counts of a design, and the same for each of its engines.
fn events(spec: &str, trace: &Trace) -> EventCounts {
    let count = |implementation| {
        let options =
            ReplayOptions { count_events: true, implementation, ..ReplayOptions::default() };
        design(spec).replay(trace, trace.header().pattern.samples(), 0, &options).unwrap().events
    };
    let plain = count(Implementation::Reference);
    assert_eq!(plain, count(Implementation::Fast), "{spec}");
    plain.unwrap()
}

#[test]
fn layers_are_compared_as_often_as_by_hand() {
    // Half-transparent, the last over two samples. Two layers hold 30; 10 30; 10 20, for
    // 30 falls out; the same, for 40 lies behind both; 5 10.
    let depths = [30, 10, 20, 40].map(|depth| fragment(depth, 0b1111, 0.5));
    let five = pixel(&[&depths[..], &[fragment(5, 0b0110, 0.5)]].concat());
    // The place of a fragment among 0, 1, 2, 2 and 2 layers.
    const INSERTED: u64 = 1 + 2 + 2 + 2;
    for (spec, compared) in [
        ("kbuffer:layers=2", INSERTED),
        ("kbuffer:layers=2,coverage=share", INSERTED),
        ("mlab:layers=2", INSERTED),
        ("hybrid:layers=2", INSERTED),
        // 0, 1, 2, 3, 4.
        ("kbuffer:layers=8", 10),
        ("mlab:layers=1", 4),
        // The one that lies behind both is held against both too.
        ("slab:layers=2,bits=0,normalise=none", INSERTED),
        // A second pass that only multiplies alphas, and one that asks how much of each of
        // the five is seen behind two layers.
        ("slab:layers=2,bits=0,normalise=alpha", INSERTED),
        ("slab:layers=2,bits=0,normalise=both", INSERTED + 5 * 2),
        // As that; of three nodes the second is always the one that goes.
        ("adaptive:layers=2", INSERTED + 5 * 2),
        // Among 0, 1, 2, 3, 3 nodes; twice the lesser of two areas; 3 nodes for each.
        ("adaptive:layers=3", 1 + 2 + 3 + 3 + 2 + 5 * 3),
        // Among 0 to 4, and there is room for all.
        ("adaptive:layers=5", 10 + 5 * 5),
        // Sorted at the end: 2, 3 and 5 layers by 1, 3 and 9 comparators.
        ("abuffer:layers=2", 1),
        ("abuffer:layers=3", 3),
        ("abuffer:layers=8", 9),
        ("abuffer:layers=2,overflow=blend", 1),
        // The greater of two depths, and the fragment against that, three times.
        ("abuffer:layers=2,overflow=furthest", 3 * 2 + 1),
        // Two tests a sample in each of two passes.
        ("depth-peeling:layers=2", 2 * 2 * (4 * 4 + 2)),
        ("depth-peeling:layers=2,ties=kept", 2 * 2 * (4 * 4 + 2)),
        ("blend", 0),
        ("wboit", 0),
        ("mboit", 0),
    ] {
        let separator = if spec.contains(':') { "," } else { ":" };
        let together = format!("{spec}{separator}opaque=together");
        let found = events(&together, &five);
        assert_eq!(found.layers_compared, compared, "{together}");
        assert_eq!((found.comparators(), found.samples_tested), (compared, 0), "{together}");
    }
}

#[test]
fn fragments_that_do_not_enter_are_compared_too() {
    // With one bit, nothing is seen behind what is opaque: 40 is held against 30 and does
    // not enter; 10 does; 20 is held against 10 and 30, and 50 lies behind the last.
    let alphas = [(30, 1.0), (40, 0.5), (10, 1.0), (20, 0.5), (50, 1.0)];
    let five = pixel(&alphas.map(|(depth, alpha)| fragment(depth, 0b1111, alpha)));
    let spec = "slab:layers=2,bits=1,normalise=none,opaque=together";
    let found = events(spec, &five);
    assert_eq!(found.layers_compared, 1 + 1 + 2 + 2);
    // 30 and 10 were written.
    assert_eq!(found.samples_written, 2 * 4);
    let discrete = format!("{spec},opacity=discrete");
    assert_eq!(events(&discrete, &five).layers_compared, 1 + 1 + 2 + 2);
}

#[test]
fn depth_tests_and_layers_are_comparators() {
    // An opaque fragment over two samples at 25. Of the others 30 and 40 meet it there;
    // 10, 20 and 5 come before it.
    let depths = [30, 10, 20, 40, 5].map(|depth| fragment(depth, 0b0011, 0.5));
    let six = pixel(&[&depths[..], &[fragment(25, 0b0011, 1.0)]].concat());
    let found = events("kbuffer:layers=2", &six);
    assert_eq!((found.samples_tested, found.samples_passed), (6 * 2, 4 * 2));
    assert_eq!((found.layers_compared, found.comparators()), (1 + 2, 6 * 2 + 1 + 2));
}

#[test]
fn a_buffer_without_bound_costs_what_a_k_buffer_costs() {
    let header = header(3, 2, 4);
    let trace = trace(&header, &random_fragments(&header, 200, 5));
    let slab = events("slab:bits=0,normalise=none,layers=3", &trace);
    // It does not say what it multiplies.
    let kbuffer = EventCounts { multiplications: None, ..events("kbuffer:layers=3", &trace) };
    assert_eq!(slab, kbuffer);
    assert!(slab.layers_compared > 0);
}

/// Counts by itself.
#[derive(Clone, Default)]
struct Direct {
    counts: EventCounts,
    /// The defect that the replay once had.
    deaf: bool,
}

impl Listen for Direct {
    fn event(&mut self, event: Event<'_>) {
        let counts = &mut self.counts;
        let count = |mask: SampleMask| u64::from(mask.count());
        match event {
            Event::Fragment(_) => counts.fragments += 1,
            Event::DepthTest { tested, passed } => {
                counts.samples_tested += count(tested);
                counts.samples_passed += count(passed);
            }
            Event::Surface(_) => counts.surfaces += 1,
            Event::Sorted(order) if order.len() > 1 => counts.sorts_by_length[order.len()] += 1,
            Event::Sorted(_) | Event::Reference { .. } => {}
            Event::Hashed(hashes) => counts.hashes += u64::from(hashes),
            Event::Written(samples) => counts.samples_written += count(samples),
            Event::Compared(_) if self.deaf => {}
            Event::Compared(layers) => counts.layers_compared += u64::from(layers),
            Event::Multiplied(products) => {
                counts.multiplications = counts.multiplications.map(|n| n + u64::from(products));
            }
            Event::State { read, written } => {
                counts.state_bits_read += u64::from(read);
                counts.state_bits_written += u64::from(written);
            }
            Event::Remark(_) => {}
        }
    }
}

/// What a design tells that is called directly.
fn told<B: Blueprint>(design: &Configured, trace: &Trace, deaf: bool) -> EventCounts {
    let frame: Frame = design.frame(trace, 4, 3).unwrap();
    let at = B::at::<4>(design.values(), &frame).unwrap();
    let mut pixels = BTreeMap::new();
    let mut direct = Direct { deaf, ..Direct::default() };
    for pass in 0..at.passes() {
        for batch in trace.batches() {
            let batch = batch.unwrap();
            for fragment in (0..batch.len()).map(|i| batch.fragment(i)) {
                let site = Site { x: fragment.x, y: fragment.y };
                let pixel = pixels.entry((site.x, site.y)).or_insert_with(|| at.clear(site));
                direct.fragment(fragment.coverage);
                at.draw(pass, site, pixel, &fragment, &mut direct);
            }
        }
        for ((x, y), pixel) in &mut pixels {
            at.end_pass(pass, Site { x: *x, y: *y }, pixel, &mut direct);
        }
    }
    let mut counts = direct.counts;
    counts.multiplications = counts.multiplications.filter(|_| B::MULTIPLICATIONS);
    counts
}

type Told = fn(&Configured, &Trace, bool) -> EventCounts;

/// Every design of the registry, by its type.
const TOLD: &[(&str, Told)] = &[
    ("exact", told::<designs::Exact>),
    ("lk", told::<designs::LaineKarras>),
    ("systematic", told::<designs::Systematic>),
    ("residual", told::<designs::Residual>),
    ("enderton", told::<designs::Enderton>),
    ("hashed-alpha", told::<designs::HashedAlpha>),
    ("alpha-to-coverage", told::<designs::AlphaToCoverage>),
    ("slab", told::<designs::Slab>),
    ("kbuffer", told::<designs::KBuffer>),
    ("abuffer", told::<designs::ABuffer>),
    ("mlab", told::<designs::Mlab>),
    ("merging", told::<designs::Merging>),
    ("hybrid", told::<designs::Hybrid>),
    ("adaptive", told::<designs::Adaptive>),
    ("depth-peeling", told::<designs::DepthPeeling>),
    ("blend", told::<designs::Blend>),
    ("sorted-blend", told::<designs::SortedBlend>),
    ("wboit", told::<designs::WeightedBlended>),
    ("mboit", told::<designs::MomentBased>),
];

#[test]
fn the_replay_passes_on_what_designs_tell() {
    let header = header(3, 2, 4);
    let mut fragments = random_fragments(&header, 150, 11);
    for fragment in fragments.iter_mut().step_by(9) {
        fragment.alpha = 1.0;
    }
    let trace = trace(&header, &fragments);
    let names: Vec<&str> = TOLD.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, DESIGNS.iter().map(|entry| entry.info.name).collect::<Vec<_>>());
    for (entry, (_, told)) in DESIGNS.iter().zip(TOLD) {
        for design in variants(entry) {
            let label = design.label();
            let direct = told(&design, &trace, false);
            for implementation in [Implementation::Reference, Implementation::Fast] {
                let options = ReplayOptions {
                    count_events: true,
                    implementation,
                    ..ReplayOptions::default()
                };
                let counted = design.replay(&trace, 4, 3, &options).unwrap().events.unwrap();
                assert_eq!(counted, direct, "{label}");
            }
            // Whoever keeps more than one layer compares, and a listener that does not
            // hear of it counts something else.
            let layered = entry.info.params.iter().any(|p| p.name == "layers");
            if layered && design.values().get(LAYERS) > 1 {
                assert!(direct.layers_compared > 0, "{label}");
                assert_ne!(told(&design, &trace, true), direct, "{label}");
            }
        }
    }
}
