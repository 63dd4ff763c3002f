//! Stochastic transparency with any choice of samples: the single pass, and the
//! methods of several passes of Enderton, Sintorn, Shirley and Luebke (TVCG 2011).
//!
//! A design says which samples a fragment may write ([`Sampler`]); what becomes of
//! them is the same for all ([`Method`]). With the methods of several passes,
//! opaque fragments are drawn first and apart, and what lies behind is dimmed
//! sample by sample (section 3.5).

use crate::contract::colour::ColourStore;
use crate::contract::contents::Contents;
use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::contract::info::Info;
use crate::contract::layout::Layout;
use crate::contract::over_opaque::{self, Opaque, OverOpaque, Transparent};
use crate::contract::port::{Port, of_parameters};
use crate::contract::promise::Promise;
use crate::contract::promises::{OpaquePromise, OrderPromise, Promises};
use crate::contract::samples::Samples;
use crate::contract::shader::Shader;
use crate::contract::words::{Constant, Declaration, OnDevice, PixelWords};
use crate::resolve::box_filter;
use crate::stochastic::depth_bits;
use screendoor_trace::error::Result;
use screendoor_trace::param::{Param, Typed, Values};
use screendoor_trace::random::hash;
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

screendoor_trace::options! {
    /// What is made of the chosen samples. E: Enderton et al. 2011.
    pub enum Method {
        Basic = "basic": "one pass, the mean of the samples (E section 3.1)",
        AlphaCorrection = "alpha-correction": "scaled to the total alpha, for one more pass (E 3.3)",
        Depth = "depth": "all fragments weighed by a stochastic visibility: two passes (E 3.4)",
        DepthCorrection = "depth-correction": "the same, scaled to the total alpha: three passes (E 3.4)",
    }
}

impl Method {
    /// Whether the picture is scaled to the total alpha.
    pub fn corrected(self) -> bool {
        matches!(self, Method::AlphaCorrection | Method::DepthCorrection)
    }

    /// Whether samples hold depths alone, and colours are added up in a pass of their own.
    pub(crate) fn depth_based(self) -> bool {
        matches!(self, Method::Depth | Method::DepthCorrection)
    }
}

screendoor_trace::options! {
    /// How often the samples are drawn.
    pub enum Rounds {
        One = "1": "once",
        Two = "2": "twice the samples for twice the passes",
        Four = "4": "four times",
        Eight = "8": "eight times",
    }
}

screendoor_trace::options! {
    /// Over what masks are stratified where samples are drawn several times.
    pub enum Strata {
        Round = "round": "within each round: other seeds",
        All = "all": "over all rounds together (E section 4, footnote 4)",
    }
}

/// The parameters that all samplers with several methods share.
pub const METHOD: Typed<Method> =
    Typed::choice("method", "basic", "what is made of the chosen samples");
/// As [`METHOD`].
pub const ROUNDS: Typed<Rounds> =
    Typed::choice("rounds", "1", "how often the samples are drawn (E section 3.5)");
/// As [`METHOD`].
pub const STRATA: Typed<Strata> =
    Typed::choice("strata", "round", "over what several rounds are stratified");
/// As [`METHOD`].
pub const OPAQUE: Typed<Opaque> = Typed::choice(
    over_opaque::PARAM.param.name,
    "first",
    "how opaque fragments are drawn; method basic draws them like all others",
);
/// What the suite should try of them together.
pub const COMBINATIONS: [&str; 4] = [
    "method=alpha-correction,rounds=2,opaque=together",
    "method=depth,rounds=4,strata=all",
    "method=depth-correction,rounds=2,opaque=together",
    "rounds=2,strata=all",
];

/// One drawing of the samples among several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Round {
    /// Its number among those that are stratified together.
    pub index: u32,
    /// How many are stratified together.
    pub count: u32,
    /// The seed of its random numbers.
    pub seed: u32,
}

/// How a design chooses the samples that a fragment writes.
pub trait Sampler<const N: usize>: Send + Sync {
    /// What it keeps of a pixel beside the multisample buffer.
    type State: Send + 'static;

    /// A pixel's state before the first fragment of a round.
    fn clear(&self, site: Site) -> Self::State;

    /// Bits of that state.
    fn state_bits(&self) -> u32;

    /// What they hold.
    fn layout(&self) -> Layout {
        Layout::of(1, &[(self.state_bits(), "tracking")])
    }

    /// The samples of `passed` that the fragment writes, where `passed` are those of
    /// its samples that are not behind what `samples` hold. Tells `probe` of its
    /// state's bits, surfaces, sorts, hashes and reference values.
    #[expect(clippy::too_many_arguments, reason = "everything that a choice may depend on")]
    fn choose<P: Probe>(
        &self,
        round: Round,
        site: Site,
        state: &mut Self::State,
        samples: &Samples<N>,
        passed: SampleMask,
        fragment: &Fragment,
        probe: &mut P,
    ) -> SampleMask;

    /// Whether it knows of an [`Sampler::excess`].
    const CORRECTS: bool = false;

    /// By how much the samples' mean is estimated to exceed its expectation: in a single
    /// pass it is taken away when the pixel is resolved.
    fn excess(&self, _state: &Self::State) -> [f64; 3] {
        [0.0; 3]
    }

    /// Names and values of the state, for `explain`.
    fn fields(&self, _state: &Self::State) -> Vec<(&'static str, String)> {
        Vec::new()
    }
}

/// A stochastic design: a sampler and what is made of its choice.
pub type Stochastic<S, const N: usize> = OverOpaque<Methods<S, N>, N>;

/// The design of `sampler` with the shared parameters in `values`.
///
/// # Errors
/// None today; designs pass it on from their own [`crate::Blueprint::at`].
pub fn with_methods<S: Sampler<N>, const N: usize>(
    values: &Values,
    frame: &Frame,
    sampler: S,
) -> Result<Stochastic<S, N>> {
    let method = values.get(METHOD);
    let rounds = 1 << values.get(ROUNDS) as u32;
    let strata = values.get(STRATA);
    let opaque = match method {
        Method::Basic => Opaque::Together,
        _ => over_opaque::of(values),
    };
    let depth_bits = depth_bits::of(values);
    let colour = ColourStore::of(values, frame);
    let methods =
        Methods { frame: frame.clone(), sampler, depth_bits, colour, method, rounds, strata };
    Ok(OverOpaque::new(values, frame, opaque, methods))
}

/// The design of `sampler` in a single pass, without the shared parameters but for
/// the width of the depth buffer.
pub fn single_pass<S: Sampler<N>, const N: usize>(
    values: &Values,
    frame: &Frame,
    sampler: S,
) -> Stochastic<S, N> {
    let methods = Methods {
        frame: frame.clone(),
        sampler,
        depth_bits: depth_bits::of(values),
        colour: ColourStore::of(values, frame),
        method: Method::Basic,
        rounds: 1,
        strata: Strata::Round,
    };
    OverOpaque::new(values, frame, Opaque::Together, methods)
}

/// The port of a design made by [`with_methods`]: without sums, a device resolves it, and
/// may give each sample a thread, where the design is for it.
pub fn port<S, const N: usize>(
    (program, by_sample): (Shader, bool),
    info: &Info,
    values: &Values,
    frame: &Frame,
    plain: Stochastic<S, N>,
) -> Port
where
    S: Sampler<N> + OnDevice<S::State> + Clone + 'static,
    S::State: Send,
{
    let resolves = !plain.inner.has_sums();
    let mut port = Port::of(program, info, values, frame, plain);
    port.resolves = resolves;
    port.by_sample = resolves && by_sample;
    port
}

/// The port of a design made by [`single_pass`]: the parameters that it does not have are what
/// they are by default.
///
/// # Errors
/// None today; as [`Values::resolve`].
pub fn port_of_single_pass<S, const N: usize>(
    program: Shader,
    info: &Info,
    values: &Values,
    frame: &Frame,
    plain: Stochastic<S, N>,
) -> Result<Port>
where
    S: Sampler<N> + OnDevice<S::State> + Clone + 'static,
    S::State: Send,
{
    const ABSENT: &[Param] = &[METHOD.param, STRATA.param];
    let mut port = Port::of(program, info, values, frame, plain);
    let defaults = Values::resolve(info.name, ABSENT, &[])?;
    port.constants.append(&mut of_parameters(ABSENT, &defaults));
    Ok(port)
}

/// What a design promises with the shared parameters, of which the single pass
/// promises `basic` with [`Strata::Round`].
///
/// Correction divides by what chance has found: biased (E sections 4.1 and 4.2).
/// It is consistent for given alphas: what E calls inconsistent is an alpha that
/// falls as 1/S. The visibilities of the depth-based methods count fragments at
/// equal depths as in front of each other: where they overlap, no number of samples or
/// seeds brings those methods to the exact picture.
pub fn promises(values: &Values, basic: Promises) -> Promises {
    let method: Method = values.get(METHOD);
    let together = over_opaque::of(values) == Opaque::Together;
    let sums = method != Method::Basic;
    // The strongest promise that the method leaves of the samples' own. Opaque fragments
    // that are drawn first lie behind transparent ones of their depth that came earlier.
    let by_depth = match method.depth_based() || (sums && !together) {
        true => Promise::DistinctDepths,
        false => Promise::Always,
    };
    Promises {
        unbiased: if method.corrected() { Promise::Never } else { basic.unbiased.min(by_depth) },
        consistent: basic.consistent.min(by_depth),
        order: match basic.order {
            OrderPromise::Independent if sums => OrderPromise::UpToRounding,
            order => order,
        },
        // By their depths alone, opaque fragments at equal depths are all seen.
        exact_opaque: match method.depth_based() && together {
            true => OpaquePromise::Never,
            false => basic.exact_opaque,
        },
        ..basic
    }
}

/// Whether these settings draw opaque fragments in a pass of their own.
pub fn draws_opaque_first(values: &Values) -> bool {
    let has = |name| values.iter().any(|(param, _)| param == name);
    has(over_opaque::PARAM.param.name)
        && over_opaque::of(values) == Opaque::First
        && !(has(METHOD.param.name) && values.get(METHOD) == Method::Basic)
}

/// Whether several rounds are stratified together.
pub fn strata_over_rounds(values: &Values) -> bool {
    values.get(STRATA) == Strata::All && values.get(ROUNDS) != Rounds::One
}

/// Draws transparent fragments as a [`Method`] says.
#[derive(Clone, Debug)]
pub struct Methods<S, const N: usize> {
    pub(crate) frame: Frame,
    pub(crate) sampler: S,
    pub(crate) depth_bits: u32,
    pub(crate) colour: ColourStore,
    pub(crate) method: Method,
    pub(crate) rounds: u32,
    strata: Strata,
}

/// A pixel of a stochastic design.
#[derive(Clone, Debug)]
pub struct MethodsPixel<T, const N: usize> {
    pub(crate) samples: Samples<N>,
    pub(crate) state: T,
    /// What several passes need; `None` for a single one.
    pub(crate) sums: Option<Box<MethodsSums<N>>>,
}

/// What the methods of several passes keep.
#[derive(Clone, Debug)]
pub(crate) struct MethodsSums<const N: usize> {
    /// `1 − α_total` of each sample; without correction, the share of the rounds in
    /// which the sample stayed empty.
    transmittance: [f32; N],
    /// Samples written in this round.
    pub(crate) occupied: SampleMask,
    /// `Σ B` over the occupied samples, or `Σ U`, of all rounds so far.
    colour: [f32; 3],
    /// The same with colours replaced by 1.
    weight: f32,
}

impl<const N: usize> MethodsSums<N> {
    /// Adds a colour `share` times, which counts as `weight`.
    fn add(&mut self, colour: [f32; 3], share: f32, weight: f32, store: ColourStore) {
        for (sum, c) in self.colour.iter_mut().zip(colour) {
            *sum = store.channel(*sum + c * share);
        }
        self.weight = store.channel(self.weight + weight);
    }
}

/// What a pass over the trace does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Pass {
    TotalAlpha,
    Sample(u32),
    Accumulate(u32),
}

impl<S: Sampler<N>, const N: usize> Methods<S, N> {
    pub(crate) fn pass(&self, pass: u32) -> Pass {
        let Some(pass) = pass.checked_sub(u32::from(self.method.corrected())) else {
            return Pass::TotalAlpha;
        };
        match self.method.depth_based() {
            true if pass % 2 == 1 => Pass::Accumulate(pass / 2),
            true => Pass::Sample(pass / 2),
            false => Pass::Sample(pass),
        }
    }

    pub(crate) fn round(&self, round: u32) -> Round {
        let seed = self.frame.seed;
        match self.strata {
            Strata::All => Round { index: round, count: self.rounds, seed },
            Strata::Round if round == 0 => Round { index: 0, count: 1, seed },
            Strata::Round => Round { index: 0, count: 1, seed: hash([seed, round]) },
        }
    }

    /// Whether anything is summed over rounds or passes.
    fn has_sums(&self) -> bool {
        self.method != Method::Basic || self.rounds > 1
    }

    /// What a sample holds: the depth-based methods store no colours.
    fn sample(&self) -> [(u32, &'static str); 2] {
        let colour = if self.method.depth_based() { 0 } else { self.colour.colour_bits() };
        [(self.depth_bits, "depth"), (colour, "colour")]
    }

    /// Bits that a written sample takes.
    pub(crate) fn sample_bits(&self) -> u32 {
        self.sample().iter().map(|(bits, _)| bits).sum()
    }

    fn draw_samples<P: Probe>(
        &self,
        round: u32,
        site: Site,
        pixel: &mut MethodsPixel<S::State, N>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        // Depth and opacity are compared as integers.
        let z: [Unorm32; N] = self.frame.depths(fragment, self.depth_bits);
        let MethodsPixel { samples, state, sums } = pixel;
        let passed = samples.depth_test(fragment.coverage, &z);
        probe.depth_test(fragment.coverage, passed);
        probe.state(self.depth_bits * fragment.coverage.count(), 0);
        let round = self.round(round);
        let written = self.sampler.choose(round, site, state, samples, passed, fragment, probe);
        let colour = self.colour.colour(fragment.colour);
        for s in written.iter() {
            samples.write(s, z[s], colour);
        }
        if let Some(sums) = sums {
            sums.occupied |= written;
        }
        probe.written(written);
        probe.state(0, self.sample_bits() * written.count());
    }

    /// What the samples show on average, as far as the sampler knows.
    #[inline]
    pub(crate) fn mean(&self, colours: &[[f32; 3]; N], excess: impl Fn() -> [f64; 3]) -> [f64; 3] {
        let mean = box_filter(colours);
        if !S::CORRECTS {
            return mean;
        }
        let excess = excess();
        std::array::from_fn(|i| mean[i] - excess[i])
    }

    /// E equation 5: the product of what the fragments let through.
    pub(crate) fn draw_alpha<P: Probe>(
        &self,
        sums: &mut MethodsSums<N>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        for s in fragment.coverage.iter() {
            let through = sums.transmittance[s] * (1.0 - fragment.alpha);
            sums.transmittance[s] = self.colour.channel(through);
        }
        let bits = self.colour.channel_bits() * fragment.coverage.count();
        probe.state(bits, bits);
    }

    /// E equations 4 and 6: the fragment, weighed by the share of the samples that it
    /// lies not behind, the `visible` ones.
    pub(crate) fn accumulate<P: Probe>(
        &self,
        sums: &mut MethodsSums<N>,
        fragment: &Fragment,
        visible: SampleMask,
        probe: &mut P,
    ) {
        probe.depth_test(fragment.coverage, visible);
        let share = fragment.alpha * visible.count() as f32;
        sums.add(fragment.colour, share, share, self.colour);
        probe.written(visible);
        // One sum a pixel: with a box filter it holds what a multisample buffer would.
        let sum = self.colour.texel_bits();
        probe.state(self.depth_bits * fragment.coverage.count() + sum, sum);
    }
}

impl<S: Sampler<N>, const N: usize> Transparent<N> for Methods<S, N> {
    type Pixel = MethodsPixel<S::State, N>;

    fn passes(&self) -> u32 {
        let of_a_round = if self.method.depth_based() { 2 } else { 1 };
        u32::from(self.method.corrected()) + self.rounds * of_a_round
    }

    fn layout(&self) -> Layout {
        let samples = N as u32;
        let channel = self.colour.channel_bits();
        let transmittance = match self.method {
            Method::Basic => 0,
            Method::AlphaCorrection | Method::DepthCorrection => channel,
            // How often the sample stayed empty.
            Method::Depth => self.rounds.ilog2() + 1,
        };
        let occupied = u32::from(self.method == Method::AlphaCorrection);
        let sums = u32::from(self.method.depth_based() || self.rounds > 1);
        Layout::samples(samples, &self.sample())
            .joined(self.sampler.layout())
            .and(samples, &[(transmittance, "transmittance"), (occupied, "occupied")])
            .and(sums, &[(self.colour.colour_bits(), "summed colour"), (channel, "weight")])
    }

    fn clear(&self, site: Site) -> Self::Pixel {
        let sums = MethodsSums {
            transmittance: [if self.method.corrected() { 1.0 } else { 0.0 }; N],
            occupied: SampleMask::NONE,
            colour: [0.0; 3],
            weight: 0.0,
        };
        MethodsPixel {
            samples: Samples::cleared(self.frame.background),
            state: self.sampler.clear(site),
            sums: self.has_sums().then(|| Box::new(sums)),
        }
    }

    #[inline]
    fn draw<P: Probe>(
        &self,
        pass: u32,
        site: Site,
        pixel: &mut Self::Pixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        match self.pass(pass) {
            Pass::Sample(round) => self.draw_samples(round, site, pixel, fragment, probe),
            Pass::Accumulate(_) => {
                let z: [Unorm32; N] = self.frame.depths(fragment, self.depth_bits);
                let visible = pixel.samples.depth_test(fragment.coverage, &z);
                self.accumulate(
                    pixel.sums.as_mut().expect("it has sums"),
                    fragment,
                    visible,
                    probe,
                );
            }
            Pass::TotalAlpha => {
                self.draw_alpha(pixel.sums.as_mut().expect("it has sums"), fragment, probe);
            }
        }
    }

    /// Adds a finished round to the sums.
    fn end_pass<P: Probe>(&self, pass: u32, site: Site, pixel: &mut Self::Pixel, _probe: &mut P) {
        let MethodsPixel { samples, state, sums: Some(sums) } = pixel else { return };
        let round = match (self.pass(pass), self.method.depth_based()) {
            (Pass::Sample(round), false) | (Pass::Accumulate(round), true) => round,
            _ => return,
        };
        match self.method {
            // The weight counts what was written: where that is nothing, see `resolve`.
            Method::Basic => samples.colour.iter().enumerate().for_each(|(s, c)| {
                let weight = if sums.occupied.contains(s) { 1.0 } else { 0.0 };
                sums.add(*c, 1.0, weight, self.colour);
            }),
            Method::AlphaCorrection => {
                sums.occupied
                    .iter()
                    .for_each(|s| sums.add(samples.colour[s], 1.0, 1.0, self.colour));
            }
            Method::Depth => {
                for s in (0..N).filter(|s| !sums.occupied.contains(*s)) {
                    sums.transmittance[s] += 1.0 / self.rounds as f32;
                }
            }
            Method::DepthCorrection => {}
        }
        if round + 1 < self.rounds {
            *samples = Samples::cleared(self.frame.background);
            *state = self.sampler.clear(site);
            sums.occupied = SampleMask::NONE;
        }
    }

    fn resolve(&self, _site: Site, pixel: &Self::Pixel, behind: &[[f32; 3]; N]) -> [f64; 3] {
        let Some(sums) = &pixel.sums else {
            return self.mean(&pixel.samples.colour, || self.sampler.excess(&pixel.state));
        };
        if self.method == Method::Basic && sums.weight == 0.0 {
            // Nothing was written in any round: the sum of so many backgrounds is rounded.
            return box_filter(behind);
        }
        let samples = N as f64;
        let mean = 1.0 / (samples * f64::from(self.rounds));
        let mut behind_it = [0.0; 3];
        let mut let_through = 0.0;
        for (t, colour) in sums.transmittance.iter().zip(behind) {
            for (sum, c) in behind_it.iter_mut().zip(colour) {
                *sum += f64::from(t * c) / samples;
            }
            let_through += f64::from(*t) / samples;
        }
        // The correction's factor, `C_α / F(B1)` or `C_α / F(U1)`, or none.
        let factor = match self.method.corrected() {
            false => mean,
            true if sums.weight > 0.0 => (1.0 - let_through) / f64::from(sums.weight),
            true => 0.0,
        };
        std::array::from_fn(|i| factor * f64::from(sums.colour[i]) + behind_it[i])
    }

    fn contents(&self, pixel: &Self::Pixel) -> Contents {
        let mut contents = Contents {
            samples: pixel.samples.contents(),
            fields: self.sampler.fields(&pixel.state),
        };
        if let Some(sums) = &pixel.sums {
            let mean = sums.transmittance.iter().sum::<f32>() / N as f32;
            let [r, g, b] = sums.colour;
            contents.fields.push(("through", format!("{mean:.4}")));
            contents
                .fields
                .push(("sum", format!("{r:.3} {g:.3} {b:.3}, weight {:.3}", sums.weight)));
        }
        contents
    }
}

impl<S, const N: usize> OnDevice<MethodsPixel<S::State, N>> for Methods<S, N>
where
    S: Sampler<N> + OnDevice<S::State>,
{
    fn declare(&self, to: &mut Declaration) {
        to.constant("DEPTH_BUFFER_BITS", Constant::Whole(self.depth_bits));
        to.constant("ROUNDS_LOG2", Constant::Whole(self.rounds.ilog2()));
        let samples = N as u32;
        to.field("DEPTH", samples);
        to.field("COLOUR", 3 * samples);
        let sums = u32::from(self.has_sums());
        to.field("TRANSMITTANCE", sums * samples);
        to.field("OCCUPIED", sums * samples.div_ceil(32));
        to.field("SUM", sums * 4);
        if self.has_sums() {
            to.ends_passes();
        }
        // The depth test, writing or multiplying.
        to.iterations(2 * samples);
        self.sampler.declare(to);
    }

    fn read(&self, site: Site, from: &PixelWords<'_>) -> MethodsPixel<S::State, N> {
        let sums = || {
            let [r, g, b, weight] = from.reals("SUM");
            let occupied = SampleMask(from.mask("OCCUPIED"));
            let transmittance = from.reals("TRANSMITTANCE");
            Box::new(MethodsSums { transmittance, occupied, colour: [r, g, b], weight })
        };
        MethodsPixel {
            samples: Samples::read(from, "DEPTH", "COLOUR"),
            state: self.sampler.read(site, from),
            sums: self.has_sums().then(sums),
        }
    }
}
