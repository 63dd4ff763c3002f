//! The pictures of a report: side by side, zoomed and moved together, held
//! against the reference, with every pixel's values and one pixel's story.
//!
//! The page part is whole in itself: pictures are packed into it
//! ([`packed`](super::packed)), its script is `inspector.js` and `viewer.js`.

use maud::{Markup, PreEscaped, html};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::packed::{pack, pack_picture};
use screendoor_trace::picture::Picture;

/// A design's picture and what is said of it.
#[derive(Clone, Debug)]
pub(crate) struct ViewedPicture<'a> {
    /// The design, as `--design` takes it.
    pub name: String,
    /// Its picture, of the reference's size.
    pub picture: &'a Picture,
    /// A FLIP map, row by row: 0 for no visible difference, 1 for the largest.
    pub flip: Option<&'a [f32]>,
    /// Names of figures and their values.
    pub figures: Vec<(String, String)>,
    /// The command that makes the picture again.
    pub command: String,
    /// The name of the EXR file that holds it.
    pub exr: String,
    /// What `screendoor explain --json` says of a pixel.
    pub explain: Option<Value>,
}

/// The pictures of one scene.
#[derive(Clone, Debug)]
pub(crate) struct ViewedScene<'a> {
    /// Its name.
    pub name: String,
    /// Samples per pixel.
    pub samples: u32,
    /// The exact picture.
    pub reference: &'a Picture,
    /// The designs' pictures.
    pub pictures: Vec<ViewedPicture<'a>>,
    /// The pixel at which the inspector opens.
    pub pixel: [u16; 2],
    /// Where the trace lies, for commands.
    pub trace: String,
    /// The pictures' seed.
    pub seed: u32,
}

/// Style rules, for the page's head. They take the page's variables `--bg`,
/// `--fg`, `--muted`, `--line`, `--panel`, `--accent`, `--good` and `--bad`.
pub(crate) const STYLE: &str = concat!(include_str!("viewer.css"), include_str!("inspector.css"));

/// The script, which [`element`] holds: one function, so that no name of it is the
/// page's.
const SCRIPT: &str = concat!(
    "(() => {\n'use strict';\n",
    include_str!("packed.js"),
    include_str!("inspector.js"),
    include_str!("viewer.js"),
    "})();\n"
);

/// The element `viewer`: the viewer, the pixel inspector, their data and their script.
///
/// # Panics
/// Where there is no scene or one has no pictures, and where a picture or a FLIP
/// map has another size than the scene's reference.
pub(crate) fn element(scenes: &[ViewedScene<'_>]) -> Markup {
    assert!(!scenes.is_empty() && scenes.iter().all(|s| !s.pictures.is_empty()));
    let mut blobs = Blobs::default();
    let data: Vec<Value> = scenes.iter().map(|scene| scene_data(scene, &mut blobs)).collect();
    html! {
        div #viewer .viewer role="group" aria-label="picture viewer" {
            noscript { p { "The picture viewer needs JavaScript." } }
            p.viewer-failure role="alert" hidden {}
            (controls(scenes))
            div.viewer-panels role="group" aria-label="pictures side by side" {}
            (readout())
            div.inspector role="region" aria-label="pixel inspector" {}
            script type="application/json" #viewer-data { (PreEscaped(script_safe(&json!({ "scenes": data })))) }
            @for (id, text) in &blobs.0 {
                script type="text/plain" id=(id) { (PreEscaped(text)) }
            }
            script { (PreEscaped(SCRIPT)) }
        }
    }
}

/// What one chooses with the mouse; `viewer.js` brings it to life.
fn controls(scenes: &[ViewedScene<'_>]) -> Markup {
    let modes = [
        ("colour", "Colour", "the pictures as they are"),
        ("signed", "Error ±", "picture minus reference: grey is none"),
        ("absolute", "|Error|", "size of the difference from the reference: black is none"),
        ("flip", "FLIP", "difference that an observer sees flipping between picture and reference"),
    ];
    html! {
        div.viewer-controls role="toolbar" aria-label="viewer" {
            label { "Scene " select.viewer-scene {
                @for (index, scene) in scenes.iter().enumerate() {
                    option value=(index) { (scene.name) " · " (scene.samples) " samples" }
                }
            } }
            span.viewer-group role="group" aria-label="how many panels" {
                @for count in 1..=3 {
                    button type="button" data-panels=(count) aria-pressed="false"
                        title={ (count) @if count == 1 { " panel" } @else { " panels" } } { (count) }
                }
                span.viewer-unit { "panels" }
            }
            span.viewer-group role="group" aria-label="what is shown" {
                @for (mode, name, title) in modes {
                    button type="button" data-mode=(mode) aria-pressed="false" title=(title) { (name) }
                }
            }
            span.viewer-group role="group" aria-label="zoom" {
                button type="button" data-do="out" title="smaller (−)" aria-label="zoom out" { "−" }
                output.viewer-zoom { "100%" }
                button type="button" data-do="in" title="larger (+)" aria-label="zoom in" { "+" }
                button type="button" data-do="fit" title="the whole picture (f)" { "Fit" }
                button type="button" data-do="one" title="a pixel of the picture is one of the screen (o)" { "1:1" }
            }
            label.viewer-amount {
                span.viewer-amount-name { "Exposure" }
                input type="range" min="-8" max="8" step="0.5" value="0";
                output { "+0 stops" }
            }
            button type="button" data-do="encoding" aria-pressed="true"
                title="values shown: sRGB-encoded, or linear (s)" { "sRGB" }
            button type="button" data-do="keys" aria-expanded="false" aria-controls="viewer-keys" title="all keys (?)" { "Keys" }
        }
        p.viewer-legend aria-live="polite" {}
    }
}

fn readout() -> Markup {
    let keys = [
        ("←  →", "previous, next picture in the selected panel"),
        ("1 … 9", "a picture by its number"),
        ("r", "the reference while held; a tap switches there and back"),
        ("e", "colour, error ±, |error|, FLIP"),
        ("s", "sRGB-encoded or linear"),
        ("[  ]", "exposure; the gain of errors"),
        ("+  −", "zoom; also wheel, pinch, and drag to move"),
        ("f  0", "the whole picture"),
        ("o", "1:1"),
        ("Tab", "the next panel"),
        ("Shift + arrows", "the cross-hair by a pixel"),
        ("x", "explain the pixel; also a click"),
        ("?", "this list"),
    ];
    html! {
        div.viewer-readout {
            span.viewer-where { "pixel –" }
            span.viewer-values data-of="reference" {}
        }
        p.viewer-short {
            kbd { "←" } kbd { "→" } " flip, " kbd { "r" } " reference, " kbd { "e" } " error, "
            kbd { "s" } " sRGB, " kbd { "[" } kbd { "]" } " exposure, " kbd { "+" } kbd { "−" } " zoom, "
            kbd { "f" } " fit, " kbd { "o" } " 1:1, " kbd { "x" } " explain, " kbd { "?" } " all keys"
        }
        dl #viewer-keys .viewer-keys hidden {
            @for (key, meaning) in keys {
                div { dt { kbd { (key) } } dd { (meaning) } }
            }
        }
    }
}

/// Data that the script inflates when it needs it, each in an element of its own:
/// so a page opens without decoding what nobody looks at.
#[derive(Default)]
struct Blobs(Vec<(String, String)>);

impl Blobs {
    fn add(&mut self, text: String) -> String {
        let id = format!("viewer-blob-{}", self.0.len());
        self.0.push((id.clone(), text));
        id
    }
}

fn scene_data(scene: &ViewedScene<'_>, blobs: &mut Blobs) -> Value {
    let (width, height) = (scene.reference.width(), scene.reference.height());
    let reference = pack_picture(scene.reference, None);
    let packed: Vec<_> = scene
        .pictures
        .par_iter()
        .map(|p| {
            let flip = p.flip.map(|map| {
                assert_eq!(map.len(), width as usize * height as usize);
                pack(&map.iter().map(|v| (v * 255.0).round() as u8).collect::<Vec<_>>())
            });
            let explain = p.explain.as_ref().map(|e| pack(e.to_string().as_bytes()));
            (pack_picture(p.picture, Some(scene.reference)), flip, explain)
        })
        .collect();
    let reference = json!({
        "prediction": reference.prediction,
        "pixels": blobs.add(reference.text),
    });
    let pictures = scene.pictures.iter().zip(packed).map(|(p, (pixels, flip, explain))| {
        json!({
            "name": p.name,
            "exr": p.exr,
            "figures": p.figures,
            "command": p.command,
            "prediction": pixels.prediction,
            "pixels": blobs.add(pixels.text),
            "flip": flip.map(|text| blobs.add(text)),
            "explained": p.explain.as_ref().map(|e| e["pixel"].clone()),
            "explain": explain.map(|text| blobs.add(text)),
        })
    });
    json!({
        "name": scene.name,
        "samples": scene.samples,
        "width": width,
        "height": height,
        "pixel": scene.pixel,
        "trace": scene.trace,
        "seed": scene.seed,
        "pictures": pictures.collect::<Vec<_>>(),
        "reference": reference,
    })
}

/// JSON that cannot end the script element it stands in.
fn script_safe(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::tile::TileGrid;

    #[test]
    fn a_section_holds_its_data_and_asks_for_nothing() {
        let grid = TileGrid::new(9, 4);
        let reference = Picture::new(grid, [0.5; 3]);
        let picture = Picture::from_fn(grid, |x, _| [f64::from(x), 0.0, 0.25]);
        let flip = vec![0.5; 36];
        let viewed = ViewedPicture {
            name: "lk</script><b>".into(),
            picture: &picture,
            flip: Some(&flip),
            figures: vec![("RMSE".into(), "4.59 ± 0.02".into())],
            command: "screendoor replay a.arrow --design lk".into(),
            exr: "a-lk.exr".into(),
            explain: Some(json!({ "pixel": [3, 2], "steps": [] })),
        };
        let scene = ViewedScene {
            name: "a & b".into(),
            samples: 8,
            reference: &reference,
            pictures: vec![viewed],
            pixel: [3, 2],
            trace: "a.arrow".into(),
            seed: 0,
        };
        let page = element(&[scene]).into_string();
        assert!(page.contains("a &amp; b · 8 samples"));
        assert!(!page.contains("lk</script>"), "data ended its element");
        // The reference, the picture, its FLIP map and its explanation.
        assert_eq!(page.matches("id=\"viewer-blob-").count(), 4);
        assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
        for outside in ["src=", "href=", "url(", "@import", "fetch(", "XMLHttp", "import("] {
            assert!(!page.contains(outside) && !STYLE.contains(outside), "{outside}");
        }
    }
}
