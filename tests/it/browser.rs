//! A report, driven in a browser by `tests/browser/report.py`.

use std::path::{Path, PathBuf};
use std::process::Command;

use screendoor::report::{About, PAGE, write_report};
use screendoor::study::file::Study;
use screendoor::study::run::{Runner, Shard, Store};

/// Few and many samples, a scene that hides what is behind it, one of many layers.
const STUDY: &str = "
name = 'browser'
designs = ['enderton', 'lk', 'enderton:mask=naive', 'mlab']
samples = [4, 8, 64]
seeds = 2
timing = 1
pictures = [4, 64]
metrics = ['flip', 'spectrum', 'filtered']
[[scene]]
name = 'engine'
source = 'builtin:engine'
size = [128, 128]
[[scene]]
name = 'smoke'
source = 'builtin:smoke'
size = [128, 128]
";

/// Measures the study into `folder` and writes its report.
fn write_page(folder: &Path) -> PathBuf {
    let study = Study::parse(STUDY, "browser.toml").unwrap();
    let store = Store::begin(folder, &study).unwrap();
    let (base, shard) = (Path::new(""), Shard::WHOLE);
    let runner = Runner { store: &store, base, shard, adapter: None, watch: &|_, _, _| () };
    let outcome = runner.run().unwrap();
    assert!(outcome.failed.is_empty(), "{:?}", outcome.failed);
    let command = "screendoor study browser.toml -o results".to_string();
    write_report(&store, About { designs: Vec::new(), command }).unwrap();
    folder.join(PAGE)
}

/// Runs the script with `more` on a report of the study.
fn drive(more: &[&str]) {
    let scratch = tempfile::tempdir().unwrap();
    // Where the page is wanted, it is left there.
    let kept = std::env::var_os("SCREENDOOR_PAGE").map(PathBuf::from);
    let folder = kept.as_deref().unwrap_or(scratch.path());
    let page = write_page(folder);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/report.py");
    let python = std::env::var("SCREENDOOR_PYTHON").unwrap_or("python3".into());
    let mut command = Command::new(&python);
    command.arg(&script).args(more).arg(&page).arg(folder.join("pictures"));
    assert!(command.status().unwrap().success(), "{more:?}");
}

#[test]
#[ignore = "needs chromium, chromedriver and python3 with selenium, OpenEXR and numpy \
            (SCREENDOOR_PYTHON names another interpreter)"]
fn a_report_works() {
    drive(&[]);
}

#[test]
#[ignore = "needs the same, and minutes"]
fn planted_defects_are_found() {
    drive(&["--self-test"]);
}
