//! Opacity by the angle at which a surface is seen: silhouettes look more opaque than what faces
//! the viewer.

use crate::capture::model::Model;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::{Typed, Values};

const LEAST: Typed<f64> = Typed::real("min", "0.2", (0.0, 1.0), "α_min, a factor of alpha");
const MOST: Typed<f64> = Typed::real("max", "0.9", (0.0, 1.0), "α_max, a factor of alpha");
const POWER: Typed<f64> = Typed::real("power", "2", (0.01, 64.0), "the cosine's power p");

/// The models of opacity that a capture may have, the one first that holds where none is asked
/// for.
pub const OPACITY_MODELS: [Model; 4] = [
    Model { name: "constant", help: "alpha is what it is from every side", params: &[] },
    Model {
        name: "crow",
        help: "alpha times α_min + (α_max − α_min)·(1 − |N_z|)^p: most at silhouettes (Crow 1978)",
        params: &[LEAST.param, MOST.param, POWER.param],
    },
    Model {
        name: "crow-printed",
        help: "alpha times (α_max − α_min)·(1 − (1 − |N_z|)^p) + α_min, the formula as printed: least \
               at silhouettes, since it is one of transparency",
        params: &[LEAST.param, MOST.param, POWER.param],
    },
    Model {
        name: "thickness",
        help: "1 − (1 − alpha)^(1/|cos θ|): a sheet is as thick as a line of sight finds it (Kay, \
               Greenberg 1979)",
        params: &[],
    },
];

/// How opaque a surface is, by the angle at which it is seen.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Opacity {
    /// As it is from every side.
    #[default]
    Constant,
    /// Crow's, with the sign that makes silhouettes more opaque.
    Crow(Cosine),
    /// Crow's as printed, taken for an opacity.
    Printed(Cosine),
    /// Kay and Greenberg's.
    Thickness,
}

/// The parameters of Crow's model.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cosine {
    /// α_min.
    pub least: f64,
    /// α_max.
    pub most: f64,
    /// p.
    pub power: f64,
}

impl Cosine {
    /// Between α_min where `share` is 0 and α_max where it is 1.
    fn between(self, share: f64) -> f64 {
        (self.most - self.least) * share + self.least
    }

    fn of(values: &Values) -> Self {
        Cosine { least: values.get(LEAST), most: values.get(MOST), power: values.get(POWER) }
    }
}

impl Opacity {
    /// Reads `NAME` or `NAME:parameter=value,…`.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown model or parameter, naming the nearest, and for an α_min
    /// above α_max.
    pub fn parse(spec: &str) -> Result<Self> {
        let (place, values) = Model::read("model of opacity", &OPACITY_MODELS, spec)?;
        let opacity = match place {
            0 => Opacity::Constant,
            1 => Opacity::Crow(Cosine::of(&values)),
            2 => Opacity::Printed(Cosine::of(&values)),
            _ => Opacity::Thickness,
        };
        match opacity {
            Opacity::Crow(c) | Opacity::Printed(c) if c.least > c.most => Err(Error::config(
                format_args!(
                    "{}: min is {} and max {}",
                    OPACITY_MODELS[place].name, c.least, c.most
                ),
                "give a min that is not above max",
            )),
            _ => Ok(opacity),
        }
    }

    /// The model as [`Opacity::parse`] reads it.
    pub fn spec(&self) -> String {
        let (model, of) = match self {
            Opacity::Constant => (0, None),
            Opacity::Crow(c) => (1, Some(c)),
            Opacity::Printed(c) => (2, Some(c)),
            Opacity::Thickness => (3, None),
        };
        let name = OPACITY_MODELS[model].name;
        let params = of.map_or(String::new(), |Cosine { least, most, power }| {
            format!(":min={least},max={most},power={power}")
        });
        format!("{name}{params}")
    }

    /// Whether alpha depends on the angle.
    pub(super) fn varies(&self) -> bool {
        *self != Opacity::Constant
    }

    /// The alpha of a surface of this `alpha` (0 to 1) whose normal and whose way to the viewer
    /// have the cosine `facing`.
    pub(super) fn alpha(&self, alpha: f32, facing: f32) -> f32 {
        let (alpha, facing) = (f64::from(alpha), f64::from(facing.abs()).min(1.0));
        let found = match self {
            Opacity::Constant => alpha,
            Opacity::Crow(c) => alpha * c.between(libm::pow(1.0 - facing, c.power)),
            Opacity::Printed(c) => alpha * c.between(1.0 - libm::pow(1.0 - facing, c.power)),
            // From the edge, through all of the sheet: 1 where there is any alpha.
            Opacity::Thickness => 1.0 - libm::pow(1.0 - alpha, 1.0 / facing),
        };
        found as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{CameraOptions, Capture, CaptureOptions};
    use crate::scene::load;

    #[test]
    fn models_at_both_ends_and_between() {
        let crow = Opacity::parse("crow:min=0.25,max=0.75,power=2").unwrap();
        let printed = Opacity::parse("crow-printed:min=0.25,max=0.75,power=2").unwrap();
        // Facing the viewer, at half of the cosine, at the silhouette.
        for (facing, wanted) in [(1.0, 0.25), (0.5, 0.375), (-0.5, 0.375), (0.0, 0.75)] {
            assert_eq!(crow.alpha(1.0, facing), wanted);
            assert_eq!(crow.alpha(0.5, facing), wanted / 2.0);
            // A transparency as printed is the other's complement where its ends are swapped.
            assert_eq!(printed.alpha(1.0, facing), 1.0 - wanted);
        }
        let sheet = Opacity::Thickness;
        assert_eq!([1.0, 0.5].map(|facing| sheet.alpha(0.5, facing)), [0.5, 0.75]);
        assert_eq!([0.0, 0.25, 1.0].map(|alpha| sheet.alpha(alpha, 0.0)), [0.0, 1.0, 1.0]);
        assert_eq!(sheet.alpha(1.0, 0.3), 1.0);
        assert_eq!(Opacity::Constant.alpha(0.3, 0.0), 0.3);
    }

    #[test]
    fn a_tilted_pane_is_as_opaque_as_its_angle_makes_it() {
        let scene = load("builtin:layers:count=1").unwrap();
        for degrees in [0.0_f64, 30.0, 60.0, 80.0] {
            for (spec, of) in [
                ("constant", (|alpha, _| alpha) as fn(f64, f64) -> f64),
                ("thickness", |alpha, cosine| 1.0 - (1.0 - alpha).powf(1.0 / cosine)),
                ("crow:min=0.2,max=1,power=2", |alpha, cosine| {
                    alpha * (0.2 + 0.8 * (1.0 - cosine).powi(2))
                }),
            ] {
                let camera = CameraOptions {
                    angle: Some([degrees, 0.0]),
                    field_of_view: Some(0.0),
                    ..CameraOptions::default()
                };
                let options = CaptureOptions {
                    width: 24,
                    height: 24,
                    alpha: Some(0.4),
                    opacity: Opacity::parse(spec).unwrap(),
                    camera,
                    ..CaptureOptions::default()
                };
                let trace = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
                let wanted = of(0.4, degrees.to_radians().cos());
                let mut count = 0;
                for f in trace.batches().flat_map(|b| b.unwrap().iter().collect::<Vec<_>>()) {
                    let alpha = f64::from(f.alpha);
                    assert!((alpha - wanted).abs() < 1e-5, "{spec} at {degrees}: {alpha} {wanted}");
                    count += 1;
                }
                assert!(count > 50, "{count}");
                assert_eq!(trace.header().source.contains("opacity"), spec != "constant");
            }
        }
    }

    #[test]
    fn models_are_read_as_they_are_written_and_refused_by_name() {
        for spec in ["constant", "crow:min=0.1,max=0.8,power=3", "crow-printed", "thickness"] {
            let opacity = Opacity::parse(spec).unwrap();
            assert_eq!(Opacity::parse(&opacity.spec()).unwrap(), opacity);
        }
        for (spec, word) in [
            ("crows", "'crow'"),
            ("thickness:power=2", "power"),
            ("crow:power=0", "power"),
            ("crow:min=0.9,max=0.5", "min is 0.9 and max 0.5"),
        ] {
            let error = Opacity::parse(spec).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
