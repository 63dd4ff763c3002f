//! What the README says of results is what RESULTS.md says, and what that says of the papers is there.

use std::fs;
use std::path::Path;
use std::process::Command;

use screendoor::design::configure;
use screendoor::report::in_short;

use crate::measured::PROGRAM;

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

/// What stands between two marks in a line.
fn between<'a>(line: &'a str, open: &str, close: &str) -> Vec<&'a str> {
    line.split(open).skip(1).filter_map(|rest| Some(rest.split_once(close)?.0)).collect()
}

#[test]
fn what_the_table_of_the_papers_names_is_there() {
    let results = read("docs/RESULTS.md");
    let (_, papers) = results.split_once("## The four papers line by line").unwrap();
    let run = |arguments: &[&str]| {
        let output = Command::new(PROGRAM).args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let scenes = run(&["scenes"]);
    let there = |name: &str| match name.split(' ').collect::<Vec<_>>()[..] {
        ["it", module] => {
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/it/{module}.rs")).exists()
        }
        ["screendoor", command] => run(&[command, "--help"]).contains("Usage"),
        ["screendoor", command, _, number] if number.parse::<u32>().is_ok() => {
            run(&[command, "--help"]).contains("Usage")
        }
        ["screendoor", command, option] => run(&[command, "--help"]).contains(option),
        [name] if name.starts_with("builtin:") => scenes.contains(&name["builtin:".len()..]),
        [option, ..] if option.starts_with("--") => {
            let commands = ["capture", "shade", "replay"].iter();
            commands.map(|command| run(&[command, "--help"])).any(|help| help.contains(option))
        }
        [name] => configure(name, &[]).is_ok(),
        _ => false,
    };
    assert!(!there("lkk") && !there("it nothing") && !there("builtin:nothing"));
    let mut named = 0;
    for line in papers.lines().filter(|line| line.starts_with("| ")) {
        // What is in print is the papers' own.
        let cells: Vec<&str> = line.split(" | ").collect();
        let [.., here, _] = cells[..] else { panic!("{line}") };
        // A list of one between backticks would be the words between two names.
        for name in here.split('`').skip(1).step_by(2) {
            assert!(there(name), "{name}: {line}");
            named += 1;
        }
        for anchor in between(line, "](#", ")") {
            let heading = |l: &str| {
                let words: String = l.trim_start_matches('#').trim().to_lowercase();
                let kept = words.chars().filter(|c| c.is_alphanumeric() || " -".contains(*c));
                kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>()
            };
            let is = |l: &&str| l.starts_with("##") && heading(l) == anchor;
            assert!(results.lines().any(|l| is(&l)), "{anchor}: {line}");
        }
        for rest in here.split("tests/it/").skip(1).filter(|rest| rest.contains(".rs")) {
            let name = &rest[..rest.find(".rs").unwrap() + 3];
            assert!(
                Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it").join(name).exists(),
                "{line}"
            );
        }
        for rest in here.split("docs/").skip(1) {
            let name = rest.split([' ', ';', ',', ')', '*', '|']).next().unwrap();
            let name = name.trim_end_matches(['.', ':']);
            assert!(
                Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name).exists(),
                "{line}"
            );
        }
    }
    assert!(named > 150, "{named}");
}
