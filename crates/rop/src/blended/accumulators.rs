//! Sums over a pixel's fragments, for each of its samples or for the pixel.

use crate::resolve::box_filter;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, SampleMask};

screendoor_trace::options! {
    /// What sums do with fragments that cover a part of the pixel.
    pub enum Coverage {
        Sample = "sample": "each sample has sums of its own (multisample targets)",
        Share = "share": "one sum a pixel; alpha is scaled by the share of samples covered",
    }
}

/// The parameter's declaration. One sum a pixel takes a surface's pieces for layers
/// one behind the other: wherever two triangles meet within a pixel, their common
/// edge shows. So sums for each sample are the default.
pub const PARAM: Typed<Coverage> =
    Typed::choice("coverage", "sample", "what is summed where a fragment ends");

/// The parameter's value.
pub fn of(values: &Values) -> Coverage {
    values.get(PARAM)
}

impl Coverage {
    /// How many sums a pixel of `samples` samples has.
    pub fn sums(self, samples: usize) -> usize {
        match self {
            Coverage::Sample => samples,
            Coverage::Share => 1,
        }
    }

    /// Which of them a fragment changes.
    #[inline]
    pub fn touched(self, covered: SampleMask) -> SampleMask {
        match self {
            Coverage::Sample => covered,
            Coverage::Share => SampleMask::first(1),
        }
    }

    /// A fragment's alpha in each of these.
    #[inline]
    pub fn alpha(self, fragment: &Fragment, samples: usize) -> f32 {
        match self {
            Coverage::Sample => fragment.alpha,
            Coverage::Share => fragment.alpha * (fragment.coverage.count() as f32 / samples as f32),
        }
    }
}

/// A pixel's sums; none before its first fragment.
#[derive(Clone, Debug)]
pub struct Accumulators<A>(Vec<A>);

impl<A> From<Vec<A>> for Accumulators<A> {
    fn from(sums: Vec<A>) -> Self {
        Accumulators(sums)
    }
}

impl<A> Default for Accumulators<A> {
    fn default() -> Self {
        Accumulators(Vec::new())
    }
}

impl<A: Clone + Default> Accumulators<A> {
    /// The sums, `count` of them from the first call on.
    #[inline]
    pub fn touch(&mut self, count: usize) -> &mut [A] {
        if self.0.is_empty() {
            self.0 = vec![A::default(); count];
        }
        &mut self.0
    }

    /// The sums, if there are any.
    pub fn get(&self) -> &[A] {
        &self.0
    }

    /// The pixel over `behind`, where `layer` makes of a sum what is seen of it
    /// (multiplied by its opacity) and its transmittance.
    pub fn over<const N: usize>(
        &self,
        behind: &[[f32; 3]; N],
        layer: impl Fn(&A) -> ([f64; 3], f64),
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut add = |(colour, transmittance): ([f64; 3], f64), behind: [f64; 3]| {
            for ((sum, colour), behind) in sum.iter_mut().zip(colour).zip(behind) {
                *sum += colour + transmittance * behind;
            }
        };
        match &self.0[..] {
            [] => return box_filter(behind),
            [one] => add(layer(one), box_filter(behind)),
            each => {
                each.iter().zip(behind).for_each(|(a, b)| add(layer(a), b.map(f64::from)));
            }
        }
        sum.map(|s| s / self.0.len() as f64)
    }
}

/// A value of each sum, for people: once where it is the same for all.
pub fn list(values: impl Iterator<Item = f32>) -> String {
    let texts: Vec<String> = values.map(|v| format!("{v:.3}")).collect();
    match &texts[..] {
        [] => "none".to_string(),
        [first, rest @ ..] if rest.iter().all(|t| t == first) => first.clone(),
        all => all.join(" "),
    }
}
