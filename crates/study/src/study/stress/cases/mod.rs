//! The hard cases, by what is hard about them.

mod colour;
mod depth;
mod frame;
mod layers;
mod opacity;
mod order;

use crate::study::stress::case::Case;

/// All of them.
pub fn cases() -> Vec<Case> {
    let groups = [
        opacity::cases(),
        layers::cases(),
        depth::cases(),
        colour::cases(),
        frame::cases(),
        order::cases(),
    ];
    groups.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_case_is_a_trace_with_a_name_of_its_own() {
        let mut names = HashSet::new();
        for case in cases() {
            assert!(names.insert(case.name.clone()), "{} twice", case.name);
            let trace = case.trace().unwrap_or_else(|e| panic!("{}: {e}", case.name));
            assert_eq!(trace.rows(), case.fragments(), "{}", case.name);
            if let Some(other) = case.against {
                assert!(cases().iter().any(|c| c.name == other && c.group == case.group));
            }
        }
    }
}
