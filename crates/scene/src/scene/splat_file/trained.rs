//! Splats as their training writes them (Kerbl et al. 2023): one element `vertex` of PLY,
//! whose properties are found by their names. Opacities are logits, scales natural logarithms
//! of standard deviations, quaternions w, x, y, z of any length; `f_rest` has all
//! coefficients of red first.

use super::{Cloud, Stored};
use crate::scene::ply_file::{Element, Place};
use screendoor_trace::error::{Error, Result};

/// The splats; `None` where the elements are of another kind.
pub(in crate::scene) fn trained(place: &str, elements: &[Element<'_>]) -> Result<Option<Cloud>> {
    let Some(vertices) = elements.iter().find(|e| e.name == "vertex") else { return Ok(None) };
    if !["f_dc_0", "scale_0", "rot_0"].iter().all(|name| vertices.column(name).is_some()) {
        return Ok(None);
    }
    let means = columns(place, vertices, ["x", "y", "z"])?;
    let constants = columns(place, vertices, ["f_dc_0", "f_dc_1", "f_dc_2"])?;
    let [opacity] = columns(place, vertices, ["opacity"])?;
    let scales = columns(place, vertices, ["scale_0", "scale_1", "scale_2"])?;
    let rotations = columns(place, vertices, ["rot_0", "rot_1", "rot_2", "rot_3"])?;
    let (degree, rest) = rest(place, vertices)?;

    let mut cloud = Cloud::new(place, degree, vertices.count);
    let mut harmonics = Vec::new();
    for i in 0..vertices.count {
        let value = |column: Place| vertices.value(i, column);
        harmonics.clear();
        harmonics.push(constants.map(|c| value(c) as f32));
        let each = rest.len() / 3;
        harmonics.extend((0..each).map(|k| [0, 1, 2].map(|c| value(rest[c * each + k]) as f32)));
        let stored = Stored {
            mean: means.map(value),
            scale: scales.map(|c| libm::exp(value(c))),
            rotation: rotations.map(value),
            opacity: 1.0 / (1.0 + libm::exp(-value(opacity))),
        };
        cloud.push(&stored, &harmonics);
    }
    Ok(Some(cloud))
}

fn columns<const N: usize>(place: &str, of: &Element<'_>, names: [&str; N]) -> Result<[Place; N]> {
    of.columns(names).map_err(|missing| {
        let what = format_args!("its splats have no property '{missing}'");
        Error::invalid(place, what, "export it again")
    })
}

/// The degree of the harmonics of an element and the properties of those after the constant.
pub(super) fn rest(place: &str, of: &Element<'_>) -> Result<(u32, Vec<Place>)> {
    let count = of.names().filter(|name| name.starts_with("f_rest_")).count();
    // Three channels of what degrees 1 to `degree` have.
    let Some(degree) = (0..=4_u32).find(|d| 3 * ((d + 1) * (d + 1) - 1) as usize == count) else {
        let what = format!("its splats have {count} properties 'f_rest_'");
        let hint = "harmonics of degrees 0 to 4 have 0, 9, 24, 45 or 72: export it again";
        return Err(Error::invalid(place, what, hint));
    };
    let column = |i: usize| {
        let name = format!("f_rest_{i}");
        of.column(&name).ok_or_else(|| {
            let what = format!("its splats have {count} properties 'f_rest_' and no '{name}'");
            Error::invalid(place, what, "export it again")
        })
    };
    Ok((degree, (0..count).map(column).collect::<Result<_>>()?))
}
