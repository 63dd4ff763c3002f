//! Models of which a capture has one: each with a name and parameters of its own.

use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::{Param, Values, parse_spec};

/// One of several models.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// Its name.
    pub name: &'static str,
    /// What it is or does.
    pub help: &'static str,
    /// Its parameters.
    pub params: &'static [Param],
}

impl Model {
    /// The place among `models` of the one that `NAME` or `NAME:parameter=value,…` names, and its
    /// values. `kind` is what they are, for errors.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name or parameter, naming the nearest.
    pub fn read(kind: &str, models: &[Model], spec: &str) -> Result<(usize, Values)> {
        let (name, given) = parse_spec(spec)?;
        let Some(place) = models.iter().position(|model| model.name == name) else {
            return Err(Error::unknown(kind, name, models.iter().map(|model| model.name)));
        };
        Ok((place, Values::resolve(name, models[place].params, &given)?))
    }
}
