//! Several traces as one.

use crate::edit::convert::stores_what_halves_lack;
use crate::edit::{Edit, Progress, Push, each_row, header_differences};
use crate::error::{Error, Result};
use crate::trace::{ColourFormat, ColumnId, Header, Trace};

/// How traces are put together.
#[derive(Clone, Copy, Debug, Default)]
pub struct MergeOptions {
    /// Whether primitives and objects keep their numbers, as parts of one scene want it.
    /// Else those of each trace come after those of the traces before it: different
    /// primitives must have different numbers.
    pub keep_numbers: bool,
}

/// The entries of headers in which traces of one frame are alike.
const ONE: [&str; 4] = ["frame", "samples", "background", "space"];

/// Several traces of one frame as one: the fragments of the first, then those of the second,
/// and so on.
#[derive(Debug)]
pub struct Merge<'a> {
    traces: &'a [Trace],
    options: MergeOptions,
    header: Header,
}

impl<'a> Merge<'a> {
    /// Checks that the traces belong to one frame. The view is kept where all have the same.
    ///
    /// # Errors
    /// [`Error::Config`] where there are none, or where frame, samples, background or the
    /// space of colours differ.
    pub fn new(traces: &'a [Trace], options: MergeOptions) -> Result<Self> {
        let Some((first, others)) = traces.split_first() else {
            return Err(Error::config("there is nothing to join", "name at least one trace"));
        };
        let mut header = first.header().clone();
        for trace in others {
            let other = trace.header();
            let differences = header_differences(first.header(), other);
            if let Some(found) = differences.iter().find(|found| ONE.contains(&found.entry)) {
                let what = found.entry;
                return Err(Error::config(
                    format_args!("{} and {} differ in their {what}", first.place(), trace.place()),
                    "join traces of one frame, its samples, its background and its space of colours",
                ));
            }
            header.pattern.nested &= other.pattern.nested;
            if other.colour == ColourFormat::F32 {
                header.colour = ColourFormat::F32;
            }
            header.optional.extend(&other.optional);
            header.view = header.view.filter(|view| Some(*view) == other.view);
        }
        let renumbered = !others.is_empty() && !options.keep_numbers;
        let numbers = [ColumnId::Primitive, ColumnId::Object];
        header.constants.retain(|id, value| {
            let same = |trace: &Trace| {
                trace.header().constants.get(id).is_some_and(|other| other.is(*value))
            };
            others.iter().all(same) && !(renumbered && numbers.contains(id))
        });
        if traces.iter().any(|trace| stores_what_halves_lack(trace.header(), &header)) {
            header.colour = ColourFormat::F32;
        }
        header.source = said(traces, |header| &header.source);
        header.camera = said(traces, |header| &header.camera);
        Ok(Merge { traces, options, header })
    }

    /// Whether the traces have views, and not all the same: the new one has none.
    pub fn lost_view(&self) -> bool {
        self.header.view.is_none() && self.traces.iter().any(|t| t.header().view.is_some())
    }
}

impl Edit for Merge<'_> {
    fn header(&self) -> &Header {
        &self.header
    }

    fn fragments(&self, push: Push<'_>, progress: Progress<'_>) -> Result<()> {
        let all = self.traces.iter().map(Trace::rows).sum();
        let mut done = 0;
        // The first numbers of the trace that is read, and those after all so far.
        let (mut first, mut next) = ([0_u64; 2], [0_u64; 2]);
        for trace in self.traces {
            each_row(trace, (done, all), progress, |row, mut fragment| {
                if !self.options.keep_numbers {
                    let numbers = [&mut fragment.primitive, &mut fragment.object];
                    for (i, number) in numbers.into_iter().enumerate() {
                        let new = first[i] + u64::from(*number);
                        *number = u32::try_from(new).map_err(|_| too_many(trace, row))?;
                        next[i] = next[i].max(new + 1);
                    }
                }
                push(&fragment)
            })?;
            done += trace.rows();
            first = next;
        }
        Ok(())
    }
}

fn too_many(trace: &Trace, row: u64) -> Error {
    Error::invalid(
        format_args!("{}, row {row}", trace.place()),
        "its number would be above 4294967295 after those of the traces before it",
        "number primitives and objects from 0 on, or keep the numbers that they have",
    )
}

/// What the traces say of themselves, each thing once.
fn said<'a>(traces: &'a [Trace], what: impl Fn(&'a Header) -> &'a String) -> String {
    let mut words: Vec<&str> = Vec::new();
    for text in traces.iter().map(|trace| what(trace.header())) {
        if !words.contains(&text.as_str()) {
            words.push(text);
        }
    }
    words.join(" + ")
}
