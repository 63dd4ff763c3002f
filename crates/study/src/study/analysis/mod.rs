//! What a study's records say together: error relative to the baseline, costs, who is
//! dominated by whom, how errors fall, and which design meets which need.
//!
//! Pure functions of [`Results`](crate::study::results::Results). What is missing stays
//! missing: no figure over scenes is given where a scene lacks, and which one is said.

mod choice;
mod convergence;
mod cost;
mod front;
mod kept;
/// Results that nobody measured, for tests.
#[cfg(any(test, feature = "made-up"))]
pub mod made_up;
mod relative;

pub use choice::{
    Answer, BUDGETS, Budget, Candidate, Need, Separation, answer, answers, candidates,
};
pub use convergence::convergence;
pub use cost::Cost;
pub use front::{Point, Points, front, points};
pub use kept::kept;
pub use relative::{
    ROUNDING, RunName, baseline, ratio, ratio_on, reference_count, relative, shares,
};
