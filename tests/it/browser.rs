//! The report's picture viewer, driven in a browser by `tests/browser/report.py`.

use std::path::{Path, PathBuf};
use std::process::Command;

use screendoor::capture::{Capture, CaptureOptions};
use screendoor::picture::{Layer, Picture, write_exr};
use screendoor::report::html::viewer::{self, ViewedPicture, ViewedScene};
use screendoor::rop::Site;
use serde_json::{Value, json};

use crate::util::{design, picture};

const SIDE: u32 = 128;

/// A design's picture, a map of differences and one pixel's story.
struct Drawn {
    spec: &'static str,
    picture: Picture,
    flip: Vec<f32>,
    told: Value,
}

/// A scene's pictures, as a report would measure them.
struct Made {
    name: &'static str,
    samples: u32,
    pixel: [u16; 2],
    reference: Picture,
    designs: Vec<Drawn>,
}

fn make(name: &'static str, samples: u32, pixel: [u16; 2], designs: &[&'static str]) -> Made {
    let scene = screendoor::scene::load(&format!("builtin:{name}")).unwrap();
    let options = CaptureOptions { width: SIDE, height: SIDE, ..CaptureOptions::default() };
    let trace = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    let reference = picture(&design("exact"), &trace, samples, 0);
    let designs = designs.iter().map(|spec| {
        let design = design(spec);
        let drawn = picture(&design, &trace, samples, 0);
        let site = Site { x: pixel[0], y: pixel[1] };
        let told = design.explain(&trace, samples, 0, site, &|_, _| ()).unwrap();
        let mut document = json!({
            "trace": format!("{name}.arrow"),
            "design": design.info().name,
            "parameters": design.values(),
            "pixel": pixel,
            "samples": samples,
            "seed": 0,
        });
        let fields = serde_json::to_value(&told).unwrap();
        document.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
        let flip = stand_in(&drawn.minus(&reference));
        Drawn { spec, picture: drawn, flip, told: document }
    });
    let designs = designs.collect();
    Made { name, samples, pixel, reference, designs }
}

/// A stand-in for a FLIP map: the viewer only shows it.
fn stand_in(error: &Picture) -> Vec<f32> {
    let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
    let size = |(x, y)| error.get(x, y).iter().map(|c| c.abs()).sum::<f64>() * 2.0;
    pixels.map(|at| size(at).min(1.0) as f32).collect()
}

/// A scene as the viewer takes it; its pictures as EXR files in `folder`.
fn viewed<'a>(made: &'a Made, folder: &Path) -> ViewedScene<'a> {
    let Made { name, samples, pixel, reference, designs } = made;
    let mut pictures = Vec::new();
    for (at, Drawn { spec, picture, flip, told }) in designs.iter().enumerate() {
        let exr = format!("{name}-{at}.exr");
        let layers =
            [Layer { name: "colour", picture }, Layer { name: "reference", picture: reference }];
        write_exr(folder.join(&exr), &layers).unwrap();
        pictures.push(ViewedPicture {
            name: spec.to_string(),
            picture,
            flip: Some(flip),
            figures: vec![("RMSE".into(), "4.59 ± 0.02".into())],
            command: format!(
                "screendoor replay {name}.arrow --design {spec} --samples {samples} --exact -o {exr}"
            ),
            exr,
            explain: Some(told.clone()),
        });
    }
    ViewedScene {
        name: name.to_string(),
        samples: *samples,
        reference,
        pictures,
        pixel: *pixel,
        trace: format!("{name}.arrow"),
    }
}

/// Writes `report.html` and the EXR files of its pictures into `folder`.
fn write_page(folder: &Path) -> PathBuf {
    let made = [
        make("engine", 8, [66, 60], &["lk", "enderton", "wboit"]),
        make("glass", 4, [64, 64], &["lk", "enderton:mask=naive", "mlab"]),
        make("smoke", 64, [64, 64], &["lk", "wboit"]),
    ];
    let scenes: Vec<ViewedScene<'_>> = made.iter().map(|m| viewed(m, folder)).collect();
    let page = folder.join("report.html");
    let style = viewer::STYLE;
    let section = viewer::section(&scenes).into_string();
    let text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>viewer</title>\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n\
         <style>{PAGE_STYLE}{style}</style></head><body>{section}</body></html>\n"
    );
    std::fs::write(&page, text).unwrap();
    page
}

/// The variables that the report's page defines.
const PAGE_STYLE: &str = "
:root { color-scheme: light dark; --bg: #fff; --fg: #1b1f24; --muted: #5d6772; --line: #d0d7de;
  --panel: #f5f7f9; --accent: #0b62c4; --good: #1a7f37; --bad: #c62828; }
@media (prefers-color-scheme: dark) { :root { --bg: #14171b; --fg: #e3e7eb; --muted: #98a3ae;
  --line: #353c44; --panel: #1d2227; --accent: #6cb2ff; --good: #57c46e; --bad: #ff7b72; } }
body { margin: 0 auto; max-width: 80rem; padding: 0 1rem 4rem; background: var(--bg); color: var(--fg);
  font: 16px/1.5 system-ui, sans-serif; }
";

#[test]
#[ignore = "needs chromium, chromedriver and python3 with selenium, OpenEXR and numpy \
            (SCREENDOOR_PYTHON names another interpreter)"]
fn the_viewer_works_in_a_browser() {
    let scratch = tempfile::tempdir().unwrap();
    // Where the page is wanted, it is left there.
    let kept = std::env::var_os("SCREENDOOR_PAGE").map(PathBuf::from);
    let folder = kept.as_deref().unwrap_or(scratch.path());
    std::fs::create_dir_all(folder).unwrap();
    let page = write_page(folder);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/report.py");
    let python = std::env::var("SCREENDOOR_PYTHON").unwrap_or("python3".into());
    let run = |more: &[&str]| {
        let mut command = Command::new(&python);
        command.arg(&script).args(more).arg(&page).arg(folder);
        assert!(command.status().unwrap().success(), "{more:?}");
    };
    run(&[]);
    run(&["--self-test"]);
}
