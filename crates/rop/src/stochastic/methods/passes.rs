//! The methods, pass by pass.

use crate::contract::colour::ColourStore;
use crate::contract::contents::Contents;
use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::contract::layout::Layout;
use crate::contract::over_opaque::Transparent;
use crate::contract::samples::Samples;
use crate::resolve::box_filter;
use crate::stochastic::methods::{Method, MethodsPixel, MethodsSums, Round, Sampler, Strata};
use screendoor_trace::random::hash;
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

/// Draws transparent fragments as a [`Method`] says.
#[derive(Clone, Debug)]
pub struct Methods<S, const N: usize> {
    pub(crate) frame: Frame,
    pub(crate) sampler: S,
    pub(crate) depth_bits: u32,
    pub(crate) colour: ColourStore,
    pub(crate) method: Method,
    pub(crate) rounds: u32,
    pub(super) strata: Strata,
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
    pub(crate) fn has_sums(&self) -> bool {
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
        probe.multiplied(fragment.coverage.count());
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
        // The colour with its alpha; how many samples show it is a number of samples.
        probe.multiplied(3);
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

    /// `svis` counts the samples whose stored depth does not lie before; with the correction, the
    /// light that they take away is scaled to what all fragments take away, `1 − (1 − svis(z)) ·
    /// (1 − vis(∞)) / (1 − svis(∞))` over the pixel (section 3.6). Of several rounds the last alone
    /// would be there: they do not tell.
    fn visibility(&self, pixel: &Self::Pixel, at: &[Unorm32; N]) -> Option<[f64; N]> {
        if self.rounds > 1 {
            return None;
        }
        // What is compared has as few bits as what is stored.
        let lit: [bool; N] =
            std::array::from_fn(|s| at[s].narrowed(self.depth_bits) <= pixel.samples.depth[s]);
        let Some(sums) = pixel.sums.as_ref().filter(|_| self.method.corrected()) else {
            return Some(lit.map(|lit| if lit { 1.0 } else { 0.0 }));
        };
        let hidden = lit.iter().filter(|lit| !**lit).count() as f64;
        let occupied = f64::from(sums.occupied.count());
        let through = sums.transmittance.iter().map(|t| f64::from(*t)).sum::<f64>() / N as f64;
        let taken = if hidden > 0.0 { hidden / occupied * (1.0 - through) } else { 0.0 };
        Some([1.0 - taken; N])
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
