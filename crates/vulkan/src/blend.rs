//! From what a program's draw does to its target to what a trace can say of it: a colour over
//! what is there, with an opacity.
//!
//! A blend adds the shader's colour times one factor to what is there times another. It can be
//! said where the second is a number t that what is there does not decide: alpha is then
//! 1 − t, and the colour is what is added, divided by alpha.

use ash::vk;
use screendoor_vulkan_layer::log::{Draw, Pass, State};

use crate::folder::DeviceCapture;
use crate::format::{Kind, PixelFormat, name};

/// Fragments of a smaller alpha are not recorded: half a step of 16 bits, which a shader would
/// discard.
pub(crate) const LEAST_ALPHA: f64 = 0.5 / 65535.0;

/// By how much channels of what is taken for grey may differ: less than half a step of 8 bits.
const GREY: f64 = 1.0 / 512.0;

/// What becomes of a draw's fragments.
#[derive(Clone, Debug)]
pub(crate) struct Rule {
    format: PixelFormat,
    what: What,
}

#[derive(Clone, Copy, Debug)]
enum What {
    /// No colour is written: depth alone.
    Depth,
    Opaque,
    Blend {
        source: Factor,
        /// One minus the factor of what is there.
        alpha: Factor,
        constants: [f32; 4],
    },
}

/// What becomes of one fragment.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Outcome {
    /// A colour and an alpha.
    Seen([f64; 3], f64),
    /// It changes nothing.
    Transparent,
    /// It adds light, and holds none back.
    Additive,
    /// Its channels have alphas of their own.
    Coloured,
    /// Its alpha is not 0 to 1.
    Beyond,
}

/// A factor that what is there does not decide.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Factor {
    of: Of,
    /// One minus it.
    inverse: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Of {
    Zero,
    Colour,
    Alpha,
    Constant,
    ConstantAlpha,
}

impl Factor {
    fn of(factor: vk::BlendFactor) -> Option<Self> {
        let (of, inverse) = match factor {
            vk::BlendFactor::ZERO => (Of::Zero, false),
            vk::BlendFactor::ONE => (Of::Zero, true),
            vk::BlendFactor::SRC_COLOR => (Of::Colour, false),
            vk::BlendFactor::ONE_MINUS_SRC_COLOR => (Of::Colour, true),
            vk::BlendFactor::SRC_ALPHA => (Of::Alpha, false),
            vk::BlendFactor::ONE_MINUS_SRC_ALPHA => (Of::Alpha, true),
            vk::BlendFactor::CONSTANT_COLOR => (Of::Constant, false),
            vk::BlendFactor::ONE_MINUS_CONSTANT_COLOR => (Of::Constant, true),
            vk::BlendFactor::CONSTANT_ALPHA => (Of::ConstantAlpha, false),
            vk::BlendFactor::ONE_MINUS_CONSTANT_ALPHA => (Of::ConstantAlpha, true),
            _ => return None,
        };
        Some(Factor { of, inverse })
    }

    fn opposite(self) -> Self {
        Factor { inverse: !self.inverse, ..self }
    }

    fn values(self, colour: [f64; 4], constants: [f64; 4]) -> [f64; 3] {
        let [r, g, b, a] = colour;
        let values = match self.of {
            Of::Zero => [0.0; 3],
            Of::Colour => [r, g, b],
            Of::Alpha => [a; 3],
            Of::Constant => [constants[0], constants[1], constants[2]],
            Of::ConstantAlpha => [constants[3]; 3],
        };
        if self.inverse { values.map(|v| 1.0 - v) } else { values }
    }
}

/// Colour channels among `VkColorComponentFlags`.
const COLOURS: u32 = 7;

/// What becomes of a draw's fragments in a trace of what its pass draws into.
///
/// # Errors
/// Why a trace cannot have them.
pub(crate) fn rule(capture: &DeviceCapture, pass: &Pass, draw: &Draw) -> Result<Rule, String> {
    let Some(colour) = &pass.colour else { return Err("it draws no colour".to_string()) };
    let image = &capture.images[&colour.image];
    let pipeline = &capture.pipelines[&draw.pipeline];
    let Some(format) = PixelFormat::of(colour.format) else {
        return Err(format!("its target's format {} is not known", name(colour.format)));
    };
    let mask = draw.state.mask & format.mask() & COLOURS;
    if mask == 0 {
        return Ok(Rule { format, what: What::Depth });
    }
    for refused in [&draw.refused, &pipeline.refused] {
        if !refused.is_empty() {
            return Err(refused.clone());
        }
    }
    if format.kind == Kind::Integer {
        return Err(format!("its target holds whole numbers ({})", name(colour.format)));
    }
    if pass.layers > 1 {
        return Err(format!("it draws into {} layers or views at once", pass.layers));
    }
    if pipeline.samples > image.samples {
        let (drawn, held) = (pipeline.samples, image.samples);
        return Err(format!("it draws {drawn} samples a pixel into an image of {held}"));
    }
    let what = what(&draw.state, &format)?;
    if !matches!(what, What::Depth) && mask != format.mask() & COLOURS {
        return Err(format!("it writes {} alone", channels(mask)));
    }
    Ok(Rule { format, what })
}

fn channels(mask: u32) -> String {
    let names = [(1, "red"), (2, "green"), (4, "blue")];
    let some: Vec<&str> = names.iter().filter(|(bit, _)| mask & bit != 0).map(|n| n.1).collect();
    some.join(" and ")
}

fn what(state: &State, format: &PixelFormat) -> Result<What, String> {
    let refused = |what: &str| Err(what.to_string());
    if state.stencil {
        return refused("a stencil test may hide parts of it");
    }
    if state.logic_op && matches!(format.kind, Kind::Unorm | Kind::Snorm) {
        return refused("it combines bits (a logic operation)");
    }
    if state.alpha_to_coverage {
        return refused("alpha becomes coverage (alpha to coverage)");
    }
    if !state.blend {
        return Ok(What::Opaque);
    }
    let op = vk::BlendOp::from_raw(state.op);
    if op != vk::BlendOp::ADD {
        return Err(format!("it blends by {op:?}"));
    }
    let raw = [state.source, state.destination].map(vk::BlendFactor::from_raw);
    let factors = || format!("it blends by {:?}, {:?}", raw[0], raw[1]);
    let [Some(source), Some(destination)] = raw.map(Factor::of) else {
        return Err(format!("{}: what is there decides, or a second colour", factors()));
    };
    let one = Factor { of: Of::Zero, inverse: true };
    if destination == one {
        // Nothing is held back.
        return match source {
            Factor { of: Of::Zero, inverse: false } => Ok(What::Depth),
            _ => Err(format!("{}: it adds light", factors())),
        };
    }
    let constants = state.constants.map(|v| format.clamped(v));
    let [r, g, b, _] = constants.map(f64::from);
    if destination.of == Of::Constant && grey(format, [r, g, b]).is_none() {
        return Err(format!("{}: each channel has an alpha of its own", factors()));
    }
    if source == one && destination.opposite() == one {
        return Ok(What::Opaque);
    }
    Ok(What::Blend { source, alpha: destination.opposite(), constants })
}

impl Rule {
    /// Whether no colour is written.
    pub(crate) fn is_depth_alone(&self) -> bool {
        matches!(self.what, What::Depth)
    }

    /// What becomes of a fragment of a colour, which is finite.
    pub(crate) fn apply(&self, colour: [f32; 4]) -> Outcome {
        let colour = colour.map(|v| f64::from(self.format.clamped(v)));
        let [r, g, b, _] = colour;
        let rgb = self.present([r, g, b]);
        let (source, alpha, constants) = match self.what {
            What::Depth => return Outcome::Transparent,
            What::Opaque => return Outcome::Seen(rgb, 1.0),
            What::Blend { source, alpha, constants } => (source, alpha, constants.map(f64::from)),
        };
        let shares = alpha.values(colour, constants);
        let Some(share) = grey(&self.format, shares) else { return Outcome::Coloured };
        if !(0.0..=1.0).contains(&share) {
            return Outcome::Beyond;
        }
        let factors = source.values(colour, constants);
        let added = [0, 1, 2].map(|i| rgb[i] * factors[i]);
        if share < LEAST_ALPHA {
            // What rounding leaves of a transparent colour adds nothing.
            let is_light = added.iter().any(|v| v.abs() > 2.0 * LEAST_ALPHA);
            return if is_light { Outcome::Additive } else { Outcome::Transparent };
        }
        // Not multiplied and divided again, so that it stays what it is.
        let seen =
            if source == alpha && factors == [share; 3] { rgb } else { added.map(|v| v / share) };
        Outcome::Seen(seen, share)
    }

    /// Only the channels that the target has; others are 0.
    fn present(&self, rgb: [f64; 3]) -> [f64; 3] {
        let mask = self.format.mask();
        [0, 1, 2].map(|i| if mask >> i & 1 == 1 { rgb[i] } else { 0.0 })
    }
}

/// The number that all channels have, where it is one.
fn grey(format: &PixelFormat, values: [f64; 3]) -> Option<f64> {
    let mask = format.mask();
    let mut there = (0..3).filter(|i| mask >> i & 1 == 1).map(|i| values[i]);
    let (low, high) =
        there.clone().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    let middle = if mask >> 1 & 1 == 1 { values[1] } else { there.next_back()? };
    (high - low <= GREY).then_some(middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNORM: vk::Format = vk::Format::R8G8B8A8_UNORM;

    fn state(source: vk::BlendFactor, destination: vk::BlendFactor) -> State {
        State {
            blend: true,
            source: source.as_raw(),
            destination: destination.as_raw(),
            mask: 15,
            constants: [0.5, 0.5, 0.5, 0.25],
            ..State::default()
        }
    }

    fn of(state: &State, format: vk::Format) -> Result<Rule, String> {
        let format = PixelFormat::of(format.as_raw()).unwrap();
        what(state, &format).map(|what| Rule { format, what })
    }

    fn near(found: Outcome, colour: [f64; 3], alpha: f64) {
        let Outcome::Seen(c, a) = found else { panic!("{found:?}") };
        let same = (0..3).all(|i| (c[i] - colour[i]).abs() < 1e-7) && (a - alpha).abs() < 1e-7;
        assert!(same, "{found:?}, not {colour:?} {alpha}");
    }

    #[test]
    fn what_is_over_what_is_there_has_a_colour_and_an_alpha() {
        use vk::BlendFactor as F;
        let c = [0.5, 0.25, 0.125, 0.5];
        let rgb = [0.5, 0.25, 0.125];
        let cases = [
            (F::ONE, F::ZERO, rgb, 1.0),
            (F::SRC_ALPHA, F::ONE_MINUS_SRC_ALPHA, rgb, 0.5),
            (F::ONE, F::ONE_MINUS_SRC_ALPHA, [1.0, 0.5, 0.25], 0.5),
            (F::CONSTANT_ALPHA, F::ONE_MINUS_CONSTANT_ALPHA, rgb, 0.25),
            (F::CONSTANT_COLOR, F::ONE_MINUS_CONSTANT_COLOR, rgb, 0.5),
            (F::ZERO, F::ONE_MINUS_SRC_ALPHA, [0.0; 3], 0.5),
            (F::SRC_ALPHA, F::ZERO, [0.25, 0.125, 0.0625], 1.0),
        ];
        for (source, destination, colour, alpha) in cases {
            let rule = of(&state(source, destination), UNORM).unwrap();
            near(rule.apply(c), colour, alpha);
        }
        // Text: the shader gives coverage, the constant its colour.
        let mut text = state(F::CONSTANT_COLOR, F::ONE_MINUS_SRC_COLOR);
        text.constants = [0.75, 0.5, 0.25, 1.0];
        let rule = of(&text, UNORM).unwrap();
        near(rule.apply([0.25; 4]), [0.75, 0.5, 0.25], 0.25);
        assert_eq!(rule.apply([0.25, 0.3, 0.25, 1.0]), Outcome::Coloured);
        // A constant's channels are alike in all fragments of a draw, or in none.
        text.destination = F::ONE_MINUS_CONSTANT_COLOR.as_raw();
        assert!(of(&text, UNORM).unwrap_err().contains("an alpha of its own"));
    }

    #[test]
    fn what_holds_no_light_back_is_transparent_or_additive() {
        use vk::BlendFactor as F;
        let premultiplied = of(&state(F::ONE, F::ONE_MINUS_SRC_ALPHA), UNORM).unwrap();
        assert_eq!(premultiplied.apply([0.0, 0.0, 0.0, 0.0]), Outcome::Transparent);
        assert_eq!(premultiplied.apply([0.1, 0.0, 0.0, 0.0]), Outcome::Additive);
        let over = of(&state(F::SRC_ALPHA, F::ONE_MINUS_SRC_ALPHA), UNORM).unwrap();
        assert_eq!(over.apply([0.1, 0.0, 0.0, 0.0]), Outcome::Transparent);
        assert!(of(&state(F::ZERO, F::ONE), UNORM).unwrap().is_depth_alone());
        for (source, destination) in
            [(F::ONE, F::ONE), (F::DST_COLOR, F::ZERO), (F::SRC1_ALPHA, F::ONE_MINUS_SRC1_ALPHA)]
        {
            let why = of(&state(source, destination), UNORM).unwrap_err();
            let names = format!("{source:?}, {destination:?}");
            assert!(why.contains(&names), "{why}");
        }
        let mut least = state(F::ONE, F::ONE);
        least.op = vk::BlendOp::MIN.as_raw();
        assert_eq!(of(&least, UNORM).unwrap_err(), "it blends by MIN");
    }

    #[test]
    fn numbers_are_clamped_as_the_target_clamps_them() {
        use vk::BlendFactor as F;
        let over = state(F::SRC_ALPHA, F::ONE_MINUS_SRC_ALPHA);
        near(of(&over, UNORM).unwrap().apply([2.0, -1.0, 0.5, 3.0]), [1.0, 0.0, 0.5], 1.0);
        let float = of(&over, vk::Format::R16G16B16A16_SFLOAT).unwrap();
        near(float.apply([2.0, -1.0, 0.5, 0.5]), [2.0, -1.0, 0.5], 0.5);
        assert_eq!(float.apply([2.0, -1.0, 0.5, 1.5]), Outcome::Beyond);
        // A target of one channel has no others.
        near(of(&over, vk::Format::R8_UNORM).unwrap().apply([0.5; 4]), [0.5, 0.0, 0.0], 0.5);
    }

    #[test]
    fn what_a_trace_cannot_say_is_refused() {
        let good = State { mask: 15, ..State::default() };
        assert!(of(&good, UNORM).is_ok());
        let stencil = State { stencil: true, ..good.clone() };
        let logic = State { logic_op: true, ..good.clone() };
        let to_coverage = State { alpha_to_coverage: true, ..good };
        for (state, says) in [(stencil, "stencil"), (logic, "logic"), (to_coverage, "coverage")] {
            assert!(of(&state, UNORM).unwrap_err().contains(says));
        }
        assert_eq!(channels(5), "red and blue");
    }
}
