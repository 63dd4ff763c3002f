//! The same fragments, stored otherwise.

use std::collections::BTreeMap;

use half::f16;

use crate::edit::{Edit, Progress, Push, each_row};
use crate::error::Result;
use crate::trace::{ColourFormat, ColumnId, Header, Scalar, Trace};

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
    /// The precision of colours; the trace's own where it is `None`.
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
}

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
        Ok(Convert { trace, header })
    }

    /// How many fragments have colours that lose something in the new trace's precision.
    ///
    /// # Errors
    /// Those of reading the trace.
    pub fn rounded(&self, progress: Progress<'_>) -> Result<u64> {
        let narrower = self.trace.header().colour == ColourFormat::F32
            && self.header.colour == ColourFormat::F16;
        let mut rounded = 0;
        if narrower {
            let stored = [ColumnId::R, ColumnId::G, ColumnId::B].map(|id| self.header.stores(id));
            each_row(self.trace, (0, self.trace.rows()), progress, |_, fragment| {
                let loses = |(stored, c): (bool, f32)| stored && !is_half(c);
                rounded += u64::from(stored.into_iter().zip(fragment.colour).any(loses));
                Ok(())
            })?;
        }
        Ok(rounded)
    }
}

impl Edit for Convert<'_> {
    fn header(&self) -> &Header {
        &self.header
    }

    fn fragments(&self, push: Push<'_>, progress: Progress<'_>) -> Result<()> {
        each_row(self.trace, (0, self.trace.rows()), progress, |_, fragment| push(&fragment))
    }
}

/// Whether half precision holds a colour exactly.
fn is_half(value: f32) -> bool {
    f16::from_f32(value).to_f32() == value
}

/// Whether `new` stores in half precision a colour that `old` states and that it would round.
pub(super) fn stores_what_halves_lack(old: &Header, new: &Header) -> bool {
    let lacks = |(id, value): (&ColumnId, &Scalar)| {
        let colour = [ColumnId::R, ColumnId::G, ColumnId::B].contains(id);
        colour && new.stores(*id) && matches!(value, Scalar::Real(v) if !is_half(*v))
    };
    new.colour == ColourFormat::F16 && old.constants.iter().any(lacks)
}

/// The columns that have one value in all rows, to the bit; those that are stated already
/// where there are none.
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
    Ok(found.unwrap_or_else(|| trace.header().constants.clone()))
}
