//! What the README says of results is what RESULTS.md says.

use std::fs;
use std::path::Path;

use screendoor::report::in_short;

fn read(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

#[test]
fn the_readme_repeats_the_results_in_short() {
    let (readme, results) = (read("README.md"), read("docs/RESULTS.md"));
    let expected = in_short(&readme, &results).unwrap();
    assert!(
        readme == expected,
        "README.md's results are not those of docs/RESULTS.md; write both with `screendoor \
         reproduce --readme README.md`, or put this between the marks:\n{expected}"
    );
}

#[test]
fn a_figure_changed_by_hand_is_found() {
    let (readme, results) = (read("README.md"), read("docs/RESULTS.md"));
    let expected = in_short(&readme, &results).unwrap();
    let lines = expected.lines().filter(|line| line.starts_with("- **")).count();
    assert!(lines >= 10, "{lines} lines");
    let planted = expected.replacen("confirmed", "refuted", 1);
    assert_ne!(planted, expected);
    assert_ne!(in_short(&planted, &results).unwrap(), planted);
}
