//! Maps and filters, on a design whose answers are known.

use super::*;
use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::contract::layout::Layout;
use crate::replay::ReplayOptions;
use screendoor_trace::random::Stream;
use screendoor_trace::trace::{
    Fragment, Header, SampleMask, SamplePattern, Trace, TraceWriter, Unorm32, WriteOptions,
};

/// The nearest depth of each sample, whatever the opacity. `bytes` a fragment are claimed.
#[derive(Clone, Copy)]
struct Nearest {
    bytes: Option<usize>,
}

impl Design for Nearest {
    type Pixel = [u32; 4];

    fn bytes_per_fragment(&self) -> Option<usize> {
        self.bytes
    }

    fn layout(&self) -> Layout {
        Layout::of(4, &[(32, "depth")])
    }

    fn clear(&self, _: Site) -> [u32; 4] {
        [u32::MAX; 4]
    }

    fn draw<P: Probe>(&self, _: u32, _: Site, pixel: &mut [u32; 4], f: &Fragment, _: &mut P) {
        f.coverage.iter().for_each(|s| pixel[s] = pixel[s].min(f.depth.z.0));
    }

    fn resolve(&self, _: Site, _: &[u32; 4]) -> [f64; 3] {
        [0.0; 3]
    }

    fn contents(&self, _: &[u32; 4]) -> Contents {
        Contents::default()
    }

    fn visibility(&self, pixel: &[u32; 4], at: &[Unorm32], to: &mut [f64]) -> bool {
        for ((to, at), held) in to.iter_mut().zip(at).zip(pixel) {
            *to = if at.0 <= *held { 1.0 } else { 0.0 };
        }
        true
    }
}

const SIZE: [u32; 2] = [40, 24];

fn trace(fragments: &[Fragment]) -> Trace {
    let mut header = Header { width: SIZE[0], height: SIZE[1], ..Header::default() };
    let positions = (0..4).map(|i| [i, -i]).collect();
    header.pattern = SamplePattern { name: "p".into(), positions, nested: true };
    let mut writer = TraceWriter::new(Vec::new(), "t", header, WriteOptions::default()).unwrap();
    writer.push_all(fragments).unwrap();
    Trace::from_bytes(writer.finish().unwrap().0, "t").unwrap()
}

fn fragment(x: u16, y: u16, coverage: u64, z: u32) -> Fragment {
    let mut fragment = Fragment { x, y, alpha: 1.0, ..Fragment::default() };
    fragment.coverage = SampleMask(coverage);
    fragment.depth.z = Unorm32(z);
    fragment
}

fn map_of(design: Nearest, trace: &Trace, options: &ReplayOptions<'_>) -> VisibilityMap {
    let frame = Frame::of(trace, 4, 0).unwrap();
    VisibilityMap::draw(Box::new(design), &frame, trace, options).unwrap()
}

#[test]
fn a_pixel_tells_the_mean_of_its_samples_and_all_else_is_lit() {
    let trace = trace(&[fragment(3, 5, 0b0011, 100), fragment(3, 5, 0b0111, 200)]);
    let map = map_of(Nearest { bytes: None }, &trace, &ReplayOptions::default());
    let at = |z| map.pixel(3, 5, Unorm32(z));
    assert_eq!([at(0), at(100), at(101), at(200), at(201)], [1.0, 1.0, 0.5, 0.5, 0.25]);
    // An untouched pixel, an untouched tile, and beyond the map.
    for (x, y) in [(4, 5), (39, 23), (40, 5), (3, 24), (70_000, 5)] {
        assert_eq!(map.pixel(x, y, Unorm32::FAR), 1.0);
    }
    assert_eq!((map.size(), map.state_bits().total()), (SIZE, 128));
}

#[test]
fn windows_and_memory_change_no_answer() {
    let mut random = Stream::new([3]);
    let fragments: Vec<Fragment> = (0..3000)
        .map(|_| {
            let (x, y) = (random.below(SIZE[0]) as u16, random.below(SIZE[1]) as u16);
            fragment(x, y, 1 + u64::from(random.below(15)), random.word())
        })
        .collect();
    let trace = trace(&fragments);
    let answers = |bytes, options: &ReplayOptions<'_>| -> Vec<f64> {
        let map = map_of(Nearest { bytes }, &trace, options);
        let mut random = Stream::new([4]);
        let mut ask = || {
            let z = Unorm32(random.word() / 4);
            map.pixel(random.below(SIZE[0]), random.below(SIZE[1]), z)
        };
        (0..2000).map(|_| ask()).collect()
    };
    let whole = answers(None, &ReplayOptions::default());
    assert!(whole.contains(&0.25) && whole.contains(&1.0));
    for (bytes, window, memory) in
        [(None, 100, 1 << 29), (None, usize::MAX, 20_000), (Some(10), 77, 1 << 20)]
    {
        let options = ReplayOptions { window, memory, ..ReplayOptions::default() };
        assert!(answers(bytes, &options) == whole, "windows of {window}, {memory} bytes");
    }
    // State that grows beyond the limit is refused by name.
    let options = ReplayOptions { memory: 200_000, ..ReplayOptions::default() };
    let frame = Frame::of(&trace, 4, 0).unwrap();
    let design = Box::new(Nearest { bytes: Some(1000) });
    let error = VisibilityMap::draw(design, &frame, &trace, &options).unwrap_err().to_string();
    assert!(error.contains("3000 fragments") && error.contains("--memory"), "{error}");
}

#[test]
fn taps_cover_their_region_and_weigh_alike() {
    // Of 4 by 4 pixels around (10, 10) the left half is in shadow.
    let hidden = (8..12).flat_map(|y| (8..10).map(move |x| fragment(x, y, 0b1111, 100)));
    let trace = trace(&hidden.collect::<Vec<_>>());
    let map = map_of(Nearest { bytes: None }, &trace, &ReplayOptions::default());
    let receiver = Receiver { at: [10.0, 10.0], z: Unorm32(1000), slope: 0, key: [1, 2] };
    let filter = Filter { bias: 0.0, slope_bias: 0.0, ..Filter::default() };
    let of = |filter: Filter, receiver: Receiver| filter.visibility(&map, &receiver);
    for taps in [4, 16, 64] {
        assert_eq!(of(Filter { taps, radius: 2.0, ..filter }, receiver), 0.5, "{taps}");
    }
    // All of it in shadow, and none.
    let left = Receiver { at: [9.0, 10.0], ..receiver };
    assert_eq!(of(Filter { taps: 16, radius: 0.9, ..filter }, left), 0.0);
    assert_eq!(
        of(Filter { taps: 16, radius: 0.9, ..filter }, Receiver { at: [30.0, 2.0], ..left }),
        1.0
    );
    // Random places: about half of them, others for another fragment and another seed.
    let stochastic = Filter { taps: 64, radius: 2.0, kind: Taps::Stochastic, ..filter };
    let shares: Vec<f64> =
        (0..64).map(|i| of(stochastic, Receiver { key: [i, 0], ..receiver })).collect();
    let mean = shares.iter().sum::<f64>() / 64.0;
    // 4096 flips of a fair coin: σ = 1/128; 5 σ.
    assert!((mean - 0.5).abs() < 5.0 / 128.0, "{mean}");
    assert!(shares.iter().any(|s| *s != shares[0]));
    assert!((0..64).any(|seed| of(Filter { seed, ..stochastic }, receiver) != shares[1]));
}

#[test]
fn bias_draws_a_receiver_towards_the_light_and_not_beyond_it() {
    let trace = trace(&[fragment(1, 1, 0b1111, 1000)]);
    let map = map_of(Nearest { bytes: None }, &trace, &ReplayOptions::default());
    let none = Filter { bias: 0.0, slope_bias: 0.0, ..Filter::default() };
    let receiver = Receiver { at: [1.5, 1.5], z: Unorm32(1010), slope: 20, key: [0; 2] };
    assert_eq!(none.visibility(&map, &receiver), 0.0);
    // 10 of 2^32 − 1; half a pixel of a slope of 20.
    let constant = Filter { bias: 10.0 / f64::from(u32::MAX), ..none };
    assert_eq!(constant.visibility(&map, &receiver), 1.0);
    assert_eq!(Filter { slope_bias: 0.5, ..none }.visibility(&map, &receiver), 1.0);
    assert_eq!(Filter { slope_bias: 0.4, ..none }.visibility(&map, &receiver), 0.0);
    let most = Filter { bias: 1.0, slope_bias: 1024.0, ..none };
    let far = Receiver { z: Unorm32::FAR, slope: u32::MAX, ..receiver };
    assert_eq!(most.visibility(&map, &far), 1.0);
}

#[test]
fn filters_that_there_are_not_are_refused() {
    let filter = Filter::default();
    filter.check().unwrap();
    for taps in [1, 4, 9, 64] {
        Filter { taps, ..filter }.check().unwrap();
    }
    Filter { taps: 63, kind: Taps::Stochastic, ..filter }.check().unwrap();
    for (wrong, word) in [
        (Filter { taps: 0, ..filter }, "taps"),
        (Filter { taps: 65, kind: Taps::Stochastic, ..filter }, "64"),
        (Filter { taps: 8, ..filter }, "4 or 9"),
        (Filter { radius: -1.0, ..filter }, "radius"),
        (Filter { radius: f64::NAN, ..filter }, "radius"),
        (Filter { bias: 1.5, ..filter }, "bias"),
        (Filter { slope_bias: f64::INFINITY, ..filter }, "slope bias"),
    ] {
        let error = wrong.check().unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}
