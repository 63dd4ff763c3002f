//! The methods on a device.

use crate::contract::frame::{Frame, Site};
use crate::contract::info::Info;
use crate::contract::port::{Port, of_parameters};
use crate::contract::samples::Samples;
use crate::contract::shader::Shader;
use crate::contract::words::{Constant, Declaration, OnDevice, PixelWords};
use crate::stochastic::methods::{
    METHOD, Methods, MethodsPixel, MethodsSums, STRATA, Sampler, Stochastic,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Param, Values};
use screendoor_trace::trace::SampleMask;

/// The port of a design made by [`with_methods`](super::with_methods): without sums, a device resolves it, and
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

/// The port of a design made by [`single_pass`](super::single_pass): the parameters that it does not have are what
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
