//! The page is looked at through a browser; here it is held to what it must say.

use super::*;
use crate::study::analysis::made_up::plausible;
use crate::study::results::Results;

fn extras() -> Extras {
    Extras { when: Some("2026-01-02".into()), ..Extras::default() }
}

/// Writes pages to the folder that `SCREENDOOR_PAGES` names, to be looked at.
#[test]
#[ignore = "writes pages for people to look at"]
fn pages_to_look_at() {
    let folder = std::path::PathBuf::from(std::env::var("SCREENDOOR_PAGES").unwrap());
    let cases: [(&str, Results); 3] = [
        ("large", plausible(9, 25, &[2, 4, 8, 16, 32])),
        ("small", plausible(1, 2, &[8])),
        ("middle", plausible(3, 12, &[4, 8, 16])),
    ];
    for (name, results) in cases {
        std::fs::write(folder.join(format!("{name}.html")), page(&results, &extras())).unwrap();
    }
}
