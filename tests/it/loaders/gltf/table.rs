//! The table of what is read, in `docs/SCENES_GLTF.md`: every row holds.

use screendoor::scene::Scene;
use serde_json::json;

use super::model::{Model, is, middle};
use super::{core_rows, extension_rows};

const TABLE: &str = include_str!("../../../../docs/SCENES_GLTF.md");

/// What a row of the table is tried with.
pub struct Case {
    /// The row's first column.
    pub row: &'static str,
    pub edit: fn(&mut Model),
    /// What is said where it is warned of or refused.
    pub says: &'static str,
    /// Whether it is drawn as it should be.
    pub good: fn(&Scene) -> bool,
}

pub const RED: [u8; 4] = [255, 0, 0, 255];
pub const GREEN: [u8; 4] = [0, 255, 0, 255];
pub const NOTHING: [u8; 4] = [255, 255, 255, 0];

pub fn case(row: &'static str, edit: fn(&mut Model), good: fn(&Scene) -> bool) -> Case {
    Case { row, edit, says: "", good }
}

pub fn told(row: &'static str, says: &'static str, edit: fn(&mut Model)) -> Case {
    Case { row, edit, says, good: white }
}

/// The quad as it is without anything.
pub fn white(scene: &Scene) -> bool {
    is(middle(scene), [1.0; 3], 1.0)
}

pub fn x_of(scene: &Scene, i: usize) -> f64 {
    scene.objects[i].place.translation.x
}

/// The rows of the table: what, and what becomes of it.
fn rows() -> Vec<(&'static str, &'static str)> {
    let cells = |line: &'static str| {
        let mut cells = line.split('|').skip(1).map(str::trim);
        (cells.next().unwrap(), cells.next().unwrap())
    };
    let lines = TABLE.lines().filter(|line| line.starts_with("| "));
    lines.map(cells).filter(|(what, _)| *what != "what").collect()
}

/// The file of a row.
fn model(case: &Case, how: &str) -> Model {
    let mut model = Model::quad();
    (case.edit)(&mut model);
    if case.row.contains('_') {
        // Where nothing else says so, it stands in the material.
        if let Some(here) = model.material()["extensions"].as_object_mut()
            && let Some(said) = here.remove("THE_ROW")
        {
            here.insert(case.row.to_string(), said);
        }
        if case.row.contains("_texture_") && how == "warned" {
            // One texture without another image, and one with.
            model.textured(RED, RED);
            model.json["textures"][0] = json!({ "extensions": { case.row: { "source": 0 } } });
        }
        model.requires(case.row);
    }
    model
}

#[test]
fn every_row_holds() {
    let mut cases: Vec<Case> = core_rows::cases();
    cases.extend(extension_rows::cases());
    let rows = rows();
    assert!(rows.len() > 80, "{}", rows.len());
    let mut wrong: Vec<String> = Vec::new();
    for (what, how) in &rows {
        if !cases.iter().any(|case| case.row == *what) {
            assert!(what.starts_with(|c: char| c.is_uppercase()) && what.contains('_'), "{what}");
            cases.push(extension_rows::named(what));
        }
        let case = cases.iter().find(|case| case.row == *what).unwrap();
        let loaded = model(case, how).load();
        let good = |scene: &Scene| {
            if (case.good)(scene) { Ok(()) } else { Err(format!("{:?}", middle(scene))) }
        };
        let held = match (*how, &loaded) {
            ("read" | "approximated" | "passed", Ok(scene)) if scene.warnings.is_empty() => {
                good(scene)
            }
            ("warned", Ok(scene)) => {
                let says = |warning: &&String| warning.contains(case.says);
                match scene.warnings.iter().filter(says).count() {
                    1 => good(scene),
                    n => Err(format!("{n} of {:?}", scene.warnings)),
                }
            }
            ("refused", Err(error)) => {
                let error = error.to_string();
                let says = error.contains(case.says) && error.contains("a.gltf");
                if says { Ok(()) } else { Err(error) }
            }
            (_, Ok(scene)) => Err(format!("{:?}", scene.warnings)),
            (_, Err(error)) => Err(error.to_string()),
        };
        if let Err(why) = held {
            wrong.push(format!("{what} should be {how}: {why}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for case in cases {
        assert!(rows.iter().any(|(what, _)| *what == case.row), "{} has no row", case.row);
    }
}

#[test]
fn textures_whose_image_is_not_read_show_their_own() {
    for name in ["KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"] {
        let mut model = Model::quad();
        model.textured(RED, RED);
        model.json["images"].as_array_mut().unwrap().push(json!({ "uri": "a.ktx2" }));
        model.json["textures"][0]["extensions"] = json!({ name: { "source": 1 } });
        let scene = model.load().unwrap();
        assert!(is(middle(&scene), [1.0, 0.0, 0.0], 1.0), "{name}");
        crate::loaders::warned(&scene, 1, &[name, "(2 triangles)"]);
    }
}

#[test]
fn what_is_packed_is_read_where_it_is_unpacked_too() {
    let draco = "KHR_draco_mesh_compression";
    let packed = |edit: fn(&mut Model)| {
        let mut model = Model::quad();
        model.primitive()["extensions"] = json!({ draco: { "bufferView": 0, "attributes": {} } });
        model.json["extensionsUsed"].as_array_mut().unwrap().push(draco.into());
        edit(&mut model);
        model.load()
    };
    let scene = packed(|_| ()).unwrap();
    assert!(white(&scene) && scene.warnings.is_empty(), "{:?}", scene.warnings);
    let error = packed(|m| {
        m.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    });
    let error = error.unwrap_err().to_string();
    assert!(error.contains("no triangles") && error.contains(draco), "{error}");
    let mut required = Model::quad();
    required.requires(draco);
    let error = required.load().unwrap_err().to_string();
    assert!(error.contains("unpack it: gltf-transform copy"), "{error}");
    // A buffer that is there for those who do not unpack, without bytes.
    let mut model = Model::quad();
    model.json["buffers"][0].as_object_mut().unwrap().remove("uri");
    let error = model.load().unwrap_err().to_string();
    assert!(error.contains("its buffer's bytes are missing"), "{error}");
    model.json["bufferViews"][0]["extensions"] = json!({ "EXT_meshopt_compression": {} });
    let error = model.load().unwrap_err().to_string();
    assert!(error.contains("packed by EXT_meshopt_compression"), "{error}");
    assert!(error.contains("gltf-transform copy"), "{error}");
}
