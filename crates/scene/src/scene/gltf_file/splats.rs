//! Gaussian splats in glTF: KHR_gaussian_splatting as ratified, and the drafts before it that
//! files are met in, plain or as SPZ.

use serde::Deserialize;

use super::Loader;
use super::accessor::{Kind, Normalised, Type};
use super::extensions::Extensions;
use super::json::Primitive;
use super::warnings::Matter;
use crate::scene::Splats;
use crate::scene::splat_file::{Cloud, Stored, constant, spz};
use screendoor_trace::error::Result;
use screendoor_trace::picture::Space;

/// The extension's name, which its attributes begin with.
pub(super) const NAME: &str = "KHR_gaussian_splatting";
/// What packs splats as SPZ.
const SPZ: &str = "KHR_gaussian_splatting_compression_spz_2";
/// The spaces that colours may be in, and so are blended in.
const SPACES: [(&str, Space); 2] =
    [("srgb_rec709_display", Space::Encoded), ("lin_rec709_display", Space::Linear)];

/// What a primitive says. Drafts left all of it out.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Said {
    kernel: Option<String>,
    color_space: Option<String>,
    projection: Option<String>,
    #[serde(default)]
    extensions: Extensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Packed {
    buffer_view: usize,
}

const ROTATION: Kind = Kind {
    shapes: &[("VEC4", 4)],
    types: &[Type::F32, Type::I8, Type::I16],
    normalised: Normalised::Always,
};
/// Unsigned as ratified; logarithms, in drafts, have a sign.
const SCALE: Kind = Kind {
    shapes: &[("VEC3", 3)],
    types: &[Type::F32, Type::I8, Type::U8, Type::I16, Type::U16],
    normalised: Normalised::AsSaid,
};
const OPACITY: Kind = Kind {
    shapes: &[("SCALAR", 1)],
    types: &[Type::F32, Type::U8, Type::U16],
    normalised: Normalised::Always,
};
const HARMONIC: Kind =
    Kind { shapes: &[("VEC3", 3)], types: &[Type::F32], normalised: Normalised::Never };
const POSITION: Kind = HARMONIC;
const COLOUR: Kind = Kind {
    shapes: &[("VEC3", 3), ("VEC4", 4)],
    types: &[Type::F32, Type::U8, Type::U16],
    normalised: Normalised::Always,
};

impl Loader<'_> {
    /// The splats of a primitive that is said to be of some, or why they are not drawn.
    pub(super) fn splats(
        &mut self,
        primitive: &Primitive,
        part: &str,
    ) -> Result<std::result::Result<Splats, Matter>> {
        let said: Option<Said> = self.said(&primitive.extensions, NAME, part)?;
        let Some(said) = said else { return Ok(Ok(Splats::default())) };
        let space = said.color_space.as_deref().map_or(Some(SPACES[0].1), |name| {
            SPACES.iter().find(|(known, _)| *known == name).map(|(_, space)| *space)
        });
        let unknown = [
            ("kernel", &said.kernel, said.kernel.as_deref().is_none_or(|k| k == "ellipse")),
            ("colour space", &said.color_space, space.is_some()),
            (
                "projection",
                &said.projection,
                said.projection.as_deref().is_none_or(|p| p == "perspective"),
            ),
        ];
        if let Some((what, name, _)) = unknown.iter().find(|(.., known)| !known) {
            let name = screendoor_trace::error::one_line(name.as_deref().unwrap_or(""));
            let what = format!("splats of the {what} '{name}' are not drawn");
            return Ok(Err(self.warnings.matter_of("splat", &what)));
        }
        let packed: Option<Packed> = self.said(&said.extensions, SPZ, part)?;
        let cloud = match packed {
            Some(packed) => {
                let (_, bytes) = self.view(packed.buffer_view, part)?;
                spz::cloud(&format!("{}, {part}, {SPZ}", self.place), bytes)?
            }
            None => match self.plain_splats(primitive, part)? {
                Ok(cloud) => cloud,
                Err(matter) => return Ok(Err(matter)),
            },
        };
        let (mut splats, told) = cloud.finish();
        self.scene.warnings.extend(told);
        splats.space = space.unwrap_or(Space::Encoded);
        Ok(Ok(splats))
    }

    /// Splats in attributes.
    fn plain_splats(
        &mut self,
        primitive: &Primitive,
        part: &str,
    ) -> Result<std::result::Result<Cloud, Matter>> {
        let of = &primitive.attributes;
        // The oldest drafts have names of their own.
        let find = |name: &str, old: &str| {
            of.get(&format!("{NAME}:{name}")).or_else(|| of.get(old)).copied()
        };
        let attributes = [
            ("POSITION", of.get("POSITION").copied()),
            ("ROTATION", find("ROTATION", "_ROTATION")),
            ("SCALE", find("SCALE", "_SCALE")),
        ];
        if let Some((missing, _)) = attributes.iter().find(|(_, accessor)| accessor.is_none()) {
            let what = format!("splats without {missing} are not drawn");
            return Ok(Err(self.warnings.matter_of("splat", &what)));
        }
        let [(_, means), (_, rotations), (_, scales)] = attributes;
        let [means, rotations, scales] =
            [(means, POSITION), (rotations, ROTATION), (scales, SCALE)]
                .map(|(accessor, kind)| self.numbers(accessor.expect("all are there"), kind, part));
        let (means, rotations, scales) = (means?, rotations?, scales?);
        let colours = of.get("COLOR_0").map(|a| self.numbers(*a, COLOUR, part)).transpose()?;
        let opacity = find("OPACITY", "_OPACITY");
        let opacities = opacity.map(|a| self.numbers(a, OPACITY, part)).transpose()?;
        let mut harmonics = Vec::new();
        let mut degree = 0;
        for l in 0..=4_usize {
            let names = (0..=2 * l).map(|n| format!("{NAME}:SH_DEGREE_{l}_COEF_{n}"));
            let accessors: Option<Vec<usize>> = names.map(|name| of.get(&name).copied()).collect();
            let Some(accessors) = accessors else { break };
            degree = l as u32;
            for accessor in accessors {
                harmonics.push(self.numbers(accessor, HARMONIC, part)?);
            }
        }
        let prefix = format!("{NAME}:SH_DEGREE_");
        let claimed = of.keys().filter(|name| name.starts_with(&prefix)).count();
        if claimed > harmonics.len() {
            let what = "coefficients of harmonics that make up no whole degree are not read";
            self.scene.warnings.push(format!("{}, {part}: {what}", self.place));
        }
        if harmonics.is_empty() && colours.is_none() || opacities.is_none() && colours.is_none() {
            let what = "splats without colours or opacities are not drawn";
            return Ok(Err(self.warnings.matter_of("splat", what)));
        }
        let count = means.len();
        let lists = [&rotations, &scales].into_iter().chain(&colours).chain(&opacities);
        if let Some(other) = lists.chain(&harmonics).find(|list| list.len() != count) {
            let what = format!("of {count} splats {} have all attributes", other.len().min(count));
            return Err(self.bad(part, what, "export the file again"));
        }
        // A scale below 0 is none: so they are logarithms, as a draft had it.
        let logarithms = scales.arrays(0.0).any(|s: [f32; 3]| s.iter().any(|v| *v < 0.0));
        if logarithms {
            let what = "some scales are below 0, so that all are taken for logarithms";
            self.scene.warnings.push(format!("{}, {part}: {what}", self.place));
        }
        let scale = |v: f32| if logarithms { libm::exp(f64::from(v)) } else { f64::from(v) };
        let harmonics: Vec<Vec<[f32; 3]>> =
            harmonics.iter().map(|list| list.arrays(0.0).collect()).collect();
        let colours: Option<Vec<[f32; 4]>> = colours.map(|list| list.arrays(1.0).collect());
        let opacities: Option<Vec<[f32; 1]>> = opacities.map(|list| list.arrays(1.0).collect());
        let mut cloud = Cloud::new(&format!("{}, {part}", self.place), degree, count);
        let mut own = Vec::new();
        let turns = rotations.arrays(0.0).zip(scales.arrays(0.0)).zip(means.arrays(0.0));
        for (i, (([x, y, z, w], scales), mean)) in turns.enumerate() {
            let colour = colours.as_ref().map(|all| all[i]);
            own.clear();
            own.extend(harmonics.iter().map(|list| list[i]));
            if let ([], Some([r, g, b, _])) = (&own[..], colour) {
                own.push([r, g, b].map(|c| constant(f64::from(c))));
            }
            let opacity = opacities.as_ref().map(|all| all[i][0]).or(colour.map(|c| c[3]));
            let splat = Stored {
                mean: mean.map(f64::from),
                scale: <[f32; 3]>::map(scales, scale),
                rotation: [w, x, y, z].map(f64::from),
                opacity: f64::from(opacity.expect("there is one of both")),
            };
            cloud.push(&splat, &own);
        }
        Ok(Ok(cloud))
    }
}
