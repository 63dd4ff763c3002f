//! The light that casts shadows: what of a fragment's colour comes from it is recorded beside
//! the colour, and its own view is a trace like any other.

use glam::DVec3;

use crate::capture::camera::{Camera, CameraOptions};
use crate::capture::model::Model;
use crate::capture::{Capture, CaptureOptions};
use crate::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Typed;
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{ColumnId, ColumnSet};

/// The columns of what comes from the light.
pub const DIRECT: [ColumnId; 3] = [ColumnId::DirectR, ColumnId::DirectG, ColumnId::DirectB];
/// The same as a set.
pub const DIRECT_COLUMNS: ColumnSet = ColumnSet::of(&DIRECT);

const YAW: Typed<f64> = Typed::real(
    "yaw",
    "30",
    (-360.0, 360.0),
    "from where it comes: degrees to the right of the scene's front",
);
const PITCH: Typed<f64> = Typed::real("pitch", "50", (-90.0, 90.0), "degrees above");

/// The lights that a capture may have, in place of its own key light or as that.
pub const LIGHTS: [Model; 2] = [
    Model {
        name: "key",
        help: "the capture's own, from the camera's upper right: colours are as without",
        params: &[],
    },
    Model {
        name: "directional",
        help: "in its place one of the same strength from there, along parallel lines",
        params: &[YAW.param, PITCH.param],
    },
];

/// The light whose share of colours is recorded.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Light {
    /// The capture's own key light, which moves with the camera.
    Key,
    /// A directional light in its place: degrees to the right of the scene's front, and above.
    Directional([f64; 2]),
}

impl Light {
    /// Reads `NAME` or `NAME:parameter=value,…`.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown light or parameter, naming the nearest.
    pub fn parse(spec: &str) -> Result<Self> {
        let (place, values) = Model::read("light", &LIGHTS, spec)?;
        Ok(match place {
            0 => Light::Key,
            _ => Light::Directional([values.get(YAW), values.get(PITCH)]),
        })
    }

    /// The light as [`Light::parse`] reads it.
    pub fn spec(&self) -> String {
        match self {
            Light::Key => LIGHTS[0].name.to_string(),
            Light::Directional([yaw, pitch]) => {
                format!("{}:yaw={yaw},pitch={pitch}", LIGHTS[1].name)
            }
        }
    }

    /// The unit vector towards it, in the scene's space, where the key light stands at `key`.
    pub(super) fn towards(self, key: DVec3) -> DVec3 {
        match self {
            Light::Key => key,
            Light::Directional([yaw, pitch]) => {
                let (sin_yaw, cos_yaw) = libm::sincos(yaw.to_radians());
                let (sin_pitch, cos_pitch) = libm::sincos(pitch.to_radians());
                DVec3::new(sin_yaw * cos_pitch, sin_pitch, cos_yaw * cos_pitch)
            }
        }
    }

    /// Refuses what cannot be lit so.
    pub(super) fn check(&self, scene: &Scene, space: Space) -> Result<()> {
        if scene.is_all_splats() {
            return Err(Error::config(
                "splats hold their light in their colours: none of it is a light's alone",
                "leave --light out",
            ));
        }
        if !space.is_linear() {
            return Err(Error::config(
                "what comes from a light is a part of a linear colour",
                "leave --light out, or ask for --space linear",
            ));
        }
        Ok(())
    }
}

impl Capture<'_> {
    /// How the light's own view is captured: along parallel lines from the light, framed on the
    /// whole scene, in a map of `width` × `height` pixels; all else as this capture. `None` without
    /// a light.
    pub fn of_light(&self, [width, height]: [u32; 2]) -> Option<CaptureOptions> {
        let light = self.options.light?;
        let angle = match light {
            Light::Directional(angle) => angle,
            Light::Key => {
                let towards = self.key();
                let yaw = libm::atan2(towards.x, towards.z).to_degrees();
                [yaw, libm::asin(towards.y.clamp(-1.0, 1.0)).to_degrees()]
            }
        };
        let camera = CameraOptions {
            angle: Some(angle),
            field_of_view: Some(0.0),
            ..CameraOptions::default()
        };
        Some(CaptureOptions { width, height, camera, light: None, ..self.options.clone() })
    }
}

/// The unit vector towards a light that moves with the camera, in the scene's space.
pub(super) fn turned(camera: &Camera, light: [f32; 3]) -> DVec3 {
    let [x, y, z] = light.map(f64::from);
    (camera.right * x + camera.up * y + camera.back * z).normalize_or(DVec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load;
    use screendoor_trace::trace::{Fragment, Trace};

    fn small(light: Option<Light>) -> CaptureOptions {
        CaptureOptions { width: 48, height: 40, samples: 8, light, ..CaptureOptions::default() }
    }

    fn captured(scene: &Scene, options: &CaptureOptions) -> Trace {
        Capture::new(scene, options).unwrap().to_memory(|_, _| ()).unwrap()
    }

    fn fragments(trace: &Trace) -> Vec<Fragment> {
        trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
    }

    fn direct(f: &Fragment) -> [f32; 3] {
        [f.optional.direct_r, f.optional.direct_g, f.optional.direct_b]
    }

    #[test]
    fn the_key_lights_part_is_recorded_and_nothing_else_changes() {
        // Smoke is lit by none.
        let scenes =
            [("engine:rows=1,detail=2", true), ("cloth", true), ("hair", true), ("smoke", false)];
        for (name, is_lit) in scenes {
            let scene = load(&format!("builtin:{name}")).unwrap();
            let [without, with] =
                [None, Some(Light::Key)].map(|light| captured(&scene, &small(light)));
            assert!(DIRECT.iter().all(|id| with.header().has(*id) && !without.header().has(*id)));
            let [without, with] = [&without, &with].map(fragments);
            assert_eq!(without.len(), with.len(), "{name}");
            let mut lit = 0;
            for (plain, f) in without.iter().zip(&with) {
                assert_eq!(Fragment { optional: plain.optional, ..*f }, *plain, "{name}");
                for (whole, part) in f.colour.iter().zip(direct(f)) {
                    // Both in half precision.
                    assert!(part >= 0.0 && part <= whole * 1.001 + 1e-6, "{name}: {part} {whole}");
                }
                lit += u32::from(direct(f) != [0.0; 3]);
            }
            assert!(if is_lit { lit > 100 } else { lit == 0 }, "{name}: {lit}");
        }
    }

    #[test]
    fn what_is_left_without_the_light_does_not_depend_on_where_it_stands() {
        let scene = load("builtin:engine:rows=1,detail=2").unwrap();
        let from = |yaw| {
            let light = Some(Light::Directional([yaw, 40.0]));
            let options = CaptureOptions {
                colour: screendoor_trace::trace::ColourFormat::F32,
                ..small(light)
            };
            fragments(&captured(&scene, &options))
        };
        let mut differ = 0;
        for (a, b) in from(20.0).iter().zip(from(200.0)) {
            let left =
                |f: &Fragment| -> [f32; 3] { std::array::from_fn(|c| f.colour[c] - direct(f)[c]) };
            for (a, b) in left(a).iter().zip(left(&b)) {
                assert!((a - b).abs() < 1e-6, "{a} {b}");
            }
            differ += u32::from(direct(a) != direct(&b));
        }
        assert!(differ > 100, "{differ}");
    }

    #[test]
    fn the_lights_own_view_looks_from_where_it_shines() {
        let scene = load("builtin:engine:rows=1,detail=2").unwrap();
        for light in [Light::Key, Light::Directional([-35.0, 60.0])] {
            let options = small(Some(light));
            let capture = Capture::new(&scene, &options).unwrap();
            let of_light = capture.of_light([64, 32]).unwrap();
            assert_eq!(([of_light.width, of_light.height], of_light.light), ([64, 32], None));
            let own = Capture::new(&scene, &of_light).unwrap();
            let wanted = light.towards(capture.key());
            assert!((own.camera.back - wanted).length() < 1e-6, "{light:?}");
            assert!(own.camera.eye.is_none());
        }
        let options = small(None);
        assert!(Capture::new(&scene, &options).unwrap().of_light([8, 8]).is_none());
    }

    #[test]
    fn lights_are_read_as_they_are_written_and_refused_by_name() {
        for light in [Light::Key, Light::Directional([-35.5, 60.0])] {
            assert_eq!(Light::parse(&light.spec()).unwrap(), light);
        }
        assert_eq!(Light::parse("directional").unwrap(), Light::Directional([30.0, 50.0]));
        for (spec, word) in [
            ("lamp", "'lamp'"),
            ("key:yaw=3", "yaw"),
            ("directional:pitch=91", "pitch"),
            ("directional:yaw=nan", "yaw"),
        ] {
            let error = Light::parse(spec).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        let scene = load("builtin:glass").unwrap();
        let encoded = CaptureOptions { space: Some(Space::Encoded), ..small(Some(Light::Key)) };
        let error = Capture::new(&scene, &encoded).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("linear"), "{error}");
    }
}
