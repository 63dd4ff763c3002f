//! glTF.

mod core_rows;
mod extension_rows;
mod inputs;
pub mod model;
mod table;

use glam::{Vec2, Vec3};
use screendoor::capture::{CameraChoice, CameraOptions, Capture, CaptureOptions};
use screendoor::error::Error;
use screendoor::scene::{Scene, Shape};
use serde_json::{Value, json};

use self::model::Model;
use super::{folder, load_in, mesh, png, warned};
use crate::hostile;
use crate::util::endlessly_scaled;

/// A glTF scene of one textured triangle, changed by `edit`.
fn gltf(edit: impl Fn(&mut Value)) -> Result<Scene, Error> {
    let image = png(image::RgbImage::from_pixel(2, 2, image::Rgb([255; 3])));
    let files: [(&str, &[u8]); 2] = [
        (
            "a.gltf",
            &hostile::gltf(|j| {
                textured(j);
                edit(j)
            }),
        ),
        ("a.png", &image),
    ];
    load_in(folder(&files).path(), "a.gltf")
}

/// Gives the triangle a material with a texture in `a.png`.
pub fn textured(json: &mut Value) {
    json["images"] = json!([{ "uri": "a.png" }]);
    json["textures"] = json!([{ "source": 0 }]);
    json["materials"] = json!([{ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 } }]);
    json["meshes"][0]["primitives"][0]["material"] = 0.into();
}

#[test]
fn application_specific_attributes_are_ignored() {
    let scene = gltf(|j| {
        let attributes = &mut j["meshes"][0]["primitives"][0]["attributes"];
        attributes["_FOO"] = 0.into();
        attributes["_BATCH_ID"] = 0.into();
    });
    assert_eq!(scene.unwrap().primitive_count(), 1);
    // A byte order mark is not in the way.
    let bytes = [b"\xef\xbb\xbf", &hostile::gltf(|_| ())[..]].concat();
    assert!(load_in(folder(&[("a.gltf", &bytes)]).path(), "a.gltf").is_ok());
}

#[test]
fn images_that_say_nothing_are_warnings() {
    let scene = gltf(|j| j["images"] = json!([{}])).unwrap();
    warned(&scene, 1, &["image 0: it names neither a file nor a buffer view"]);
    // The format stands in the bytes, whether the file says it or not.
    let scene = gltf(|j| j["images"] = json!([{ "bufferView": 0 }])).unwrap();
    warned(&scene, 1, &["image 0: the texture cannot be decoded"]);
    // Without its texture the material would glow all over.
    assert_eq!(scene.materials[0].emissive, Vec3::ZERO);
}

#[test]
fn emissive_textures_keep_their_transform() {
    let scene = gltf(|j| {
        let mut uvs = j["accessors"][0].clone();
        uvs["type"] = "VEC2".into();
        j["accessors"].as_array_mut().unwrap().push(uvs);
        j["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 1.into();
        let material = &mut j["materials"][0];
        material["emissiveTexture"]["extensions"] =
            json!({ "KHR_texture_transform": { "offset": [0.5, 0.25], "scale": [2, 4] } });
        material["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 0 } });
        j["extensionsUsed"] = json!(["KHR_texture_transform"]);
    });
    let scene = scene.unwrap();
    let transform = scene.materials[0].emissive_texture.unwrap().transform;
    assert_eq!(transform.transform_point2(Vec2::ONE), Vec2::new(2.5, 4.25));
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn what_is_wrong_is_an_error_of_one_line() {
    let error = gltf(|j| j["accessors"][0]["componentType"] = 7.into()).unwrap_err().to_string();
    let wanted = "a.gltf, mesh 0, primitive 0, POSITION, accessor 0: its componentType 7 is not \
                  one that glTF allows; export the file again";
    assert!(error.ends_with(wanted), "{error}");
    let error = gltf(|j| {
        let mut leaf = j["nodes"][0].clone();
        leaf["name"] = "a\nb".into();
        j["nodes"] = endlessly_scaled(leaf);
        j["scenes"][0]["nodes"] = json!([0]);
    });
    let error = error.unwrap_err().to_string();
    assert!(error.contains("object 'a b'") && !error.contains('\n'), "{error}");
    for (key, version) in [("version", "9.0"), ("version", "1.0"), ("minVersion", "3.0")] {
        let error = gltf(|j| j["asset"][key] = version.into()).unwrap_err().to_string();
        assert!(error.ends_with(&format!("it wants glTF {version}; export it as glTF 2.0")));
    }
    assert!(gltf(|j| j["asset"]["version"] = "2.1".into()).is_ok());
}

#[test]
fn textures_put_on_a_model_find_its_coordinates() {
    let model = model::Model::quad();
    let mut scene = model.load().unwrap();
    let red = png(image::RgbaImage::from_pixel(1, 1, image::Rgba([255, 0, 0, 255])));
    let folder = folder(&[("red.png", &red)]);
    scene.apply_texture(&folder.path().join("red.png")).unwrap();
    assert_eq!(mesh(&scene, 0).uvs[1], Vec2::ONE);
    assert!(model::is(model::middle(&scene), [1.0, 0.0, 0.0], 1.0));
}

#[test]
fn whitening_leaves_opacities_alone() {
    let mut model = model::Model::quad();
    model.textured([51, 0, 0, 255], [51, 0, 0, 255]);
    model.material()["extensions"]["KHR_materials_transmission"] =
        json!({ "transmissionFactor": 1, "transmissionTexture": { "index": 0 } });
    let mut scene = model.load().unwrap();
    scene.whiten();
    // A fifth of the light goes through what is white now.
    assert!(model::is(model::middle(&scene), [1.0; 3], 0.8));
}

#[test]
fn splats_of_drafts_are_read_and_what_is_not_known_is_told() {
    // Scales below 0 are logarithms.
    let mut model = Model::quad();
    extension_rows::splats(&mut model, -1.0);
    let scene = model.load().unwrap();
    let [Shape::Splats(splats)] = &scene.shapes[..] else { panic!("{:?}", scene.shapes) };
    assert_eq!(splats.scales, [glam::Vec3::splat((-1.0_f64).exp() as f32)]);
    for (key, value, says) in [
        ("kernel", "box", "splats of the kernel 'box' are not drawn (4 splats)"),
        ("colorSpace", "other", "splats of the colour space 'other' are not drawn"),
        ("projection", "fish", "splats of the projection 'fish' are not drawn"),
        ("kernel", "ellipse", "splats without ROTATION are not drawn"),
    ] {
        let mut model = Model::quad();
        model.another(0);
        model.json["meshes"][0]["primitives"][1]["extensions"] =
            json!({ "KHR_gaussian_splatting": { key: value } });
        warned(&model.load().unwrap(), 1, &[says]);
    }
    // What is no point is no splat, and no triangle either.
    let mut model = Model::quad();
    model.another(4);
    model.json["meshes"][0]["primitives"][1]["extensions"] =
        json!({ "KHR_gaussian_splatting": {} });
    let scene = model.load().unwrap();
    assert_eq!(scene.shapes.len(), 1);
    warned(&scene, 1, &["KHR_gaussian_splatting is for points"]);
}

#[test]
fn the_file_s_cameras_see_what_they_are_set_on() {
    let mut model = Model::quad();
    let field = |tangent: f64| 2.0 * tangent.atan();
    model.json["cameras"] = json!([
        { "type": "perspective", "name": "close", "perspective": { "yfov": field(1.0 / 3.0), "znear": 1 } },
        { "type": "orthographic", "name": "flat", "orthographic": { "xmag": 1, "ymag": 1, "zfar": 9, "znear": 0 } },
    ]);
    let place = json!([0, 0, 3]);
    model.json["nodes"] = json!([
        { "mesh": 0 },
        { "camera": 0, "translation": place },
        { "camera": 1, "translation": place },
    ]);
    model.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = model.load().unwrap();
    let chosen = |name: &str| {
        let camera = Some(name.into());
        let choice =
            CameraChoice { camera, name: None, size: Some([16, 16]), default_size: [1, 1] };
        choice.choose(&scene.cameras)
    };
    // The square fills the frame and ends with it.
    for name in ["close", "0"] {
        let camera = CameraOptions { pose: chosen(name).unwrap().pose, ..Default::default() };
        let options =
            CaptureOptions { width: 16, height: 16, samples: 4, camera, ..Default::default() };
        let trace = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
        let batches: Vec<_> = trace.batches().map(Result::unwrap).collect();
        let covered = batches.iter().flat_map(|b| b.iter()).map(|f| f.coverage.count());
        assert_eq!(covered.sum::<u32>(), 16 * 16 * 4, "{name}");
    }
    for (name, says) in [("flat", "not one in perspective"), ("clos", "close"), ("2", "unknown")] {
        let error = chosen(name).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}
