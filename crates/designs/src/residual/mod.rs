//! Stochastic transparency that knows what its samples are wrong by: screendoor's own.
//!
//! What a pixel shows is linear in what its samples hold: a fragment in front takes its share
//! of all that lies behind it, whatever that is. So the error that chance makes, what the
//! samples hold less what they would hold on average, fades behind later fragments as the
//! picture does, and can be kept in an accumulator of its own and taken away in the end: a
//! control variate. Its mean is 0, and the picture stays unbiased, as long as nothing that
//! the accumulator is faded by depends on chance: not on which samples passed, only on the
//! fragments. `docs/RESIDUAL.md` has the derivation.

mod choice;
mod draw;
mod errors;
#[cfg(test)]
mod tests;

use screendoor_rop::tracked::SORT;
use screendoor_rop::{
    Blueprint, ColourStore, Family, Frame, Info, OpaquePromise, OrderPromise, Promise, Promises,
    Reference, colour, depth_bits,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};

use choice::{Choice, Drawn};
pub use draw::ResidualAt;
use errors::{Format, Parts, Width};

const LAYERS: Typed<i64> =
    Typed::integer("layers", "1", (1, 8), "at how many depths errors are kept");
const PER: Typed<Parts> = Typed::choice("per", "pixel", "for what part of a pixel");
const ERRORS: Typed<Width> = Typed::choice("errors", "32", "bits of each channel of an error");
const DRAWN: Typed<Drawn> = Typed::choice("drawn", "paired", "how samples are chosen");
const REFERENCE: Typed<Reference> =
    Typed::choice("reference", "lk2011", "how reference values are made (drawn=hashed)");

/// The design's entry in the registry.
pub struct Residual;

impl Blueprint for Residual {
    const INFO: Info = Info {
        name: "residual",
        family: Family::Stochastic,
        summary: "samples less the error that chance made, which fades as they do: a control variate",
        citation: "screendoor's own (docs/RESIDUAL.md), after Laine, Karras 2011",
        params: &[
            LAYERS.param,
            PER.param,
            ERRORS.param,
            DRAWN.param,
            REFERENCE.param,
            SORT.param,
            depth_bits::PARAM.param,
            colour::PARAM.param,
        ],
        combinations: &["layers=4,per=sample", "layers=2,drawn=hashed,sort=false"],
    };

    type At<const N: usize> = ResidualAt<N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<ResidualAt<N>> {
        Ok(ResidualAt {
            frame: frame.clone(),
            room: values.get(LAYERS) as usize,
            format: Format::new(values.get(PER), values.get(ERRORS), N as u32),
            choice: Choice::new(values.get(DRAWN), values.get(REFERENCE)),
            sort: values.get(SORT),
            depth_bits: depth_bits::of(values),
            colour: ColourStore::of(values, frame),
        })
    }

    fn promises(values: &Values) -> Promises {
        let scrambled = values.get(DRAWN) == Drawn::Paired || values.get(REFERENCE).scrambles();
        let apart = depth_bits::tells_apart(values);
        Promises {
            // To 16 bits errors are rounded to the nearest value.
            unbiased: Promise::always_if(apart && scrambled && values.get(ERRORS) != Width::Narrow),
            consistent: Promise::always_if(apart && scrambled),
            order: OrderPromise::Dependent,
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        }
    }
}
