//! What a program's blending leaves in its target, to the letter.

use ash::vk;
use screendoor_vulkan_layer::log::State;

use crate::format::PixelFormat;

/// What of a state cannot be done again from what is recorded.
pub(crate) fn unknown(state: &State) -> Option<&'static str> {
    let second = |factor: i32| {
        matches!(
            vk::BlendFactor::from_raw(factor),
            vk::BlendFactor::SRC1_COLOR
                | vk::BlendFactor::ONE_MINUS_SRC1_COLOR
                | vk::BlendFactor::SRC1_ALPHA
                | vk::BlendFactor::ONE_MINUS_SRC1_ALPHA
        )
    };
    let factors = [state.source, state.destination, state.source_alpha, state.destination_alpha];
    let simple = |op: i32| vk::BlendOp::from_raw(op).as_raw() <= vk::BlendOp::MAX.as_raw();
    match state {
        _ if state.stencil => Some("a stencil test"),
        _ if state.logic_op => Some("a logic operation"),
        _ if state.alpha_to_coverage => Some("alpha to coverage"),
        _ if state.blend && factors.into_iter().any(second) => Some("a second colour"),
        _ if state.blend && !(simple(state.op) && simple(state.op_alpha)) => {
            Some("an operation of an extension")
        }
        _ => None,
    }
}

/// What a sample holds after a colour is blended over what it `held`.
pub(crate) fn blend(
    state: &State,
    format: &PixelFormat,
    colour: [f32; 4],
    held: [f32; 4],
) -> [f32; 4] {
    let clamped = |colour: [f32; 4]| colour.map(|v| format.clamped(v));
    let source = clamped(colour);
    let constants = clamped(state.constants);
    let mut result = source;
    if state.blend {
        let factors =
            |factor: i32| values(vk::BlendFactor::from_raw(factor), source, held, constants);
        let [s, d] = [state.source, state.destination].map(factors);
        let [sa, da] = [state.source_alpha, state.destination_alpha].map(factors);
        for i in 0..4 {
            let (op, s, d) = match i {
                3 => (state.op_alpha, sa[3], da[3]),
                _ => (state.op, s[i], d[i]),
            };
            result[i] = match vk::BlendOp::from_raw(op) {
                vk::BlendOp::SUBTRACT => source[i] * s - held[i] * d,
                vk::BlendOp::REVERSE_SUBTRACT => held[i] * d - source[i] * s,
                vk::BlendOp::MIN => source[i].min(held[i]),
                vk::BlendOp::MAX => source[i].max(held[i]),
                _ => source[i] * s + held[i] * d,
            };
        }
    }
    let stored = format.stored(result);
    std::array::from_fn(|i| if state.mask >> i & 1 == 1 { stored[i] } else { held[i] })
}

fn values(
    factor: vk::BlendFactor,
    source: [f32; 4],
    held: [f32; 4],
    constants: [f32; 4],
) -> [f32; 4] {
    let inverse = |values: [f32; 4]| values.map(|v| 1.0 - v);
    let alpha = |values: [f32; 4]| [values[3]; 4];
    match factor {
        vk::BlendFactor::ONE => [1.0; 4],
        vk::BlendFactor::SRC_COLOR => source,
        vk::BlendFactor::ONE_MINUS_SRC_COLOR => inverse(source),
        vk::BlendFactor::DST_COLOR => held,
        vk::BlendFactor::ONE_MINUS_DST_COLOR => inverse(held),
        vk::BlendFactor::SRC_ALPHA => alpha(source),
        vk::BlendFactor::ONE_MINUS_SRC_ALPHA => inverse(alpha(source)),
        vk::BlendFactor::DST_ALPHA => alpha(held),
        vk::BlendFactor::ONE_MINUS_DST_ALPHA => inverse(alpha(held)),
        vk::BlendFactor::CONSTANT_COLOR => constants,
        vk::BlendFactor::ONE_MINUS_CONSTANT_COLOR => inverse(constants),
        vk::BlendFactor::CONSTANT_ALPHA => alpha(constants),
        vk::BlendFactor::ONE_MINUS_CONSTANT_ALPHA => inverse(alpha(constants)),
        vk::BlendFactor::SRC_ALPHA_SATURATE => {
            let least = source[3].min(1.0 - held[3]);
            [least, least, least, 1.0]
        }
        _ => [0.0; 4],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(source: vk::BlendFactor, destination: vk::BlendFactor, op: vk::BlendOp) -> State {
        State {
            blend: true,
            source: source.as_raw(),
            destination: destination.as_raw(),
            op: op.as_raw(),
            source_alpha: vk::BlendFactor::ONE.as_raw(),
            destination_alpha: vk::BlendFactor::ZERO.as_raw(),
            op_alpha: op.as_raw(),
            mask: 15,
            constants: [0.25, 0.5, 0.75, 0.125],
            ..State::default()
        }
    }

    /// In numbers of which nothing is rounded: half precision.
    #[test]
    fn factors_and_operations_are_vulkan_s() {
        use vk::{BlendFactor as F, BlendOp as Op};
        let format = PixelFormat::of(vk::Format::R16G16B16A16_SFLOAT.as_raw()).unwrap();
        let (c, held) = ([0.5, 0.25, 1.0, 0.5], [0.25, 1.0, 0.5, 0.75]);
        // By hand, of red.
        let cases = [
            (F::ONE, F::ONE, Op::ADD, 0.75),
            (F::ZERO, F::ZERO, Op::ADD, 0.0),
            (F::SRC_COLOR, F::DST_COLOR, Op::ADD, 0.25 + 0.0625),
            (F::ONE_MINUS_SRC_COLOR, F::ONE_MINUS_DST_COLOR, Op::ADD, 0.25 + 0.1875),
            (F::SRC_ALPHA, F::ONE_MINUS_SRC_ALPHA, Op::ADD, 0.25 + 0.125),
            (F::DST_ALPHA, F::ONE_MINUS_DST_ALPHA, Op::ADD, 0.375 + 0.0625),
            (F::CONSTANT_COLOR, F::ONE_MINUS_CONSTANT_COLOR, Op::ADD, 0.125 + 0.1875),
            (F::CONSTANT_ALPHA, F::ONE_MINUS_CONSTANT_ALPHA, Op::ADD, 0.0625 + 0.21875),
            (F::SRC_ALPHA_SATURATE, F::ZERO, Op::ADD, 0.125),
            (F::ONE, F::ONE, Op::SUBTRACT, 0.25),
            (F::ONE, F::ONE, Op::REVERSE_SUBTRACT, -0.25),
            (F::ZERO, F::ZERO, Op::MIN, 0.25),
            (F::ZERO, F::ZERO, Op::MAX, 0.5),
        ];
        for (source, destination, op, expected) in cases {
            let found = blend(&state(source, destination, op), &format, c, held);
            assert_eq!(found[0], expected, "{source:?} {destination:?} {op:?}");
        }
        let found = blend(&state(F::ONE, F::ONE, Op::ADD), &format, c, held);
        assert_eq!(found[3], 0.5, "alpha has factors of its own");
        let masked = State { mask: 2, ..state(F::ONE, F::ONE, Op::ADD) };
        assert_eq!(blend(&masked, &format, c, held), [0.25, 1.25, 0.5, 0.75]);
    }

    #[test]
    fn targets_of_8_bits_clamp_and_round() {
        let format = PixelFormat::of(vk::Format::R8G8B8A8_UNORM.as_raw()).unwrap();
        let plain = State { mask: 15, ..State::default() };
        let found = blend(&plain, &format, [2.0, -1.0, 0.5, f32::NAN], [0.0; 4]);
        assert_eq!(found, [1.0, 0.0, 128.0 / 255.0, 0.0]);
    }

    #[test]
    fn what_is_not_recorded_is_named() {
        use vk::{BlendFactor as F, BlendOp as Op};
        assert_eq!(unknown(&state(F::ONE, F::ONE, Op::MAX)), None);
        assert!(unknown(&state(F::ONE, F::SRC1_ALPHA, Op::ADD)).is_some());
        assert!(unknown(&state(F::ONE, F::ONE, Op::MULTIPLY_EXT)).is_some());
        assert!(unknown(&State { stencil: true, ..State::default() }).is_some());
    }
}
