//! One publication's figures, measured: what a study asks for by name.

use crate::study::comparison::{Comparison, compare, compare_slab};
use crate::study::file::Publication;
use crate::study::publications::beyond::{Beyond, beyond};
use crate::study::publications::costs::{Costs, costs};
use crate::study::publications::experiment::Lab;
use crate::study::publications::methods::{Methods, methods};
use crate::study::publications::programs::programs;
use crate::study::publications::screen_door::{ScreenDoors, screen_doors};
use crate::study::publications::shadows::{Shadows, shadows};
use crate::study::publications::splats::splats;
use crate::study::publications::{Effort, Publications, reproduce};
use crate::study::results::Results;
use crate::study::stress::{Stability, stress_designs};
use screendoor_trace::error::Result;

/// What was measured of a publication.
#[derive(Debug)]
pub enum Reproduced {
    /// [`Publication::LaineKarras`].
    LaineKarras(Box<Publications>),
    /// [`Publication::Methods`].
    Methods(Box<Methods>),
    /// [`Publication::Slab`].
    Slab(Box<Comparison>),
    /// [`Publication::Comparison`].
    Comparison(Box<Comparison>),
    /// [`Publication::Beyond`].
    Beyond(Box<Beyond>),
    /// [`Publication::Splats`].
    Splats(Box<Beyond>),
    /// [`Publication::Programs`].
    Programs(Box<Results>),
    /// [`Publication::Shadows`].
    Shadows(Box<Shadows>),
    /// [`Publication::ScreenDoor`].
    ScreenDoor(Box<ScreenDoors>),
    /// [`Publication::Costs`].
    Costs(Box<Costs>),
    /// [`Publication::Stability`].
    Stability(Box<Stability>),
}

impl Reproduced {
    /// Which publication it is.
    pub fn publication(&self) -> Publication {
        match self {
            Reproduced::LaineKarras(_) => Publication::LaineKarras,
            Reproduced::Methods(_) => Publication::Methods,
            Reproduced::Slab(_) => Publication::Slab,
            Reproduced::Comparison(_) => Publication::Comparison,
            Reproduced::Beyond(_) => Publication::Beyond,
            Reproduced::Splats(_) => Publication::Splats,
            Reproduced::Programs(_) => Publication::Programs,
            Reproduced::Shadows(_) => Publication::Shadows,
            Reproduced::ScreenDoor(_) => Publication::ScreenDoor,
            Reproduced::Costs(_) => Publication::Costs,
            Reproduced::Stability(_) => Publication::Stability,
        }
    }

    /// Models that were not given, whose tables are left out.
    pub fn missing(&self) -> &[String] {
        match self {
            Reproduced::LaineKarras(p) => &p.missing,
            Reproduced::Methods(_)
            | Reproduced::Programs(_)
            | Reproduced::Shadows(_)
            | Reproduced::ScreenDoor(_)
            | Reproduced::Costs(_)
            | Reproduced::Stability(_) => &[],
            Reproduced::Slab(c) | Reproduced::Comparison(c) => &c.missing,
            Reproduced::Beyond(b) | Reproduced::Splats(b) => &b.missing,
        }
    }
}

/// Measures a publication in a lab.
///
/// # Errors
/// As [`reproduce`], [`methods`], [`compare`], [`beyond`] and [`programs`], and where a hard case cannot be made.
pub fn measure_publication(
    publication: Publication,
    lab: &Lab<'_>,
    effort: Effort,
) -> Result<Reproduced> {
    Ok(match publication {
        Publication::LaineKarras => Reproduced::LaineKarras(Box::new(reproduce(lab, effort)?)),
        Publication::Methods => Reproduced::Methods(Box::new(methods(lab, effort)?)),
        Publication::Slab => Reproduced::Slab(Box::new(compare_slab(lab, effort)?)),
        Publication::Comparison => Reproduced::Comparison(Box::new(compare(lab, effort)?)),
        Publication::Beyond => Reproduced::Beyond(Box::new(beyond(lab, effort)?)),
        Publication::Splats => Reproduced::Splats(Box::new(splats(lab, effort)?)),
        Publication::Programs => Reproduced::Programs(Box::new(programs(lab)?)),
        Publication::Shadows => Reproduced::Shadows(Box::new(shadows(lab, effort)?)),
        Publication::ScreenDoor => {
            (lab.watch)("screen doors", 0, 1);
            Reproduced::ScreenDoor(Box::new(screen_doors()?))
        }
        Publication::Costs => Reproduced::Costs(Box::new(costs(lab, effort)?)),
        Publication::Stability => {
            Reproduced::Stability(Box::new(stress_designs(16, |what, done, total| {
                (lab.watch)(what, done, total);
            })?))
        }
    })
}
