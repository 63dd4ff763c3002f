//! Scenes made from parameters, deterministic from their seed.

mod cloth;
mod engine;
mod foliage;
mod glass;
mod hair;
mod layers;
mod noise;
mod outlines;
mod ramps;
mod shapes;
mod smoke;

use crate::error::{Error, Result};
use crate::param::{Param, Values, parse_spec};
use crate::scene::Scene;

/// A built-in scene.
#[derive(Clone, Copy, Debug)]
pub struct Builtin {
    /// Its name, as in `builtin:NAME`.
    pub name: &'static str,
    /// What it is, in a line.
    pub summary: &'static str,
    /// Its parameters.
    pub params: &'static [Param],
    build: fn(&Values) -> Scene,
}

/// All built-in scenes.
pub const BUILTINS: &[Builtin] = &[
    layers::SCENE,
    ramps::SCENE,
    engine::SCENE,
    cloth::SCENE,
    hair::SCENE,
    smoke::SCENE,
    foliage::SCENE,
    glass::SCENE,
];

/// The seed that every random scene takes.
const SEED: Param = Param::integer("seed", "1", (0, u32::MAX as i64), "which of its variants");

fn seed(values: &Values) -> u32 {
    values.integer("seed") as u32
}

/// Builds the scene of `NAME` or `NAME:key=value,…`.
///
/// # Errors
/// [`Error::Config`] for an unknown scene or parameter.
pub fn build(spec: &str) -> Result<Scene> {
    let (name, given) = parse_spec(spec)?;
    let Some(builtin) = BUILTINS.iter().find(|b| b.name == name) else {
        return Err(Error::unknown("built-in scene", name, BUILTINS.iter().map(|b| b.name)));
    };
    let values = Values::resolve(&format!("builtin:{name}"), builtin.params, &given)?;
    let mut scene = (builtin.build)(&values);
    let changes = values.changes(builtin.params);
    let separator = if changes.is_empty() { "" } else { ":" };
    scene.source = format!("builtin:{name}{separator}{changes}");
    Ok(scene)
}
