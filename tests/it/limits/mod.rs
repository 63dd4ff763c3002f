//! Peak memory and time of every command on hostile sizes: within `--memory` and a constant,
//! or refused at once.

mod captures;
mod scenes;
mod studies;
mod traces;

use std::path::Path;

use crate::edits;
use crate::measured::{Run, commands};
use crate::util::header;
use screendoor::trace::WriteOptions;

/// Writes a trace of so many fragments of one alpha on a frame of 256 x 256 pixels.
pub fn many_pixels(path: &Path, fragments: u32, alpha: f32) {
    let fragment = |i| (traces::many(i), alpha);
    traces::write_with(path, &header(256, 256, 4), fragments, fragment, WriteOptions::default());
}

/// A command, and tests of it.
type Held = (&'static str, &'static [fn()]);

/// The tests that hold each command to its limits.
const HELD: &[Held] = &[
    ("report", &[studies::memory_of_a_study_is_what_was_allowed_and_a_constant]),
    ("study", &[studies::memory_of_a_study_is_what_was_allowed_and_a_constant]),
    ("merge", &[studies::memory_of_a_study_is_what_was_allowed_and_a_constant]),
    ("demo", &[scenes::a_demo_of_many_triangles]),
    (
        "capture",
        &[
            scenes::a_texture_costs_its_texels_and_a_claim_nothing,
            scenes::triangles_cost_little_and_too_many_are_refused,
            scenes::a_vast_frame_costs_what_is_drawn_in_it,
            captures::records_take_what_memory_says,
        ],
    ),
    ("info", &[traces::memory_is_what_was_allowed_and_a_constant]),
    (
        "replay",
        &[
            traces::memory_is_what_was_allowed_and_a_constant,
            traces::one_depth_for_each_primitive_is_refused_where_there_are_too_many,
            traces::a_vast_frame_costs_what_is_drawn_in_it,
            traces::a_large_picture_costs_what_it_shows,
        ],
    ),
    ("compare", &[traces::a_large_picture_costs_what_it_shows]),
    (
        "explain",
        &[
            traces::memory_is_what_was_allowed_and_a_constant,
            traces::a_story_that_is_too_long_is_refused_with_what_it_needs,
            traces::the_end_of_a_long_story_is_told_at_once,
        ],
    ),
    ("designs", &[lists_take_next_to_nothing]),
    ("scenes", &[lists_take_next_to_nothing]),
    ("throughput", &[traces::memory_is_what_was_allowed_and_a_constant]),
    ("verify", &[traces::memory_is_what_was_allowed_and_a_constant]),
    ("diff", &[edits::memory_is_what_was_allowed_and_a_constant]),
    ("convert", &[edits::memory_is_what_was_allowed_and_a_constant]),
    ("trim", &[edits::memory_is_what_was_allowed_and_a_constant]),
    ("join", &[edits::memory_is_what_was_allowed_and_a_constant]),
    ("shuffle", &[edits::memory_is_what_was_allowed_and_a_constant]),
    ("shade", &[traces::memory_is_what_was_allowed_and_a_constant]),
    ("reproduce", &[studies::the_smallest_reproduction]),
    ("stress", &[crate::stress::nothing_that_is_promised_is_broken_and_nothing_is_lost]),
];

#[test]
fn every_command_is_held_to_its_limits_and_they_are_written_down() {
    let commands = commands();
    assert!(commands.len() > 10, "{commands:?}");
    let written = include_str!("../../../docs/LIMITS.md");
    for name in &commands {
        let held = HELD.iter().find(|(held, _)| held == name);
        assert!(held.is_some_and(|(_, tests)| !tests.is_empty()), "nothing holds '{name}'");
        let row = format!("\n| `{name}` |");
        assert_eq!(written.matches(&row).count(), 1, "docs/LIMITS.md has no row for '{name}'");
    }
    for (name, _) in HELD {
        assert!(commands.iter().any(|command| command == name), "there is no command '{name}'");
    }
    let rows = written.lines().filter(|line| line.starts_with("| `")).count();
    assert_eq!(rows, commands.len(), "docs/LIMITS.md has rows for commands that are not there");
}

#[test]
fn lists_take_next_to_nothing() {
    for command in ["designs", "scenes"] {
        let run = Run::of(Path::new("."), &[command]);
        run.is_good(64, command);
        assert!(run.seconds < 10.0, "{command}: {} s", run.seconds);
    }
}
