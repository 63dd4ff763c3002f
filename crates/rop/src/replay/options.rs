//! How to replay a trace.

use fearless_simd::Level;

use crate::lanes::levels;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Options;

screendoor_trace::options! {
    /// Which of a design's implementations draws; they give the same bits.
    pub enum Implementation {
        Fast = "fast": "the design's fast engine, where it has one, with what the machine has",
        Avx512 = "avx512": "the same with AVX-512 (x86)",
        Avx2 = "avx2": "the same with AVX2 (x86)",
        Neon = "neon": "the same with NEON (ARM)",
        Reference = "reference": "the plain text that says what the design is",
    }
}

impl Implementation {
    /// The instruction set of a fast engine; `None` for the reference.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where this machine lacks it.
    pub fn level(self) -> Result<Option<Level>> {
        let name = match self {
            // Without vector instructions the plain text is the faster one.
            Implementation::Fast => {
                return Ok(levels().first().map(|(_, level)| *level));
            }
            Implementation::Reference => return Ok(None),
            _ => Self::CHOICES[self as usize].name,
        };
        match levels().into_iter().find(|(level, _)| *level == name) {
            Some((_, level)) => Ok(Some(level)),
            None => Err(Error::unsupported(
                format_args!("the engine '{name}'"),
                "this machine does not have these instructions",
                "choose 'fast', which takes what the machine has",
            )),
        }
    }
}

/// How to replay a trace; none of it changes the picture.
#[derive(Clone, Copy)]
pub struct ReplayOptions<'a> {
    /// Which implementation draws.
    pub implementation: Implementation,
    /// Whether to count events.
    pub count_events: bool,
    /// Fragments that are sorted into tiles at a time, at most, however many there is memory for.
    pub window: usize,
    /// Bytes that the fragments may take, sorted into tiles, and the state of a design that
    /// grows with them.
    pub memory: u64,
    /// Whether fragments that were sorted for an earlier replay of the trace are drawn, and
    /// are kept for the next where all fit into `memory`.
    pub keep: bool,
    /// Is told how many fragments have been drawn, of how many.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
}

impl Default for ReplayOptions<'_> {
    fn default() -> Self {
        ReplayOptions {
            implementation: Implementation::Fast,
            count_events: false,
            window: usize::MAX,
            memory: 1 << 29,
            keep: true,
            progress: &|_, _| (),
        }
    }
}
