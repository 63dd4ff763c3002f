//! Values that no trace may hold: what is said of them when they are written and, since
//! other programs write traces too, when they are read.

use serde::Serialize;

use crate::study::stress::case::{Case, Group, layer, over};
use screendoor_trace::error::Result;
use screendoor_trace::trace::{Fragment, Trace, TraceWriter, WriteOptions};

/// A value and what is said of it.
#[derive(Clone, Debug, Serialize)]
pub struct Unfit {
    /// What it is.
    pub what: &'static str,
    /// What the writer says; none where it takes it.
    pub written: Option<String>,
    /// Whether that is how it should be.
    pub held: bool,
}

/// All of them, and beside each the nearest that is taken.
///
/// # Errors
/// Where a good trace cannot be written.
pub(super) fn unfit() -> Result<Vec<Unfit>> {
    let grey = |alpha: f32| layer(0, [0.5; 3], alpha);
    let coloured = |c: f32| layer(0, [0.5, c, 0.5], 0.5);
    let list: [(&str, Fragment, bool); 16] = [
        ("alpha 0", grey(0.0), true),
        ("alpha -0", grey(-0.0), true),
        ("alpha -1e-45, the smallest below 0", grey(-f32::from_bits(1)), false),
        ("alpha -1", grey(-1.0), false),
        ("alpha 1", grey(1.0), true),
        ("alpha 1 + 1 ulp", grey(1.0_f32.next_up()), false),
        ("alpha infinity", grey(f32::INFINITY), false),
        ("alpha NaN", grey(f32::NAN), false),
        ("colour of the largest float", coloured(f32::MAX), true),
        ("colour -1e30", coloured(-1e30), true),
        ("colour infinity", coloured(f32::INFINITY), false),
        ("colour -infinity", coloured(f32::NEG_INFINITY), false),
        ("colour NaN", coloured(f32::NAN), false),
        ("coverage of sample 7 of 8", over(1 << 7, grey(0.5)), true),
        ("empty coverage", over(0, grey(0.5)), false),
        ("coverage of sample 8 of 8", over(1 << 8, grey(0.5)), false),
    ];
    list.into_iter()
        .map(|(what, fragment, fits)| {
            let written = write(&fragment)?.err().map(|e| {
                // Without the place, which is the same for all.
                let text = e.to_string();
                text.split_once(": ").map_or(text.clone(), |(_, rest)| rest.to_string())
            });
            Ok(Unfit { what, held: written.is_none() == fits, written })
        })
        .collect()
}

/// Writes a trace of one fragment and reads it back.
fn write(fragment: &Fragment) -> Result<Result<()>> {
    let case = Case::new(Group::Opacity, "one fragment", "").kind([layer(0, [0.5; 3], 0.5)]);
    let header = case.trace()?.header().clone();
    let mut writer = TraceWriter::new(Vec::new(), "memory", header, WriteOptions::default())?;
    let written = writer.push(fragment).and_then(|()| writer.finish());
    Ok(written
        .and_then(|(bytes, _)| Trace::from_bytes(bytes, "memory")?.verify(|_| ()).map(|_| ())))
}
