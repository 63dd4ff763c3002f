//! The two examples and the cases of bias of Enderton et al. (E, 2011), which calls for
//! every method the standard deviation of one pixel: as printed, by enumeration of every
//! mask, and as the designs give it. No study: it is single pixels' moments, channel by
//! channel, that are printed.

use serde::Serialize;

use crate::metrics::Estimate;
use crate::study::publications::{pictures, whole_layers};
use screendoor_rop::stochastic::Method;
use screendoor_trace::error::Result;

/// One layer: linear colour and alpha.
pub type Layer = ([f32; 3], f32);

/// A pixel of whole layers, nearest first.
#[derive(Clone, Debug, Serialize)]
pub struct Example {
    /// What it is.
    pub name: &'static str,
    /// The layers, nearest first.
    pub layers: Vec<Layer>,
    /// What lies behind.
    pub background: [f32; 3],
    /// Samples per pixel.
    pub samples: u32,
}

/// How a fragment's mask is drawn in the enumeration.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub enum Masks {
    /// Each sample with probability alpha.
    Naive,
    /// A random subset of `⌊αS+ξ⌋` samples.
    Stratified,
}

/// Mean and standard deviation of a pixel's colour.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Moments {
    /// Expectation of each channel.
    pub mean: [f64; 3],
    /// Standard deviation of each channel.
    pub deviation: [f64; 3],
}

/// One method on one example.
#[derive(Clone, Debug, Serialize)]
pub struct ExampleRow {
    /// The example's name.
    pub example: &'static str,
    /// E's name of the method.
    pub method: &'static str,
    /// The standard deviations as printed; none where E prints none.
    pub printed: Option<[f64; 3]>,
    /// By enumeration of every mask.
    pub exact: Moments,
    /// As the design gives it over many pixels and seeds.
    pub measured: Moments,
    /// The designs that were measured beside: their names and what they give.
    pub others: Vec<(&'static str, Moments)>,
}

/// A case of bias that E names.
#[derive(Clone, Debug, Serialize)]
pub struct BiasCase {
    /// What it is.
    pub name: String,
    /// What E says of it.
    pub printed: &'static str,
    /// By enumeration.
    pub exact: String,
    /// As the design gives it.
    pub measured: String,
}

fn example_1() -> Example {
    let (red, green, blue) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    Example {
        name: "ex. 1: red over green over blue, alpha 0.45",
        layers: vec![(red, 0.45), (green, 0.45)],
        background: blue,
        samples: 4,
    }
}

fn example_2() -> Example {
    Example {
        name: "ex. 2: four white layers, alpha 0.25, over 0.25 gray",
        layers: vec![([1.0; 3], 0.25); 4],
        background: [0.25; 3],
        samples: 4,
    }
}

/// E's methods with the standard deviations that it prints for both examples.
type Printed = (&'static str, Masks, Method, [f64; 3], f64);
const METHODS: [Printed; 5] = [
    ("naive", Masks::Naive, Method::Basic, [0.25, 0.21, 0.23], 0.35),
    ("stratified", Masks::Stratified, Method::Basic, [0.10, 0.17, 0.18], 0.12),
    ("alpha correction", Masks::Stratified, Method::AlphaCorrection, [0.17, 0.14, 0.0], 0.0),
    ("depth-based", Masks::Stratified, Method::Depth, [0.0, 0.05, 0.18], 0.08),
    ("depth-based, corrected", Masks::Stratified, Method::DepthCorrection, [0.14, 0.12, 0.0], 0.0),
];

/// Both examples by every method.
pub(super) fn examples() -> Result<Vec<ExampleRow>> {
    let mut rows = Vec::new();
    for (i, example) in [example_1(), example_2()].into_iter().enumerate() {
        for (name, masks, method, printed_1, printed_2) in METHODS {
            let others = match masks {
                Masks::Naive => Vec::new(),
                Masks::Stratified => ["lk", "systematic"]
                    .into_iter()
                    .map(|design| Ok((design, measured(&example, &with(design, method))?)))
                    .collect::<Result<_>>()?,
            };
            rows.push(ExampleRow {
                example: example.name,
                method: name,
                printed: Some(if i == 0 { printed_1 } else { [printed_2; 3] }),
                exact: enumerated(&example, masks, method),
                measured: measured(&example, &spec(masks, method))?,
                others,
            });
        }
    }
    Ok(rows)
}

/// The design's name with a method.
fn with(design: &str, method: Method) -> String {
    format!("{design}:method={},opaque=together", name_of(method))
}

fn name_of(method: Method) -> &'static str {
    use screendoor_trace::param::Options;
    Method::CHOICES[method as usize].name
}

/// The design that draws masks as E has them: whatever the depth test says.
fn spec(masks: Masks, method: Method) -> String {
    let mask = match masks {
        Masks::Naive => "naive",
        Masks::Stratified => "stratified",
    };
    format!("{},among=covered,mask={mask}", with("enderton", method))
}

/// Pixels of a frame's side, and seeds, that a measured deviation is over.
const SIDE: u32 = 64;
const SEEDS: u32 = 16;

/// Mean and deviation over the pixels of a frame, seed after seed.
fn measured(example: &Example, spec: &str) -> Result<Moments> {
    let trace = whole_layers(SIDE, example.samples, example.background, &example.layers)?;
    let (mut sums, mut squares, mut count) = ([0.0; 3], [0.0; 3], 0.0);
    for picture in pictures(spec, &trace, example.samples, SEEDS)? {
        let picture = picture?;
        for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
            for (i, c) in picture.get(x, y).into_iter().enumerate() {
                sums[i] += c;
                squares[i] += c * c;
            }
            count += 1.0;
        }
    }
    Ok(moments(sums.map(|s| s / count), squares.map(|s| s / count)))
}

fn moments(mean: [f64; 3], square: [f64; 3]) -> Moments {
    let deviation = std::array::from_fn(|i| f64::max(square[i] - mean[i] * mean[i], 0.0).sqrt());
    Moments { mean, deviation }
}

/// Mean and deviation over every choice of masks, each with its probability.
pub fn enumerated(example: &Example, masks: Masks, method: Method) -> Moments {
    let (mut mean, mut square) = ([0.0; 3], [0.0; 3]);
    for_each_choice(example, masks, |chosen, probability| {
        let colour = colour(example, chosen, method);
        for i in 0..3 {
            mean[i] += probability * colour[i];
            square[i] += probability * colour[i] * colour[i];
        }
    });
    moments(mean, square)
}

/// Calls `each` with the masks of all layers and their probability.
fn for_each_choice(example: &Example, masks: Masks, mut each: impl FnMut(&[u32], f64)) {
    let count = 1_u32 << example.samples;
    let mut chosen = vec![0; example.layers.len()];
    loop {
        let of_layer = |(mask, (_, alpha)): (&u32, &Layer)| {
            probability(*mask, example.samples, f64::from(*alpha), masks)
        };
        let probability: f64 = chosen.iter().zip(&example.layers).map(of_layer).product();
        if probability > 0.0 {
            each(&chosen, probability);
        }
        // The next number in base `count`.
        let Some(digit) = chosen.iter().position(|mask| mask + 1 < count) else { return };
        chosen[digit] += 1;
        chosen[..digit].fill(0);
    }
}

/// The probability of one mask.
fn probability(mask: u32, samples: u32, alpha: f64, masks: Masks) -> f64 {
    let (ones, samples) = (mask.count_ones(), f64::from(samples));
    match masks {
        Masks::Naive => alpha.powi(ones as i32) * (1.0 - alpha).powi(samples as i32 - ones as i32),
        Masks::Stratified => {
            // ⌊αS+ξ⌋ is k with the probability 1 − |αS − k|, and all masks of k alike.
            let k = f64::from(ones);
            let of_count = (1.0 - (alpha * samples - k).abs()).max(0.0);
            let alike: f64 =
                (0..ones).map(|i| (samples - f64::from(i)) / f64::from(i + 1)).product();
            of_count / alike
        }
    }
}

/// The pixel that the masks give.
fn colour(example: &Example, chosen: &[u32], method: Method) -> [f64; 3] {
    let samples = f64::from(example.samples);
    let layers = &example.layers;
    let (mut occupied, mut sum, mut weight) = (0_u32, [0.0; 3], 0.0);
    let mut let_through = 1.0;
    for (mask, (colour, alpha)) in chosen.iter().zip(layers) {
        // Samples that the layer wins, and those that it is not behind.
        let won = f64::from((mask & !occupied).count_ones()) / samples;
        let seen = 1.0 - f64::from(occupied.count_ones()) / samples;
        let share = match method {
            Method::Basic | Method::AlphaCorrection => won,
            Method::Depth | Method::DepthCorrection => seen * f64::from(*alpha),
        };
        for (s, c) in sum.iter_mut().zip(colour) {
            *s += share * f64::from(*c);
        }
        weight += share;
        occupied |= mask;
        let_through *= 1.0 - f64::from(*alpha);
    }
    let empty = 1.0 - f64::from(occupied.count_ones()) / samples;
    let (factor, behind) = match method {
        Method::Basic | Method::Depth => (1.0, empty),
        _ if weight > 0.0 => ((1.0 - let_through) / weight, let_through),
        _ => (0.0, let_through),
    };
    std::array::from_fn(|i| factor * sum[i] + behind * f64::from(example.background[i]))
}

/// What E says of bias, enumerated and measured.
pub(super) fn bias_cases() -> Result<Vec<BiasCase>> {
    let (red, green, black) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]);
    let two = |m: Moments| format!("({:.4}, {:.4})", m.mean[0], m.mean[1]);
    let corrected = Method::AlphaCorrection;
    let thin = |samples: u32| {
        let layers = vec![(red, 0.5 / samples as f32)];
        Example { name: "", layers, background: black, samples }
    };
    let pair = Example {
        name: "",
        layers: vec![(red, 0.25), (green, 0.25)],
        background: black,
        samples: 4,
    };
    let mut cases = Vec::new();
    for samples in [4, 8] {
        let example = thin(samples);
        let part = |m: Moments| format!("{:.4} c", m.mean[0] / f64::from(example.layers[0].1));
        cases.push(BiasCase {
            name: format!(
                "alpha correction of one layer, alpha 1/(2S), S = {samples}: E(A), where C = α c"
            ),
            printed: "half of it",
            exact: part(enumerated(&example, Masks::Stratified, corrected)),
            measured: part(measured(&example, &spec(Masks::Stratified, corrected))?),
        });
    }
    cases.push(BiasCase {
        name: "alpha correction of two layers, alpha 1/4, S = 4: E(A), where C = (0.25, 0.1875)"
            .to_string(),
        printed: "(0.273, 0.164)",
        exact: two(enumerated(&pair, Masks::Stratified, corrected)),
        measured: two(measured(&pair, &spec(Masks::Stratified, corrected))?),
    });
    let first = example_1();
    cases.push(BiasCase {
        name: "depth-based, corrected, of example 1: E(D), where C = (0.45, 0.2475)".to_string(),
        printed: "not C",
        exact: two(enumerated(&first, Masks::Stratified, Method::DepthCorrection)),
        measured: two(measured(&first, &spec(Masks::Stratified, Method::DepthCorrection))?),
    });
    cases.push(BiasCase {
        name: "depth-based, uncorrected, of two layers, alpha 1/4, S = 4: E(U)".to_string(),
        printed: "C",
        exact: two(enumerated(&pair, Masks::Stratified, Method::Depth)),
        measured: two(measured(&pair, &spec(Masks::Stratified, Method::Depth))?),
    });
    cases.push(covered_total()?);
    cases.push(too_bright()?);
    Ok(cases)
}

/// E section 6: with S = 8 and two fragments of alpha 0.5, the samples covered are
/// within one of 6 in 97 percent.
fn covered_total() -> Result<BiasCase> {
    let white = [1.0; 3];
    let example =
        Example { name: "", layers: vec![(white, 0.5); 2], background: [0.0; 3], samples: 8 };
    let mut within = 0.0;
    for_each_choice(&example, Masks::Stratified, |chosen, probability| {
        let covered = (chosen[0] | chosen[1]).count_ones();
        within += if covered.abs_diff(6) <= 1 { probability } else { 0.0 };
    });
    let found = share(&example, Method::Basic, |white| (white * 8.0 - 6.0).abs() < 1.5)?;
    Ok(BiasCase {
        name: "two layers, alpha 0.5, S = 8: the samples covered are within one of 6".to_string(),
        printed: "97 percent",
        exact: format!("{:.4}", within),
        measured: plus_minus(found),
    })
}

/// More than white, but for the rounding of alphas in single precision.
const BRIGHT: f64 = 1.0 + 1e-6;

/// E section 4.2: U can exceed one.
fn too_bright() -> Result<BiasCase> {
    let example = example_2();
    let mut above = 0.0;
    for_each_choice(&example, Masks::Stratified, |chosen, probability| {
        let bright = colour(&example, chosen, Method::Depth)[0] > BRIGHT;
        above += if bright { probability } else { 0.0 };
    });
    let five = Example { layers: vec![([1.0; 3], 0.4); 5], background: [0.0; 3], ..example };
    let mut of_five = 0.0;
    for_each_choice(&five, Masks::Stratified, |chosen, probability| {
        let bright = colour(&five, chosen, Method::Depth)[0] > BRIGHT;
        of_five += if bright { probability } else { 0.0 };
    });
    let found = share(&five, Method::Depth, |white| white > BRIGHT)?;
    Ok(BiasCase {
        name: "depth-based, uncorrected: U > 1, of five white layers, alpha 0.4, S = 4 \
               (and of example 2)"
            .to_string(),
        printed: "easily",
        exact: format!("{of_five:.4} ({above:.4})"),
        measured: plus_minus(found),
    })
}

/// The share of the pixels whose first channel is as `is` says, over the seeds.
fn share(example: &Example, method: Method, is: impl Fn(f64) -> bool) -> Result<Estimate> {
    let trace = whole_layers(SIDE, example.samples, example.background, &example.layers)?;
    let mut shares = Vec::new();
    let spec = spec(Masks::Stratified, method);
    for picture in pictures(&spec, &trace, example.samples, SEEDS)? {
        let picture = picture?;
        let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        let count = pixels.filter(|(x, y)| is(picture.get(*x, *y)[0])).count();
        shares.push(count as f64 / f64::from(SIDE * SIDE));
    }
    Ok(Estimate::of(&shares))
}

fn plus_minus(e: Estimate) -> String {
    format!("{:.4} ± {:.4}", e.value, e.half_width())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_add_up_and_means_are_exact() {
        for (example, expected) in [
            (example_1(), [0.45, 0.2475, 0.3025]),
            (example_2(), [1.0 - 0.75 * 0.75_f64.powi(4); 3]),
        ] {
            for masks in [Masks::Naive, Masks::Stratified] {
                let mut sum = 0.0;
                for_each_choice(&example, masks, |_, probability| sum += probability);
                assert!((sum - 1.0).abs() < 1e-6, "{sum}");
                for method in [Method::Basic, Method::Depth] {
                    let found = enumerated(&example, masks, method).mean;
                    for (a, b) in found.iter().zip(expected) {
                        assert!((a - b).abs() < 1e-6, "{found:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn designs_give_what_enumeration_says() {
        // 65 536 pixels and seeds: deviations to about a percent; the bound is six of
        // the standard errors of a normal's deviation.
        for row in examples().unwrap() {
            for i in 0..3 {
                let (exact, found) = (row.exact.deviation[i], row.measured.deviation[i]);
                assert!((exact - found).abs() < 0.02 * exact + 1e-3, "{row:?}");
                assert!(
                    (row.exact.mean[i] - row.measured.mean[i]).abs() < 6.0 * exact / 256.0 + 1e-6
                );
            }
        }
    }
}
