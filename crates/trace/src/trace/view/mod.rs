//! The view that a trace was taken in, in numbers: what takes the scene's places to the
//! frame's, and where the near and the far plane stand.
//!
//! `docs/TRACE_FORMAT.md` has the conventions. A trace need not have a view. Its fragments
//! mean the same with and without, so that it is no part of the content hash; what it tells
//! is how far away a depth lies.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::param::Options;
use crate::trace::metadata::MetadataReader;

crate::options! {
    /// How the lines of sight run.
    pub enum Projection {
        Perspective = "perspective": "lines of sight meet in the eye",
        Orthographic = "orthographic": "lines of sight are parallel to the view axis",
    }
}

/// The view that a trace was taken in.
///
/// View space is right-handed: x to the right, y up, and the camera looks along −z, so that
/// what lies `t` before it has z = −t. Clip space is that of Vulkan, Direct3D and WebGPU, y
/// up: the frame holds x/w and y/w from −1 to 1, and z/w is the depth, 0 on the near plane
/// and 1 on the far one. Matrices are column by column and multiply columns: element
/// `4 * column + row`.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// How the lines of sight run.
    pub projection: Projection,
    /// Distance of the near plane along the view axis, in the scene's units: finite, and
    /// above 0 in perspective.
    pub near: f64,
    /// Distance of the far plane, in the same: finite, beyond `near`.
    pub far: f64,
    /// From the scene's space to view space: turns, may mirror, and moves. It keeps lengths,
    /// so that view space has the scene's units.
    pub world_to_view: [f64; 16],
    /// From view space to clip space. Depth depends on the distance along the view axis
    /// alone, and is 0 at `near` and 1 at `far`.
    pub view_to_clip: [f64; 16],
}

/// What the keys of a view begin with; no other keys do.
const PREFIX: &str = "screendoor.view.";

mod key {
    pub(super) const PROJECTION: &str = "screendoor.view.projection";
    pub(super) const NEAR: &str = "screendoor.view.near";
    pub(super) const FAR: &str = "screendoor.view.far";
    pub(super) const WORLD_TO_VIEW: &str = "screendoor.view.world_to_view";
    pub(super) const VIEW_TO_CLIP: &str = "screendoor.view.view_to_clip";
}

/// How far lengths and right angles may be off: single precision turns no better after some
/// steps.
const RIGID: f64 = 1e-5;
/// How far depths on the planes may be off, as a share of the depth range times the distance
/// of the further plane over the planes' distance from each other: what single precision
/// leaves of a matrix.
const DEPTH: f64 = 1e-6;
/// But no further than this share: a matrix that is worse tells nothing.
const MOST: f64 = 0.01;
/// The least determinant, as a share of what its elements allow.
const REGULAR: f64 = 1e-12;

/// What is wrong with a view, and the key that has it.
struct Fault {
    key: &'static str,
    what: String,
}

impl View {
    /// The keys of its entries in a file: they are there together or not at all.
    pub(crate) const KEYS: [&str; 5] =
        [key::PROJECTION, key::NEAR, key::FAR, key::WORLD_TO_VIEW, key::VIEW_TO_CLIP];

    /// Checks the rules that its fields' types do not enforce.
    ///
    /// # Errors
    /// [`Error::Config`] with the first rule broken.
    pub fn check(&self) -> Result<()> {
        self.broken().map_err(|fault| {
            let field = fault.key.strip_prefix(PREFIX).unwrap_or(fault.key);
            Error::config(
                format_args!("the view's '{field}': {}", fault.what),
                "give the view as docs/TRACE_FORMAT.md says, or none",
            )
        })
    }

    fn broken(&self) -> std::result::Result<(), Fault> {
        let fault = |key, what: String| Err(Fault { key, what });
        for (key, values) in [
            (key::NEAR, std::slice::from_ref(&self.near)),
            (key::FAR, std::slice::from_ref(&self.far)),
            (key::WORLD_TO_VIEW, &self.world_to_view),
            (key::VIEW_TO_CLIP, &self.view_to_clip),
        ] {
            if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
                return fault(key, format!("{bad:?} is not finite"));
            }
        }
        let (near, far) = (self.near, self.far);
        if near >= far || !(far - near).is_finite() {
            let what = format!("a near plane at {near:?} and a far one at {far:?} are no range");
            return fault(key::NEAR, what);
        }
        if self.projection == Projection::Perspective && near <= 0.0 {
            return fault(key::NEAR, format!("a near plane at {near:?} lies not before the eye"));
        }
        if !keeps_lengths(&self.world_to_view) {
            let what = "it does more than turn, mirror and move";
            return fault(key::WORLD_TO_VIEW, what.to_string());
        }
        self.projects().map_err(|what| Fault { key: key::VIEW_TO_CLIP, what })
    }

    /// What is wrong with the projection's matrix.
    fn projects(&self) -> std::result::Result<(), String> {
        let at = |row: usize, column: usize| self.view_to_clip[4 * column + row];
        let w: [f64; 4] = std::array::from_fn(|column| at(3, column));
        // The part of the last row that tells the two kinds apart.
        let (scale, row) = match self.projection {
            Projection::Perspective => (-w[2], [0.0, 0.0, w[2], 0.0]),
            Projection::Orthographic => (w[3], [0.0, 0.0, 0.0, w[3]]),
        };
        if scale <= 0.0 || w != row {
            let kind = self.projection.name();
            return Err(format!("its last row, {w:?}, does not fit a projection that is {kind}"));
        }
        if at(2, 0) != 0.0 || at(2, 1) != 0.0 {
            return Err("its depth depends on more than the distance along the view axis".into());
        }
        let most = [at(0, 0), at(0, 1), at(1, 0), at(1, 1)].map(f64::abs).into_iter();
        let most = most.fold(0.0, f64::max);
        let determinant = at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0);
        // What is no number is not regular either.
        let regular = determinant.abs() > REGULAR * most * most;
        if !regular {
            return Err("it is singular".into());
        }
        let depth = |distance: f64| {
            let w = if self.projection == Projection::Perspective { distance } else { 1.0 };
            (at(2, 3) / scale - at(2, 2) / scale * distance) / w
        };
        let (near, far) = (self.near, self.far);
        let allowed = (DEPTH * near.abs().max(far.abs()) / (far - near)).min(MOST);
        for (distance, right) in [(near, 0.0), (far, 1.0)] {
            let found = depth(distance);
            let agrees = (found - right).abs() <= allowed;
            if !agrees {
                return Err(format!(
                    "it gives the plane at {distance:?} the depth {found:?}, which is {right:?}"
                ));
            }
        }
        Ok(())
    }

    /// Whether a key of the schema's metadata is one of a view's.
    pub(super) fn has_key(key: &str) -> bool {
        key.starts_with(PREFIX)
    }

    /// The entries of the schema's metadata.
    pub(crate) fn to_metadata(self) -> impl Iterator<Item = (&'static str, String)> {
        let number = |v: &f64| format!("{v:?}");
        let matrix = |m: &[f64; 16]| m.iter().map(number).collect::<Vec<_>>().join(" ");
        let values = [
            self.projection.name().to_string(),
            number(&self.near),
            number(&self.far),
            matrix(&self.world_to_view),
            matrix(&self.view_to_clip),
        ];
        Self::KEYS.into_iter().zip(values)
    }

    /// Reads it back, where there is one.
    pub(super) fn from_metadata(reader: &MetadataReader<'_>) -> Result<Option<Self>> {
        if !reader.map.keys().any(|key| View::has_key(key)) {
            return Ok(None);
        }
        if let Some(key) = Self::KEYS.into_iter().find(|key| !reader.map.contains_key(*key)) {
            return Err(Error::invalid(
                reader.place,
                format_args!("the metadata '{key}' is missing"),
                format_args!("a view has all of {}, or is left out", Self::KEYS.join(", ")),
            ));
        }
        let name = reader.text(key::PROJECTION)?;
        let kind = Projection::ALL.iter().find(|kind| kind.name() == name);
        let kinds: Vec<&str> = Projection::CHOICES.iter().map(|choice| choice.name).collect();
        let projection = kind.ok_or_else(|| reader.bad(key::PROJECTION, &kinds.join(" or ")))?;
        let matrix = |key: &str| {
            let values: Vec<f64> = reader.list(key, "16 numbers", |text| text.parse().ok())?;
            values.try_into().map_err(|_| reader.bad(key, "16 numbers"))
        };
        let view = View {
            projection: *projection,
            near: reader.parse(key::NEAR, "a number")?,
            far: reader.parse(key::FAR, "a number")?,
            world_to_view: matrix(key::WORLD_TO_VIEW)?,
            view_to_clip: matrix(key::VIEW_TO_CLIP)?,
        };
        view.broken().map_err(|Fault { key, what }| reader.wrong(key, what))?;
        Ok(Some(view))
    }
}

/// Whether a matrix turns, mirrors and moves, and does nothing else.
fn keeps_lengths(m: &[f64; 16]) -> bool {
    let axis = |column: usize| &m[4 * column..4 * column + 3];
    let dot = |a: usize, b: usize| axis(a).iter().zip(axis(b)).map(|(a, b)| a * b).sum::<f64>();
    let pairs = (0..3).flat_map(|a| (a..3).map(move |b| (a, b)));
    let mut off = pairs.map(|(a, b)| (dot(a, b) - f64::from(u8::from(a == b))).abs());
    off.all(|off| off <= RIGID) && [m[3], m[7], m[11], m[15]] == [0.0, 0.0, 0.0, 1.0]
}

#[cfg(test)]
mod tests;
