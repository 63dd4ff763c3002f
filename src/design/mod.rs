//! The designs, one file each, and their registry.

mod blend;
mod enderton;
mod exact;
mod lk;
mod mboit;
mod sorted_blend;
mod wboit;

use std::fmt;

pub use blend::Blend;
pub use enderton::Enderton;
pub use exact::Exact;
pub use lk::LaineKarras;
pub use mboit::MomentBased;
pub use sorted_blend::SortedBlend;
pub use wboit::WeightedBlended;

use crate::error::{Error, Result};
use crate::param::{Values, parse_spec};
use crate::rop::Design as _;
use crate::rop::{
    Blueprint, Explanation, Frame, Info, Promises, ReplayOptions, Replayed, Site, StateBits,
    explain, replay,
};
use crate::trace::Trace;

/// All designs. A static: a constant would be compiled anew, for every sample count,
/// into each crate that names it.
pub static DESIGNS: &[Entry] = &[
    Entry::of::<Exact>(),
    Entry::of::<LaineKarras>(),
    Entry::of::<Enderton>(),
    Entry::of::<Blend>(),
    Entry::of::<SortedBlend>(),
    Entry::of::<WeightedBlended>(),
    Entry::of::<MomentBased>(),
];

/// The name of the design that others are measured against.
pub const REFERENCE: &str = Exact::INFO.name;

/// A design in the registry. The types behind it are known here and nowhere
/// else: one dynamic call a replay, none a fragment.
#[derive(Clone, Copy)]
pub struct Entry {
    /// What a listing says about it.
    pub info: Info,
    promises: fn(&Values) -> Promises,
    replay: fn(&Values, &Frame, &Trace, &ReplayOptions<'_>) -> Result<Replayed>,
    explain: ExplainFn,
    state_bits: fn(&Values, &Frame) -> Result<StateBits>,
}

type ExplainFn = fn(&Values, &Frame, &Trace, Site, &dyn Fn(u64, u64)) -> Result<Explanation>;

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
        fn replay_at<B: Blueprint, const N: usize>(
            values: &Values,
            frame: &Frame,
            trace: &Trace,
            options: &ReplayOptions<'_>,
        ) -> Result<Replayed> {
            replay(&B::at::<N>(values, &frame.prepared::<B>(trace)?)?, frame, trace, options)
        }
        fn explain_at<B: Blueprint, const N: usize>(
            values: &Values,
            frame: &Frame,
            trace: &Trace,
            site: Site,
            progress: &dyn Fn(u64, u64),
        ) -> Result<Explanation> {
            let design = B::at::<N>(values, &frame.prepared::<B>(trace)?)?;
            explain(&design, frame, trace, site, progress)
        }
        fn state_bits_at<B: Blueprint, const N: usize>(
            values: &Values,
            frame: &Frame,
        ) -> Result<StateBits> {
            Ok(B::at::<N>(values, frame)?.state_bits())
        }
        Entry {
            info: B::INFO,
            promises: B::promises,
            replay: |values, frame, trace, options| {
                for_samples!(frame.samples(), replay_at::<B>(values, frame, trace, options))
            },
            explain: |values, frame, trace, site, progress| {
                for_samples!(frame.samples(), explain_at::<B>(values, frame, trace, site, progress))
            },
            state_bits: |values, frame| {
                for_samples!(frame.samples(), state_bits_at::<B>(values, frame))
            },
        }
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

    /// What it promises.
    pub fn promises(&self) -> Promises {
        (self.entry.promises)(&self.values)
    }

    /// Replays `trace` at `samples` samples per pixel.
    ///
    /// # Errors
    /// As [`crate::rop::replay`] and [`Frame::of`].
    pub fn replay(
        &self,
        trace: &Trace,
        samples: u32,
        seed: u32,
        options: &ReplayOptions<'_>,
    ) -> Result<Replayed> {
        (self.entry.replay)(&self.values, &Frame::of(trace, samples, seed)?, trace, options)
    }

    /// Replays one pixel and writes down what happens.
    ///
    /// # Errors
    /// As [`crate::rop::explain`] and [`Frame::of`]; [`Error::Config`] for a pixel
    /// outside the frame.
    pub fn explain(
        &self,
        trace: &Trace,
        samples: u32,
        seed: u32,
        site: Site,
        progress: &dyn Fn(u64, u64),
    ) -> Result<Explanation> {
        let frame = Frame::of(trace, samples, seed)?;
        if !frame.grid.contains((site.x.into(), site.y.into())) {
            return Err(Error::config(
                format_args!("pixel {},{} lies outside the frame", site.x, site.y),
                format_args!("it is {}x{} pixels", frame.grid.width(), frame.grid.height()),
            ));
        }
        (self.entry.explain)(&self.values, &frame, trace, site, progress)
    }

    /// State per pixel at the sample count of `frame`.
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    pub fn state_bits(&self, frame: &Frame) -> Result<StateBits> {
        (self.entry.state_bits)(&self.values, frame)
    }
}

/// The design that `spec` names, `NAME` or `NAME:key=value,…`, with `more`
/// settings after those of the spec.
///
/// # Errors
/// [`Error::Config`] for an unknown design or parameter, naming the nearest.
pub fn configure(spec: &str, more: &[(String, String)]) -> Result<Configured> {
    let (name, mut given) = parse_spec(spec)?;
    let Some(entry) = DESIGNS.iter().find(|e| e.info.name == name) else {
        return Err(Error::unknown("design", name, DESIGNS.iter().map(|e| e.info.name)));
    };
    given.extend_from_slice(more);
    entry.configure(&given)
}
