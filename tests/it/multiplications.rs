//! Multiplications that designs tell of, against counts made by hand.

use screendoor::rop::ReplayOptions;
use screendoor::trace::{DepthPlane, Fragment, SampleMask, Trace, Unorm32};

use crate::util::{design, header, random_fragments, trace};

/// In one pixel of 4 samples: a fragment at 100, one before three of its samples, and one at 90
/// between the two. All are opaque, so that chance has no part in who holds what.
fn three() -> Trace {
    let fragment = |i: u32, coverage, z| Fragment {
        coverage: SampleMask(coverage),
        depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
        colour: [1.0; 3],
        alpha: 1.0,
        primitive: i,
        ..Fragment::default()
    };
    let all = [fragment(0, 0b1111, 100), fragment(1, 0b1110, 50), fragment(2, 0b1111, 90)];
    trace(&header(1, 1, 4), &all)
}

fn products(spec: &str, trace: &Trace) -> Option<u64> {
    let options = ReplayOptions { count_events: true, ..ReplayOptions::default() };
    design(spec).replay(trace, 4, 0, &options).unwrap().events.unwrap().multiplications
}

#[test]
fn three_fragments_by_hand() {
    // Of the errors' four sums each is multiplied once.
    let sums = 4;
    for (spec, count) in [
        // Who may write is found by comparing and counting.
        ("lk", 0),
        ("lk:compact=false", 0),
        ("systematic", 0),
        ("enderton", 0),
        ("alpha-to-coverage", 0),
        // Each of 4 + 3 + 4 samples has its transmittance.
        ("enderton:method=alpha-correction,opaque=together", 11),
        // Three channels by alpha, in the pass that adds up.
        ("enderton:method=depth,opaque=together", 3 * 3),
        ("enderton:method=depth-correction,opaque=together", 11 + 3 * 3),
        ("enderton:method=depth,rounds=2,opaque=together", 2 * 3 * 3),
        // The first fragment's innovation. The second: the sums behind it and their mass, its
        // innovation, the centre of mass, at 62.5. The third lies behind that: what shows of
        // it wrongly, the centre of mass, and sample 0's innovation.
        ("residual", sums + (sums + 1 + sums + 1) + (sums + 1 + sums)),
        ("residual:errors=8", 4 + 10 + 9),
        ("residual:drawn=hashed", 4 + 10 + 9),
        // The same for each covered sample, and innovations where the sample passed: 4, 3, 1.
        ("residual:per=sample", 4 * sums + (3 * sums + 1 + 3 * sums + 1) + (4 * sums + 1 + sums)),
        // With room for both the second has an innovation of its own and one at 100. The third
        // lies between: behind one, before the other and its mass. Of three entries two make
        // room: two products for each pair, and the centre; those behind, of which one has no
        // mass left. There the last innovation falls too, of what came and what went.
        ("residual:layers=2", sums + (sums + 1 + 2 * sums) + (sums + sums + 1 + 2 * 2 + 1 + sums)),
        // Colours by alpha; of one layer too many the last two show through each other.
        ("kbuffer:layers=1,opaque=together", 3 * 3),
        ("mlab:layers=8,opaque=together", 3 * 3),
        ("mlab:layers=2,opaque=together", 3 * 3 + 4),
        ("mlab:layers=1,opaque=together", 3 * 3 + 2 * 4),
        ("hybrid:layers=1,opaque=together", 3 * 3),
        // With room nothing is asked. With one layer there is no choice, and two weights to
        // three channels, after what shows of the far one; the random plane's odds.
        ("merging:layers=8,opaque=together", 0),
        ("merging:layers=1,place=heavier,opaque=together", 2 * (1 + 6)),
        ("merging:layers=1,opaque=together", 2 * (1 + 6 + 1)),
        // Two pairs: seven each; what passes the first, squared and times the second's cost.
        ("merging:layers=2,place=heavier,opaque=together", 2 * 7 + 2 + 6),
        // Each of 4 + 3 + 4 samples' channels moves by alpha of what it lacks.
        ("blend:opaque=together", 11 * 3),
        ("sorted-blend:opaque=together", 11 * 3),
        ("sorted-blend:stop=0.25,opaque=together", 11 * 4),
        // Opaque fragments that are drawn first are tested and stored.
        ("blend", 0),
        ("kbuffer", 0),
    ] {
        assert_eq!(products(spec, &three()), Some(count), "{spec}");
    }
}

#[test]
fn who_would_look_cheap_makes_no_claim() {
    for name in
        ["exact", "abuffer", "adaptive", "depth-peeling", "slab", "wboit", "mboit", "hashed-alpha"]
    {
        assert_eq!(products(name, &three()), None, "{name}");
    }
}

#[test]
fn a_fragment_of_residual_takes_at_most_what_its_page_says() {
    let header = header(6, 5, 4);
    let fragments = random_fragments(&header, 3000, 9);
    let trace = trace(&header, &fragments);
    let found = products("residual", &trace).unwrap();
    // 5 or 6 to attenuate but for each pixel's first, 4 where any sample passed.
    assert!((3000 - 30) * 5 < found && found < 3000 * 10, "{found}");
}
