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

use crate::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::{Param, Typed, Values, parse_spec};

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
const SEED: Typed<i64> = Typed::integer("seed", "1", (0, u32::MAX as i64), "which of its variants");

fn seed(values: &Values) -> u32 {
    values.get(SEED) as u32
}

/// The scene of `NAME` or `NAME:key=value,…` and the values of its parameters; nothing is
/// built.
///
/// # Errors
/// [`Error::Config`] for an unknown scene or parameter.
pub fn resolve(spec: &str) -> Result<(&'static Builtin, Values)> {
    let (name, given) = parse_spec(spec)?;
    let Some(builtin) = BUILTINS.iter().find(|b| b.name == name) else {
        return Err(Error::unknown("built-in scene", name, BUILTINS.iter().map(|b| b.name)));
    };
    Ok((builtin, Values::resolve(&format!("builtin:{name}"), builtin.params, &given)?))
}

/// Builds the scene of `NAME` or `NAME:key=value,…`.
///
/// # Errors
/// As [`resolve`].
pub fn build(spec: &str) -> Result<Scene> {
    let (builtin, values) = resolve(spec)?;
    let name = builtin.name;
    let mut scene = (builtin.build)(&values);
    let changes = values.changes(builtin.params);
    let separator = if changes.is_empty() { "" } else { ":" };
    scene.source = format!("builtin:{name}{separator}{changes}");
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{Capture, CaptureOptions};
    use crate::scene::load;
    use screendoor_trace::param::Kind;
    use screendoor_trace::trace::{TraceWriter, WriteOptions};

    /// The scene's name with settings.
    fn spec(builtin: &Builtin, settings: &[String]) -> String {
        format!("builtin:{}:{}", builtin.name, settings.join(","))
    }

    /// Settings for the smallest scene: all whole numbers at their least, but for
    /// the seed, and all flags set.
    fn smallest(builtin: &Builtin) -> Vec<String> {
        let setting = |p: &Param| match p.kind {
            Kind::Integer { min, .. } if p.name != SEED.param.name => {
                Some(format!("{}={min}", p.name))
            }
            Kind::Flag => Some(format!("{}=true", p.name)),
            _ => None,
        };
        builtin.params.iter().filter_map(setting).collect()
    }

    /// All that is drawn, as text: two scenes are the same where their texts are.
    fn text(spec: &str) -> String {
        let scene = load(spec).unwrap();
        format!("{:?} {:?} {:?}", scene.objects, scene.shapes, scene.materials)
    }

    #[test]
    fn every_scene_loads_at_the_ends_of_its_parameters() {
        for builtin in BUILTINS {
            load(&spec(builtin, &[])).unwrap();
            for param in builtin.params {
                let ends = match param.kind {
                    Kind::Integer { min, max } => [min.to_string(), max.to_string()],
                    Kind::Real { min, max } => [min.to_string(), max.to_string()],
                    Kind::Flag | Kind::Choice { .. } => continue,
                };
                for end in ends {
                    // A large scene would say nothing more about these.
                    let small =
                        param.name == SEED.param.name || matches!(param.kind, Kind::Real { .. });
                    let mut settings = if small { smallest(builtin) } else { Vec::new() };
                    settings.push(format!("{}={end}", param.name));
                    load(&spec(builtin, &settings)).unwrap();
                }
            }
        }
    }

    #[test]
    fn a_scene_is_the_same_again_and_another_with_another_seed() {
        for builtin in BUILTINS {
            let mut settings = smallest(builtin);
            let first = text(&spec(builtin, &settings));
            assert_eq!(first, text(&spec(builtin, &settings)), "{}", builtin.name);
            if builtin.params.iter().any(|p| p.name == SEED.param.name) {
                settings.push("seed=2".to_string());
                assert_ne!(first, text(&spec(builtin, &settings)), "{}", builtin.name);
            }
        }
    }

    #[test]
    fn every_scene_can_be_captured() {
        for builtin in BUILTINS {
            let scene = load(&spec(builtin, &smallest(builtin))).unwrap();
            let options =
                CaptureOptions { width: 64, height: 64, samples: 4, ..CaptureOptions::default() };
            let capture = Capture::new(&scene, &options).unwrap();
            let header = capture.header().clone();
            let mut writer =
                TraceWriter::new(Vec::new(), "t", header, WriteOptions::default()).unwrap();
            capture.draw(&mut writer, |_, _| {}).unwrap();
            let (_, written) = writer.finish().unwrap();
            assert!(written.rows > 0, "{}", builtin.name);
        }
    }

    #[test]
    fn threads_do_not_matter() {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let scene = "builtin:cloth:cells=16";
        assert_eq!(one.install(|| text(scene)), text(scene));
    }

    #[test]
    fn the_engine_is_large_and_of_many_parts() {
        let engine = load("builtin:engine").unwrap();
        assert!(engine.primitive_count() >= 100_000, "{}", engine.primitive_count());
        assert!(engine.objects.len() > 300);
        assert!(engine.shapes.len() < engine.objects.len() / 4, "parts share shapes");
        assert!(engine.materials.iter().all(|m| m.base.w == 0.3 && m.double_sided));
    }

    #[test]
    fn no_puff_of_smoke_is_more_opaque_than_a_twentieth() {
        let smoke = load("builtin:smoke:puffs=50").unwrap();
        assert!(smoke.materials.iter().all(|m| m.base.w <= 0.05));
    }
}
