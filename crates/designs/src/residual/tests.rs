//! What `docs/RESIDUAL.md` claims.

use super::*;
use crate::configure;
use screendoor_rop::NoProbe;
use screendoor_rop::resolve::box_filter;
use screendoor_trace::random::Stream;
use screendoor_trace::trace::DepthPlane;

impl<const N: usize> ResidualSampler<N> {
    pub(super) fn has(&self, flaw: Flaw) -> bool {
        self.store.flaw == Some(flaw)
    }

    /// What a fragment is taken for by a flawed one.
    pub(super) fn flawed(&self, drawn: &Drawn, passed: SampleMask) -> Drawn {
        let coverage = if self.has(Flaw::ByPassed) { passed } else { drawn.coverage };
        Drawn { coverage, ..*drawn }
    }
}

const SITE: Site = Site { x: 3, y: 1 };
const BACKGROUND: [f32; 3] = [0.25, 0.0, 1.0];

/// A design and a pixel that it draws.
#[derive(Clone)]
struct Pixel<const N: usize> {
    sampler: ResidualSampler<N>,
    frame: Frame,
    samples: Samples<N>,
    state: Residue,
}

impl<const N: usize> Pixel<N> {
    fn new(settings: &str, seed: u32, flaw: Option<Flaw>) -> Self {
        let frame = Frame {
            grid: TileGrid::new(8, 8),
            positions: (0..N as i8).map(|s| [s % 8 * 2 - 8, s / 8 * 2 - 8]).collect(),
            background: BACKGROUND,
            space: Default::default(),
            seed,
            colour_bits: 96,
            view: None,
            opaque: true,
            primitive_depths: None,
            columns: Default::default(),
        };
        let design = configure(&format!("residual:{settings}"), &[]).unwrap();
        let mut sampler = ResidualSampler::of(design.values(), &frame);
        sampler.store.flaw = flaw;
        let state = sampler.clear(SITE);
        Pixel { sampler, frame, samples: Samples::cleared(BACKGROUND), state }
    }

    fn depths(&self, fragment: &Fragment) -> ([Unorm32; N], SampleMask) {
        let z = self.frame.depths(fragment, 32);
        let passed = self.samples.depth_test(fragment.coverage, &z);
        (z, passed)
    }

    fn write(&mut self, fragment: &Fragment, z: &[Unorm32; N], written: SampleMask) {
        for s in written.iter() {
            self.samples.write(s, z[s], fragment.colour);
        }
    }

    fn draw(mut self, fragments: &[Fragment]) -> Self {
        let round = Round { index: 0, count: 1, seed: self.frame.seed };
        for fragment in fragments {
            let (z, passed) = self.depths(fragment);
            let Pixel { sampler, state, samples, .. } = &mut self;
            let written =
                sampler.choose(round, SITE, state, samples, passed, fragment, &mut NoProbe);
            self.write(fragment, &z, written);
        }
        self
    }

    /// As if chance had let the fragment be written to these of the samples that passed.
    fn draw_to(&mut self, fragment: &Fragment, written: SampleMask) {
        let (z, passed) = self.depths(fragment);
        let drawn = Drawn {
            z: fragment.depth.z.0,
            coverage: fragment.coverage,
            colour: self.sampler.fixed(fragment.colour),
            threshold: Threshold::of(fragment.alpha),
            random: 0,
        };
        let masks = [passed, written];
        self.sampler.account(&mut self.state.errors, &self.samples, &drawn, masks, &mut NoProbe);
        self.write(fragment, &z, written);
    }

    fn errors(&self) -> [f64; 4] {
        self.sampler.store.of_whole_pixel(&self.state.errors)
    }

    fn shown(&self) -> [f64; 3] {
        let (mean, excess) = (box_filter(&self.samples.colour), self.sampler.excess(&self.state));
        std::array::from_fn(|i| mean[i] - excess[i])
    }
}

fn fragment(z: u32, coverage: u64, alpha: f32, colour: [f32; 3]) -> Fragment {
    Fragment {
        x: SITE.x,
        y: SITE.y,
        coverage: SampleMask(coverage),
        depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
        colour,
        alpha,
        primitive: z,
        ..Fragment::default()
    }
}

/// What sorted compositing at each sample gives.
fn exact<const N: usize>(fragments: &[Fragment]) -> [f64; 3] {
    let mut sorted: Vec<&Fragment> = fragments.iter().rev().collect();
    sorted.sort_by_key(|f| f.depth.z);
    let mut mean = [0.0; 3];
    for s in 0..N {
        let mut seen = 1.0;
        let mut add = |colour: [f32; 3], share: f64| {
            for (sum, c) in mean.iter_mut().zip(colour) {
                *sum += f64::from(c) * share / N as f64;
            }
        };
        for f in sorted.iter().filter(|f| f.coverage.contains(s)) {
            add(f.colour, seen * f64::from(f.alpha));
            seen *= 1.0 - f64::from(f.alpha);
        }
        add(BACKGROUND, seen);
    }
    mean
}

/// Fragments of random depths, masks, alphas and colours.
fn random_pixel(key: u32, count: usize, samples: u32) -> Vec<Fragment> {
    let mut stream = Stream::new([key, samples]);
    let all = u64::MAX >> (64 - samples);
    let of_one = |_| {
        let mask = u64::from(stream.word()) & all;
        let coverage = if mask == 0 || stream.below(2) == 0 { all } else { mask };
        let colour = std::array::from_fn(|_| stream.unit());
        fragment(stream.word(), coverage, stream.unit(), colour)
    };
    (0..count).map(of_one).collect()
}

/// The mean over every choice of samples that chance can make.
struct Enumeration<'a> {
    fragments: &'a [Fragment],
    /// Of the sums of all errors.
    errors: [f64; 4],
    /// Of what is shown.
    shown: [f64; 3],
    choices: u64,
}

impl<'a> Enumeration<'a> {
    fn of<const N: usize>(pixel: &Pixel<N>, fragments: &'a [Fragment]) -> Self {
        let mut all = Enumeration { fragments, errors: [0.0; 4], shown: [0.0; 3], choices: 0 };
        all.go_on(pixel, 0, 1.0);
        all
    }

    fn go_on<const N: usize>(&mut self, pixel: &Pixel<N>, next: usize, probability: f64) {
        let Some(fragment) = self.fragments.get(next) else {
            for (sum, e) in self.errors.iter_mut().zip(pixel.errors()) {
                *sum += probability * e;
            }
            for (sum, c) in self.shown.iter_mut().zip(pixel.shown()) {
                *sum += probability * c;
            }
            self.choices += 1;
            return;
        };
        let (_, passed) = pixel.depths(fragment);
        // Each sample that passed is written or not, with a probability of alpha.
        let mut subset = passed.0;
        loop {
            let written = SampleMask(subset);
            let mut after = pixel.clone();
            after.draw_to(fragment, written);
            let alpha = f64::from(fragment.alpha);
            let (hit, missed) = (written.count(), passed.count() - written.count());
            let chance = alpha.powi(hit as i32) * (1.0 - alpha).powi(missed as i32);
            self.go_on(&after, next + 1, probability * chance);
            if subset == 0 {
                break;
            }
            subset = (subset - 1) & passed.0;
        }
    }
}

const SETTINGS: [&str; 4] = ["layers=1", "layers=2", "layers=1,per=sample", "layers=3,per=sample"];

/// Over small cases with a few colours, depths and alphas: the mean of the errors' sums over all
/// choices, and how far the mean of what is shown is from the exact picture, at most.
fn enumerated(settings: &str, flaw: Option<Flaw>, dyadic: bool) -> ([f64; 4], f64) {
    const CASES: u32 = 12;
    let mut stream = Stream::new([20]);
    let (mut mean, mut most) = ([0.0; 4], 0.0_f64);
    for case in 0..CASES {
        let mut fragments = random_pixel(case, 2 + case as usize % 3, 4);
        for fragment in &mut fragments {
            fragment.depth.z = Unorm32(1000 * (1 + stream.below(6)));
            if dyadic {
                // Every product is exact in 20 digits.
                fragment.alpha = [0.25, 0.5, 0.75][stream.below(3) as usize];
                fragment.colour = std::array::from_fn(|_| stream.below(5) as f32 / 4.0);
            }
        }
        let all = Enumeration::of(&Pixel::<4>::new(settings, 0, flaw), &fragments);
        assert!(all.choices > 2, "{case}: {} choices", all.choices);
        for (mean, e) in mean.iter_mut().zip(all.errors) {
            *mean += e / f64::from(CASES);
        }
        for (shown, exact) in all.shown.iter().zip(exact::<4>(&fragments)) {
            most = most.max((shown - exact).abs());
        }
    }
    (mean, most)
}

#[test]
fn over_all_choices_the_errors_are_nought_and_the_picture_is_exact() {
    for settings in SETTINGS {
        let (errors, off) = enumerated(settings, None, true);
        assert!(errors.iter().all(|e| e.abs() < 1e-12), "{settings}: {errors:?}");
        assert!(off < 1e-7, "{settings}: {off}");
    }
    // What depends on chance is a bias.
    let (errors, off) = enumerated("layers=1", Some(Flaw::ByPassed), true);
    assert!(errors.iter().any(|e| e.abs() > 1e-4) && off > 1e-3, "{errors:?} {off}");
}

#[test]
fn rounding_has_no_direction() {
    // Half a unit of a sum, of four samples.
    const HALF: f64 = 0.5 / (1 << POINT) as f64 / 4.0;
    let most = |flaw| {
        let (errors, _) = enumerated("layers=1", flaw, false);
        errors[..3].iter().fold(0.0_f64, |most, e| most.max(e.abs()))
    };
    let (nearest, down) = (most(None), most(Some(Flaw::RoundedDown)));
    assert!(nearest < HALF && down > 2.0 * HALF, "{nearest} {down} of {HALF}");
}

/// Layers over the whole pixel at random depths, in the order in which they are drawn.
fn whole_layers(key: u32, count: usize) -> Vec<Fragment> {
    let mut layers = random_pixel(key, count, 8);
    layers.iter_mut().for_each(|f| f.coverage = SampleMask::first(8));
    layers
}

/// How far what is shown of these is from exact over fifty seeds, at most.
fn farthest(settings: &str, layers: &[Fragment], flaw: Option<Flaw>) -> f64 {
    let expected = exact::<8>(layers);
    let off = |seed| {
        let shown = Pixel::<8>::new(settings, seed, flaw).draw(layers).shown();
        let off = shown.iter().zip(expected).map(|(shown, exact)| (shown - exact).abs());
        off.fold(0.0, f64::max)
    };
    (0..50).map(off).fold(0.0, f64::max)
}

#[test]
fn sorted_layers_are_exact_in_either_order() {
    let mut layers = whole_layers(7, 20);
    layers.sort_by_key(|f| f.depth.z);
    for _ in ["near to far", "far to near"] {
        for settings in SETTINGS {
            let off = farthest(settings, &layers, None);
            assert!(off < 1e-5, "{settings}: {off}");
        }
        layers.reverse();
    }
    // In no order, they are not.
    let off = farthest("layers=1", &whole_layers(7, 20), None);
    assert!(off > 1e-2, "{off}");
}

#[test]
fn with_a_depth_for_each_layer_any_order_is_exact() {
    for key in 0..20 {
        let layers = whole_layers(key, 8);
        for settings in ["layers=8", "layers=8,per=sample", "layers=8,drawn=hashed"] {
            let off = farthest(settings, &layers, None);
            assert!(off < 1e-5, "{settings}: {off}");
        }
    }
    let off = farthest("layers=8", &whole_layers(1, 8), Some(Flaw::Misplaced));
    assert!(off > 1e-2, "misplaced: {off}");
}

const SEEDS: u32 = 400;

/// Of so many seeds, how often two neighbouring pairs of samples have their first sample
/// written alike.
fn alike(flaw: Option<Flaw>) -> u32 {
    let half = fragment(5, 0b1111, 0.5, [1.0; 3]);
    let is_alike = |seed: &u32| {
        let pixel = Pixel::<4>::new("layers=1", *seed, flaw).draw(&[half]);
        let written = pixel.samples.depth.map(|z| z != Unorm32::FAR);
        assert_eq!(written.iter().filter(|w| **w).count(), 2, "{written:?}");
        written[0] == written[2]
    };
    (0..SEEDS).filter(is_alike).count() as u32
}

#[test]
fn the_pairs_are_exchanged_each_for_itself() {
    // A binomial's six standard deviations: 60.
    let found = alike(None);
    assert!(found.abs_diff(SEEDS / 2) < 60, "{found} of {SEEDS}");
    assert_eq!(alike(Some(Flaw::NoExchange)), SEEDS);
}

#[test]
fn the_mean_is_the_exact_picture() {
    const MORE: [&str; 6] = [
        "layers=1,errors=8",
        "per=sample,errors=8",
        "drawn=hashed",
        "drawn=hashed,reference=white,sort=false",
        "layers=8,sort=false",
        "dither=blue-noise",
    ];
    const SEEDS: u32 = 3000;
    // 10 settings, 6 pixels, 3 channels: 180 tests, each at 5 standard errors, where one of
    // them fails by chance once in 10,000 times. What rounds to 2^-20 is no chance: its floor.
    const FLOOR: f64 = 1e-5;
    for settings in SETTINGS.iter().chain(&MORE) {
        for key in 0..6 {
            let fragments = random_pixel(100 + key, 9, 8);
            let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
            let expected = exact::<8>(&fragments);
            for seed in 0..SEEDS {
                let shown = Pixel::<8>::new(settings, seed, None).draw(&fragments).shown();
                for j in 0..3 {
                    let off = shown[j] - expected[j];
                    sum[j] += off;
                    squares[j] += off * off;
                }
            }
            for (sum, squares) in sum.iter().zip(squares) {
                let n = f64::from(SEEDS);
                let mean = sum / n;
                let error = ((squares / n - mean * mean).max(0.0) / n).sqrt();
                assert!(
                    mean.abs() < 5.0 * error + FLOOR,
                    "{settings}, pixel {key}: off by {mean} ± {error}"
                );
            }
        }
    }
}

#[test]
fn sums_of_16_bits_are_within_their_bound() {
    // Each fragment rounds a sum once, to 2^-13 of the pixel at most; fifteen fragments.
    for key in 0..6 {
        let fragments = random_pixel(200 + key, 15, 8);
        for seed in 0..40 {
            let shown = |settings| Pixel::<8>::new(settings, seed, None).draw(&fragments).shown();
            for (narrow, whole) in shown("errors=16").iter().zip(shown("errors=32")) {
                assert!((narrow - whole).abs() < 15.0 * 2.0 / 8192.0, "{narrow} {whole}");
            }
        }
    }
}
