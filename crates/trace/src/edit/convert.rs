//! The same fragments, stored otherwise.

use std::cell::Cell;
use std::collections::BTreeMap;

use half::f16;

use crate::edit::{Edit, Progress, Push, each_row};
use crate::error::{Error, Result};
use crate::trace::{ColourFormat, ColumnId, Fragment, Header, Scalar, Trace};

crate::options! {
    /// Which columns are stated in the header instead of being stored.
    pub enum Constants {
        Keep = "keep": "those that the trace states already",
        Find = "find": "all that have one value in every row: found in a pass of its own",
        Store = "store": "none: every column is stored, for readers that know no other",
    }
}

/// How a trace is stored otherwise.
#[derive(Clone, Copy, Debug)]
pub struct ConvertOptions {
    /// The precision of colours; where it is `None`, the trace's own, or single precision where
    /// half would round a stated colour that is stored now.
    pub colour: Option<ColourFormat>,
    /// Which columns are stated.
    pub constants: Constants,
}

impl Default for ConvertOptions {
    fn default() -> Self {
        ConvertOptions { colour: None, constants: Constants::Keep }
    }
}

/// The same fragments, stored otherwise: without a change, those of another program's file
/// with checksums and in this format's own types.
#[derive(Debug)]
pub struct Convert<'a> {
    trace: &'a Trace,
    header: Header,
    /// Counted as fragments are handed out, which a pass for it alone would read once more.
    rounded: Cell<u64>,
}

/// The columns of colours.
const COLOURS: [ColumnId; 3] = [ColumnId::R, ColumnId::G, ColumnId::B];

impl<'a> Convert<'a> {
    /// Finds out what the new trace's header is.
    ///
    /// # Errors
    /// Those of reading the trace, where its constant columns are looked for.
    pub fn new(trace: &'a Trace, options: ConvertOptions, progress: Progress<'_>) -> Result<Self> {
        let old = trace.header();
        let constants = match options.constants {
            Constants::Keep => old.constants.clone(),
            Constants::Store => BTreeMap::new(),
            Constants::Find => constants(trace, progress)?,
        };
        let colour = options.colour.unwrap_or(old.colour);
        let mut header = Header { colour, constants, ..old.clone() };
        if options.colour.is_none() && stores_what_halves_lack(old, &header) {
            header.colour = ColourFormat::F32;
        }
        // A file says by the type of a stored colour how precise colours are, and designs take
        // the width that they store them in from that.
        if header.colour == ColourFormat::F32 && !COLOURS.iter().any(|id| header.stores(*id)) {
            header.constants.remove(&ColumnId::R);
        }
        Ok(Convert { trace, header, rounded: Cell::new(0) })
    }

    /// Whether a fragment's colours lose something in the new trace's precision.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a colour that half precision cannot hold.
    fn rounds(&self, row: u64, fragment: &Fragment, stored: [bool; 3]) -> Result<bool> {
        let colours = stored.into_iter().zip(fragment.colour).filter(|(stored, _)| *stored);
        let mut loses = false;
        for (_, value) in colours {
            if f16::from_f32(value).is_infinite() {
                return Err(Error::unsupported(
                    format_args!("{}, row {row}", self.trace.place()),
                    format_args!("its colour {value} is beyond 65504, half precision's most"),
                    "keep colours in single precision",
                ));
            }
            loses |= !is_half(value);
        }
        Ok(loses)
    }
}

impl Edit for Convert<'_> {
    fn header(&self) -> &Header {
        &self.header
    }

    fn fragments(&self, push: Push<'_>, progress: Progress<'_>) -> Result<()> {
        let old = self.trace.header();
        // What was stored as halves already loses nothing.
        let may = old.colour == ColourFormat::F32 || stores_what_halves_lack(old, &self.header);
        let may = may && self.header.colour == ColourFormat::F16;
        let stored = COLOURS.map(|id| may && self.header.stores(id));
        let mut rounded = 0;
        each_row(self.trace, (0, self.trace.rows()), progress, |row, fragment| {
            rounded += u64::from(self.rounds(row, &fragment, stored)?);
            push(&fragment)
        })?;
        self.rounded.set(rounded);
        Ok(())
    }

    fn rounded(&self) -> u64 {
        self.rounded.get()
    }
}

/// Whether half precision holds a colour exactly.
fn is_half(value: f32) -> bool {
    f16::from_f32(value).to_f32() == value
}

/// Whether `new` stores in half precision a colour that `old` states and that it would round.
pub(super) fn stores_what_halves_lack(old: &Header, new: &Header) -> bool {
    let lacks = |(id, value): (&ColumnId, &Scalar)| {
        let stored = COLOURS.contains(id) && new.stores(*id);
        stored && matches!(value, Scalar::Real(v) if !is_half(*v))
    };
    new.colour == ColourFormat::F16 && old.constants.iter().any(lacks)
}

/// The columns that have one value in all rows, to the bit, but for one that stays stored:
/// rows of no column cannot be counted. Those that are stated already where there are no rows.
fn constants(trace: &Trace, progress: Progress<'_>) -> Result<BTreeMap<ColumnId, Scalar>> {
    let mut found: Option<BTreeMap<ColumnId, Scalar>> = None;
    each_row(trace, (0, trace.rows()), progress, |_, fragment| {
        match &mut found {
            None => {
                let there = ColumnId::ALL.into_iter().filter(|id| trace.header().has(*id));
                found = Some(there.map(|id| (id, fragment.value(id))).collect());
            }
            Some(found) => found.retain(|id, value| fragment.value(*id).is(*value)),
        }
        Ok(())
    })?;
    let Some(mut found) = found else { return Ok(trace.header().constants.clone()) };
    if ColumnId::ALL.into_iter().all(|id| !trace.header().has(id) || found.contains_key(&id)) {
        found.remove(&ColumnId::X);
    }
    Ok(found)
}
