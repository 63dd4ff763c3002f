//! A design in the registry, and one with its parameters set.

use std::fmt;
use std::sync::Arc;

use crate::DESIGNS;
use screendoor_rop::fast::{Count, Width};
use screendoor_rop::stochastic::draws_opaque_first;
use screendoor_rop::view_depth::asks_for_view;
use screendoor_rop::{
    Blueprint, ExplainLimits, Explanation, Frame, Implementation, Info, Layout, Port,
    PrimitiveDepths, Promises, ReplayOptions, Replayed, Site, StateBits, TiledDesign,
    VisibilityMap, explain, replay,
};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Values;
use screendoor_trace::trace::{ColumnSet, Trace};

/// A design in the registry. The types behind it are known here and nowhere
/// else: one dynamic call a replay, none a fragment.
#[derive(Clone, Copy)]
pub struct Entry {
    /// What a listing says about it.
    pub info: Info,
    promises: fn(&Values) -> Promises,
    build: fn(&Values, &Frame, Implementation) -> Result<Box<dyn TiledDesign>>,
    port: fn(&Values, &Frame) -> Result<Option<Port>>,
    ported: bool,
    /// Whether the frame must hold the primitives' mean depths.
    primitive_depths: bool,
    /// The optional columns that are read.
    columns: ColumnSet,
    /// Whether it tells its multiplications.
    multiplications: bool,
}

/// Calls a function with the frame's sample count as a constant.
macro_rules! for_samples {
    ($samples:expr, $f:ident::<$b:ident>($($argument:expr),*)) => {
        match $samples {
            1 => $f::<$b, 1>($($argument),*),
            2 => $f::<$b, 2>($($argument),*),
            4 => $f::<$b, 4>($($argument),*),
            8 => $f::<$b, 8>($($argument),*),
            16 => $f::<$b, 16>($($argument),*),
            32 => $f::<$b, 32>($($argument),*),
            64 => $f::<$b, 64>($($argument),*),
            n => Err(Error::config(
                format_args!("a pixel cannot have {n} samples"),
                "samples are 1, 2, 4, 8, 16, 32 or 64",
            )),
        }
    };
}

impl Entry {
    /// The entry of a design.
    pub const fn of<B: Blueprint>() -> Self {
        fn build_at<B: Blueprint, const N: usize>(
            values: &Values,
            frame: &Frame,
            implementation: Implementation,
        ) -> Result<Box<dyn TiledDesign>>
        where
            Count<N>: Width,
        {
            let fast = match implementation.level()? {
                Some(level) => B::fast::<N>(values, frame, level)?,
                None => None,
            };
            match fast {
                Some(engine) => Ok(engine),
                None => Ok(Box::new(B::at::<N>(values, frame)?)),
            }
        }
        fn port_at<B: Blueprint, const N: usize>(
            values: &Values,
            frame: &Frame,
        ) -> Result<Option<Port>> {
            B::port::<N>(values, frame)
        }
        Entry {
            info: B::INFO,
            promises: B::promises,
            build: |values, frame, implementation| {
                for_samples!(frame.samples(), build_at::<B>(values, frame, implementation))
            },
            port: |values, frame| for_samples!(frame.samples(), port_at::<B>(values, frame)),
            ported: B::PORTED,
            primitive_depths: B::PRIMITIVE_DEPTHS,
            columns: B::COLUMNS,
            multiplications: B::MULTIPLICATIONS,
        }
    }

    /// Whether the design has a port to GPUs.
    pub fn is_ported(&self) -> bool {
        self.ported
    }

    /// Whether the design draws in an order that the application finds.
    pub fn asks_for_primitive_depths(&self) -> bool {
        self.primitive_depths
    }

    /// The design with the settings `given` over its defaults.
    ///
    /// # Errors
    /// As [`Values::resolve`].
    pub fn configure(&self, given: &[(String, String)]) -> Result<Configured> {
        let values = Values::resolve(self.info.name, self.info.params, given)?;
        Ok(Configured { entry: *self, values })
    }
}

impl fmt::Debug for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Entry({})", self.info.name)
    }
}

/// A design with its parameters set.
#[derive(Clone, Debug)]
pub struct Configured {
    entry: Entry,
    values: Values,
}

impl Configured {
    /// What a listing says about the design.
    pub fn info(&self) -> &Info {
        &self.entry.info
    }

    /// Its parameters.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// Name and the parameters that differ from their defaults: `lk:sort=false`.
    pub fn label(&self) -> String {
        let changes = self.values.changes(self.entry.info.params);
        let separator = if changes.is_empty() { "" } else { ":" };
        format!("{}{separator}{changes}", self.entry.info.name)
    }

    /// Whether it has a port to GPUs.
    pub fn is_ported(&self) -> bool {
        self.entry.ported
    }

    /// What it promises.
    pub fn promises(&self) -> Promises {
        (self.entry.promises)(&self.values)
    }

    /// Whether it takes view depths from the trace's view, and refuses a trace that has none.
    pub fn asks_for_view(&self) -> bool {
        asks_for_view(&self.values)
    }

    /// Replays `trace` at `samples` samples per pixel.
    ///
    /// # Errors
    /// As [`screendoor_rop::replay`] and [`Frame::of`].
    pub fn replay(
        &self,
        trace: &Trace,
        samples: u32,
        seed: u32,
        options: &ReplayOptions<'_>,
    ) -> Result<Replayed> {
        let frame = self.frame_within(trace, samples, seed, options.memory)?;
        let design = self.build(&frame, options.implementation)?;
        let mut replayed = replay(&*design, &frame, trace, options)?;
        if let Some(events) = replayed.events.as_mut().filter(|_| !self.entry.multiplications) {
            events.multiplications = None;
        }
        Ok(replayed)
    }

    /// Draws `trace`, a light's, to be asked how much light reaches a depth.
    ///
    /// # Errors
    /// [`Error::Config`] where the design's state does not tell that; as [`VisibilityMap::draw`] and [`Frame::of`].
    pub fn visibility_map(
        &self,
        trace: &Trace,
        samples: u32,
        seed: u32,
        options: &ReplayOptions<'_>,
    ) -> Result<VisibilityMap> {
        let frame = self.frame_within(trace, samples, seed, options.memory)?;
        for implementation in [options.implementation, Implementation::Reference] {
            let design = self.build(&frame, implementation)?;
            if VisibilityMap::answers(&*design, &frame) {
                return VisibilityMap::draw(design, &frame, trace, options);
            }
        }
        let tells = |entry: &&Entry| {
            let plain =
                entry.configure(&[]).and_then(|d| d.build(&frame, Implementation::Reference));
            plain.is_ok_and(|design| VisibilityMap::answers(&*design, &frame))
        };
        let names: Vec<&str> = DESIGNS.iter().filter(tells).map(|e| e.info.name).collect();
        Err(Error::config(
            format_args!(
                "what '{}' keeps does not tell how much light reaches a depth",
                self.label()
            ),
            format_args!("these designs tell it: {}", names.join(", ")),
        ))
    }

    /// The design as a GPU runs it.
    ///
    /// # Errors
    /// [`Error::Config`] where it has no port; as [`Blueprint::at`].
    pub fn port(&self, frame: &Frame) -> Result<Port> {
        (self.entry.port)(&self.values, frame)?.ok_or_else(|| {
            let ported = DESIGNS.iter().filter(|e| e.ported).map(|e| e.info.name);
            Error::config(
                format_args!("'{}' has no port to GPUs", self.info().name),
                format_args!(
                    "replay it with --engine fast; {} have one",
                    ported.collect::<Vec<_>>().join(", ")
                ),
            )
        })
    }

    /// Replays one pixel and writes down what happens.
    ///
    /// # Errors
    /// As [`Configured::explain_within`].
    pub fn explain(
        &self,
        trace: &Trace,
        samples: u32,
        seed: u32,
        site: Site,
        progress: &dyn Fn(u64, u64),
    ) -> Result<Explanation> {
        self.explain_within(trace, samples, seed, site, ExplainLimits::default(), progress)
    }

    /// Replays one pixel and writes down what happens, within what `limits` allow.
    ///
    /// # Errors
    /// As [`screendoor_rop::explain`] and [`Frame::of`]; [`Error::Config`] for a pixel
    /// outside the frame.
    pub fn explain_within(
        &self,
        trace: &Trace,
        samples: u32,
        seed: u32,
        site: Site,
        limits: ExplainLimits,
        progress: &dyn Fn(u64, u64),
    ) -> Result<Explanation> {
        let frame = self.frame_within(trace, samples, seed, limits.memory)?;
        if !frame.grid.contains((site.x.into(), site.y.into())) {
            return Err(Error::config(
                format_args!("pixel {},{} lies outside the frame", site.x, site.y),
                format_args!("it is {}x{} pixels", frame.grid.width(), frame.grid.height()),
            ));
        }
        explain(
            &*self.build(&frame, Implementation::Reference)?,
            &frame,
            trace,
            site,
            limits,
            progress,
        )
    }

    /// What a pixel holds, at the sample count of `frame`.
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    pub fn layout(&self, frame: &Frame) -> Result<Layout> {
        Ok(self.build(frame, Implementation::Reference)?.layout())
    }

    /// State per pixel at the sample count of `frame`.
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    pub fn state_bits(&self, frame: &Frame) -> Result<StateBits> {
        Ok(self.build(frame, Implementation::Reference)?.state_bits())
    }

    /// The frame, with what the design asks to know of the whole trace beforehand.
    ///
    /// # Errors
    /// As [`Frame::of`] and [`Trace::batch`].
    pub fn frame(&self, trace: &Trace, samples: u32, seed: u32) -> Result<Frame> {
        self.frame_within(trace, samples, seed, ReplayOptions::default().memory)
    }

    /// As [`Configured::frame`]; what it knows of the trace takes at most `memory` bytes.
    ///
    /// # Errors
    /// As [`Frame::of`] and [`Trace::batch`]; [`Error::Config`] where it takes more.
    pub(crate) fn frame_within(
        &self,
        trace: &Trace,
        samples: u32,
        seed: u32,
        memory: u64,
    ) -> Result<Frame> {
        let mut frame = Frame::of(trace, samples, seed)?;
        if draws_opaque_first(&self.values) {
            frame.opaque = trace.has_opaque()?;
        }
        if self.entry.primitive_depths {
            frame.primitive_depths = Some(Arc::new(PrimitiveDepths::of(trace, memory)?));
        }
        frame.columns = self.entry.columns;
        Ok(frame)
    }

    /// The design for the frame.
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    pub fn build(
        &self,
        frame: &Frame,
        implementation: Implementation,
    ) -> Result<Box<dyn TiledDesign>> {
        (self.entry.build)(&self.values, frame, implementation)
    }
}
