//! Shadows at replay: a light's trace is drawn by one design, and the fragments of a camera's
//! trace are shaded by what it tells (Enderton et al. 2011, section 3.2: stochastic shadow maps).
//!
//! The camera's trace says what of each fragment's colour comes from the light; where it lies in the
//! light's map follows from both traces' views. What is made of it is a trace like any other, which
//! every design draws.

mod error;
mod projection;
#[cfg(test)]
mod tests;

use std::sync::Mutex;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use error::{DepthError, VisibilityError};

use crate::study::shadows::error::Totals;
use crate::study::shadows::projection::Projection;
use screendoor_designs::{Configured, REFERENCE, configure};
use screendoor_rop::ReplayOptions;
use screendoor_rop::visibility::{Filter, VisibilityMap};
use screendoor_scene::capture::{DIRECT, DIRECT_COLUMNS};
use screendoor_trace::edit::{Edit, Progress, Push};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::picture::Space;
use screendoor_trace::random::hash;
use screendoor_trace::trace::{ColumnId, ColumnSet, Fragment, Header, Trace, Unorm32};

/// How a light's trace is drawn and looked up.
#[derive(Clone, Debug)]
pub struct ShadowOptions {
    /// What draws it.
    pub design: Configured,
    /// Samples of a pixel of the map.
    pub samples: u32,
    /// The seed of the first round.
    pub seed: u32,
    /// How often it is drawn, each time with another seed; answers are averaged.
    pub rounds: u32,
    /// How it is looked up.
    pub filter: Filter,
    /// Whether the exact answer is taken too, and errors against it.
    pub measure: bool,
}

impl ShadowOptions {
    /// Checks that a light's trace can be drawn and looked up so.
    ///
    /// # Errors
    /// [`Error::Config`] for a filter or a number of rounds that there is not.
    pub fn check(&self) -> Result<()> {
        self.filter.check()?;
        if !(1..=64).contains(&self.rounds) {
            return Err(Error::config(
                format_args!("a light's trace cannot be drawn {} times", self.rounds),
                "draw it 1 to 64 times",
            ));
        }
        Ok(())
    }
}

/// What a light's map costs.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShadowCost {
    /// Bits of state of a pixel of the map without its colours, of all rounds together; `None` where
    /// it grows with the fragments.
    pub state_bits: Option<u32>,
    /// How many times the light's trace is read.
    pub passes: u32,
}

/// A camera's trace with the shadows of a light.
pub struct Shade<'a> {
    camera: &'a Trace,
    header: Header,
    filter: Filter,
    projection: Projection,
    maps: Vec<VisibilityMap>,
    truth: Option<VisibilityMap>,
    cost: ShadowCost,
    totals: Mutex<Totals>,
}

/// The seed of a round.
fn seed_of(seed: u32, round: u32) -> u32 {
    if round == 0 { seed } else { hash([seed, round]) }
}

impl<'a> Shade<'a> {
    /// Draws the light's trace.
    ///
    /// # Errors
    /// [`Error::Config`] for a camera's trace that says nothing of a light, a design that does
    /// not tell visibility, a filter or a sample count that there is not; as
    /// [`Configured::visibility_map`].
    pub fn new(
        camera: &'a Trace,
        light: &Trace,
        options: &ShadowOptions,
        replay: &ReplayOptions<'_>,
    ) -> Result<Self> {
        let ShadowOptions { design, samples, filter, .. } = options;
        options.check()?;
        let old = camera.header();
        let lacks = |id: &&ColumnId| !old.has(**id);
        if let Some(lacking) = DIRECT.iter().find(lacks) {
            return Err(Error::config(
                format_args!("{}: it has no column '{}'", camera.place(), lacking.name()),
                "capture it with --light",
            ));
        }
        if old.space != Space::Linear {
            return Err(Error::config(
                format_args!("{}: light is added up in linear colours", camera.place()),
                "capture it with --space linear",
            ));
        }
        let Some(projection) = Projection::of(old, light.header()) else {
            let lacking = if old.view.is_none() { camera } else { light };
            return Err(Error::config(
                format_args!("{}: it does not say from where it was seen", lacking.place()),
                "take a trace with a view, as captures of scenes have it",
            ));
        };
        let draw =
            |round| design.visibility_map(light, *samples, seed_of(options.seed, round), replay);
        let rounds = if design.promises().seeded { options.rounds } else { 1 };
        let maps = (0..rounds).map(draw).collect::<Result<Vec<_>>>()?;
        let truth = match options.measure {
            true => Some(configure(REFERENCE, &[])?.visibility_map(light, *samples, 0, replay)?),
            false => None,
        };
        let cost = ShadowCost {
            state_bits: maps
                .iter()
                .map(|map| Some(map.state_bits()).filter(|b| !b.unbounded).map(|b| b.total()))
                .sum(),
            passes: maps.iter().map(VisibilityMap::passes).sum(),
        };
        let mut header = old.clone();
        DIRECT.iter().for_each(|id| {
            header.optional.remove(id);
            header.constants.remove(id);
        });
        // Colours that were one value are not any more.
        for id in [ColumnId::R, ColumnId::G, ColumnId::B] {
            header.constants.remove(&id);
        }
        header.source =
            format!("{}, shadows by {} at {samples} samples", old.source, design.label());
        Ok(Shade {
            camera,
            header,
            filter: *filter,
            projection,
            maps,
            truth,
            cost,
            totals: Mutex::default(),
        })
    }

    /// What the light's map costs.
    pub fn cost(&self) -> ShadowCost {
        self.cost
    }

    /// How far the visibilities that were asked for are from the exact ones, which are averaged
    /// over the same taps; `None` where they were not taken.
    pub fn error(&self) -> Option<VisibilityError> {
        self.truth.as_ref()?;
        let totals = self.totals.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        Some(totals.error())
    }

    /// The fragment in the light's shadows; what was found of its visibility and what is true.
    fn shaded(&self, fragment: &Fragment) -> (Fragment, Option<Query>) {
        let optional = &fragment.optional;
        let direct = [optional.direct_r, optional.direct_g, optional.direct_b];
        let mut shaded = *fragment;
        shaded.optional = optional.only(KEPT);
        let receiver = self.projection.receiver(fragment).filter(|_| direct != [0.0; 3]);
        let Some(receiver) = receiver else { return (shaded, None) };
        let of = |map: &VisibilityMap| self.filter.visibility(map, &receiver);
        let found = self.maps.iter().map(of).sum::<f64>() / self.maps.len() as f64;
        let hidden = 1.0 - found;
        for (colour, direct) in shaded.colour.iter_mut().zip(direct) {
            // What is stored in few bits may be more than the whole.
            *colour = (f64::from(*colour) - hidden * f64::from(direct)).max(0.0) as f32;
        }
        let truth = self.truth.as_ref().map(of);
        (shaded, truth.map(|truth| Query { z: receiver.z, found, truth }))
    }
}

/// What stays of a fragment's optional values.
const KEPT: ColumnSet = ColumnSet::ALL.without(DIRECT_COLUMNS);

/// A visibility that was asked for.
#[derive(Clone, Copy, Debug)]
struct Query {
    z: Unorm32,
    found: f64,
    truth: f64,
}

impl Edit for Shade<'_> {
    fn header(&self) -> &Header {
        &self.header
    }

    fn fragments(&self, push: Push<'_>, progress: Progress<'_>) -> Result<()> {
        let mut totals = Totals::default();
        let mut done = 0;
        for batch in self.camera.batches() {
            let batch = batch?;
            let fragments: Vec<Fragment> = batch.iter().collect();
            let shaded: Vec<_> = fragments.par_iter().map(|f| self.shaded(f)).collect();
            for (fragment, query) in shaded {
                push(&fragment)?;
                // In the trace's order, so that sums do not depend on threads.
                if let Some(query) = query {
                    totals.add(query);
                }
            }
            done += batch.len() as u64;
            progress(done, self.camera.rows());
        }
        *self.totals.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = totals;
        Ok(())
    }
}

impl std::fmt::Debug for Shade<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Shade({}, {} maps)", self.camera.place(), self.maps.len())
    }
}
