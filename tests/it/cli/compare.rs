//! Pictures of other programs: their windows, parts, layers and alpha.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use super::Workplace;

fn input(name: &str) -> String {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/inputs/pictures");
    folder.join(name).to_str().unwrap().to_string()
}

/// What `compare` says of two inputs, as text and as JSON.
fn compared(a: &str, b: &str, more: &[&str]) -> (String, Value) {
    let place = Workplace::new();
    let (a, b) = (input(a), input(b));
    let arguments = [&["compare", &a, &b], more].concat();
    let text = place.good(&arguments);
    let json = place.good(&[&arguments[..], &["--json", "-"]].concat());
    (text, serde_json::from_str(&json).unwrap())
}

const SAME: &str = "the pictures are identical, bit for bit";

#[test]
fn a_moved_data_window_is_a_difference() {
    let (text, json) = compared("shift.exr", "ref.exr", &[]);
    assert!(text.contains("the data window is moved by (4,2)") && !text.contains(SAME), "{text}");
    assert_eq!(json["identical"], false);
    assert_eq!((&json["width"], &json["height"]), (&36.into(), &26.into()));
    assert!(json["errors"]["rmse"].as_f64().unwrap() > 1.0);
    assert_eq!(json["data_windows"][0]["origin"], serde_json::json!([4, 2]));
    let (text, _) = compared("shift.exr", "shift.exr", &[]);
    assert!(text.contains(SAME), "{text}");
}

#[test]
fn layers_have_dots_and_parts_have_names() {
    for (a, b, layer) in [
        ("blender.exr", "ref.exr", "ViewLayer.Combined"),
        ("ref.exr", "blender.exr", "ViewLayer.Combined"),
        ("multi.exr", "ref.exr", "rgba"),
    ] {
        let (text, json) = compared(a, b, &["--layer", layer]);
        assert!(text.contains(SAME), "{a} {b}: {text}");
        assert_eq!(json["identical"], true);
        assert!(json["layers"].as_array().unwrap().contains(&layer.into()));
    }
    // Without a name the first that is a picture, and the others are told.
    let (text, _) = compared("multi.exr", "ref.exr", &[]);
    assert!(text.contains(SAME) && text.contains("layer rgba; not compared: depth"), "{text}");
    let place = Workplace::new();
    let bad =
        |layer| place.bad(&["compare", &input("multi.exr"), &input("ref.exr"), "--layer", layer]);
    let (code, error) = bad("rgb");
    assert!(code == 2 && error.contains("did you mean 'rgba'?"), "{error}");
    let (code, error) = bad("depth");
    assert!(code == 1 && error.contains("depth (channels Z) is no picture"), "{error}");
    let (code, error) =
        place.bad(&["compare", &input("ref.exr"), &input("ref.exr"), "--layer", "a"]);
    assert!(code == 2 && error.contains("its layers have no names"), "{error}");
}

#[test]
fn alpha_alone_is_told() {
    let (text, json) = compared("u8_alpha0.png", "u8.png", &[]);
    assert!(text.contains("only alpha differs: at "), "{text}");
    assert!(text.contains("u8.png has no alpha, which counts as opaque"), "{text}");
    assert!(!text.contains(SAME) && text.contains("the colours are identical"), "{text}");
    assert_eq!(json["identical"], false);
    assert!(json["alpha"]["pixels"].as_u64().unwrap() > 0 && json["alpha"]["max"] == 1.0);
    let (text, json) = compared("u8.png", "u8.png", &[]);
    assert!(text.contains(SAME) && json["alpha"].is_null(), "{text}");
    let (text, json) = compared("u8_alpha0.png", "u8_alpha0.png", &[]);
    assert!(text.contains(SAME) && json["alpha"]["pixels"] == 0, "{text}");
}

#[test]
fn sixteen_bits_are_not_cut_to_eight() {
    let place = Workplace::new();
    for (name, low) in [("a.png", 0_u16), ("b.png", 1)] {
        let pixels: Vec<u16> = (0..12_u16).map(|i| (i << 12) + low).collect();
        let image: image::ImageBuffer<image::Rgb<u16>, _> =
            image::ImageBuffer::from_raw(2, 2, pixels).unwrap();
        image.save(place.path(name)).unwrap();
    }
    let json = place.good(&["compare", "a.png", "b.png", "--json", "-"]);
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["identical"], false);
    assert!(json["errors"]["max"].as_f64().unwrap() < 0.1);
}

#[test]
fn a_picture_of_another_size_is_refused() {
    let place = Workplace::with_trace();
    place.good(&["replay", "t.arrow", "-o", "a.exr"]);
    fs::copy(input("ref.exr"), place.path("ref.exr")).unwrap();
    let (code, error) = place.bad(&["compare", "a.exr", "ref.exr"]);
    assert!(code == 2 && error.contains("a.exr is 48x40, ref.exr is 32x24"), "{error}");
}
