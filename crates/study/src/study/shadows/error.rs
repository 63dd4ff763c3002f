//! How far visibilities are from the exact ones.

use serde::{Deserialize, Serialize};

use crate::study::shadows::Query;

/// Parts of the light's depth range, for errors by depth.
const PARTS: usize = 8;

/// Errors of visibility (0 to 1) over all fragments that asked.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisibilityError {
    /// How many asked.
    pub queries: u64,
    /// The root of the mean squared error.
    pub rmse: f64,
    /// The mean error: above 0 where too much light comes through.
    pub mean: f64,
    /// The greatest error.
    pub max: f64,
    /// The mean of the exact visibilities.
    pub truth: f64,
    /// The same in equal parts of the light's depth range, those alone that were asked for.
    pub by_depth: Vec<DepthError>,
}

/// Errors of visibility in a part of the light's depth range.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthError {
    /// Where it begins, as a share of the range.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// How many asked.
    pub queries: u64,
    /// The root of the mean squared error.
    pub rmse: f64,
    /// The mean error.
    pub mean: f64,
}

/// Sums over queries.
#[derive(Clone, Debug, Default)]
pub(super) struct Totals([Sums; PARTS]);

#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    queries: u64,
    squares: f64,
    errors: f64,
    max: f64,
    truth: f64,
}

impl Sums {
    fn and(self, other: &Sums) -> Sums {
        Sums {
            queries: self.queries + other.queries,
            squares: self.squares + other.squares,
            errors: self.errors + other.errors,
            max: self.max.max(other.max),
            truth: self.truth + other.truth,
        }
    }

    /// A sum over all queries as their mean; 0 where there are none.
    fn mean(&self, sum: f64) -> f64 {
        sum / self.queries.max(1) as f64
    }
}

impl Totals {
    pub(super) fn add(&mut self, query: Query) {
        let Query { z, found, truth } = query;
        let error = found - truth;
        let sums = &mut self.0[((u64::from(z.0) * PARTS as u64) >> 32) as usize];
        let one =
            Sums { queries: 1, squares: error * error, errors: error, max: error.abs(), truth };
        *sums = sums.and(&one);
    }

    pub(super) fn error(&self) -> VisibilityError {
        let all = self.0.iter().fold(Sums::default(), Sums::and);
        let by_depth = self.0.iter().enumerate().filter(|(_, sums)| sums.queries > 0);
        let by_depth = by_depth.map(|(part, sums)| DepthError {
            from: part as f64 / PARTS as f64,
            to: (part + 1) as f64 / PARTS as f64,
            queries: sums.queries,
            rmse: sums.mean(sums.squares).sqrt(),
            mean: sums.mean(sums.errors),
        });
        VisibilityError {
            queries: all.queries,
            rmse: all.mean(all.squares).sqrt(),
            mean: all.mean(all.errors),
            max: all.max,
            truth: all.mean(all.truth),
            by_depth: by_depth.collect(),
        }
    }
}
