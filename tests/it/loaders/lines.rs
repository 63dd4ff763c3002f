//! Lines of OBJ and glTF files as curves.

use serde_json::json;

use glam::{Vec3, Vec4};
use screendoor::capture::{Capture, CaptureOptions};
use screendoor::scene::{LoadOptions, Scene, Shape, Strands, load_with};

use super::folder;
use super::gltf::model::Model;

fn loaded(name: &str, bytes: &[u8], width: Option<f64>) -> Result<Scene, String> {
    let folder = folder(&[(name, bytes)]);
    let source = folder.path().join(name).display().to_string();
    let options = LoadOptions { line_width: width, ..LoadOptions::default() };
    load_with(&source, &options).map_err(|e| e.to_string())
}

fn strands(scene: &Scene, object: usize) -> &Strands {
    match &scene.shapes[scene.objects[object].shape] {
        Shape::Strands(strands) => strands,
        other => panic!("{other:?}"),
    }
}

const CURVES: &str = "v 0 0 0 1 0 0 0.5\nv 3 0 0 0 1 0 1\nv 3 4 0\nv 0 0 12\n\
     o one\nl 1 2/7 3\nl -1 1\no two\nl 4 3\n";

#[test]
fn curves_of_obj_files_are_strands_with_the_colours_of_their_points() {
    let scene = loaded("a.obj", CURVES.as_bytes(), None).unwrap();
    let [colours, width] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(colours.contains("2 of 4 vertices have no colour"), "{colours}");
    assert!(width.contains("how wide its 4 lines are") && width.contains("0.0024"), "{width}");
    assert_eq!(scene.objects.len(), 2);
    assert_eq!([&scene.objects[0].name, &scene.objects[1].name], ["one", "two"]);
    let one = strands(&scene, 0);
    assert_eq!(one.starts, [0, 3, 5]);
    let place = scene.objects[0].place;
    let at = |i: usize| place.transform_point3(one.points[i].as_dvec3()).as_vec3();
    assert_eq!([at(0), at(2), at(3)], [Vec3::ZERO, Vec3::new(3., 4., 0.), Vec3::new(0., 0., 12.)]);
    assert_eq!(one.colours[0], Vec4::new(1.0, 0.0, 0.0, 0.5));
    assert_eq!(one.colours.len(), 5);
    // The diagonal of 3 x 4 x 12 is 13.
    assert!(one.radii.iter().all(|r| (r - 13.0 * 0.0012).abs() < 1e-6), "{:?}", one.radii);
    let wide = loaded("a.obj", CURVES.as_bytes(), Some(0.5)).unwrap();
    assert_eq!(wide.warnings.len(), 1);
    assert!(strands(&wide, 1).radii.iter().all(|r| *r == 0.25));
}

#[test]
fn lines_beside_faces_are_drawn_where_a_width_is_given() {
    let text = format!("{CURVES}f 1 2 3\n");
    let scene = loaded("a.obj", text.as_bytes(), Some(0.1)).unwrap();
    // A triangle, and two for each line.
    assert_eq!(scene.primitive_count(), 9);
    let scene = loaded("a.obj", text.as_bytes(), None).unwrap();
    assert_eq!(scene.primitive_count(), 1);
    assert!(scene.warnings.iter().any(|w| w.contains("4 lines beside surfaces are not drawn")));
}

#[test]
fn lines_beside_splats_leave_these_alone() {
    let mut model = Model::quad();
    let [rotations, scales, opacities] = [("VEC4", 16), ("VEC3", 12), ("SCALAR", 4)]
        .map(|(shape, n)| model.floats(&vec![if shape == "VEC4" { 0.5 } else { 0.25 }; n], shape));
    let colours = model.floats(&[0.1; 12], "VEC3");
    let name = "KHR_gaussian_splatting";
    model.json["extensionsUsed"] = json!([name]);
    let positions = model.primitive()["attributes"]["POSITION"].clone();
    model.json["meshes"][0]["primitives"] = json!([
        { "mode": 0, "attributes": {
            "POSITION": positions,
            "KHR_gaussian_splatting:ROTATION": rotations,
            "KHR_gaussian_splatting:SCALE": scales,
            "KHR_gaussian_splatting:OPACITY": opacities,
            "KHR_gaussian_splatting:SH_DEGREE_0_COEF_0": colours },
          "extensions": { name: { "kernel": "ellipse", "colorSpace": "srgb_rec709_display" } } },
        { "mode": 1, "attributes": { "POSITION": positions } },
    ]);
    let scene = loaded("a.gltf", model.json.to_string().as_bytes(), None).unwrap();
    assert_eq!((scene.shapes.len(), scene.objects.len()), (1, 1), "{:?}", scene.warnings);
    assert!(scene.warnings.iter().any(|w| w.contains("2 lines beside surfaces are not drawn")));
    let options = CaptureOptions { width: 8, height: 8, ..CaptureOptions::default() };
    Capture::new(&scene, &options).unwrap();
}

#[test]
fn lines_in_places_of_several_sizes_are_of_one_width() {
    let mut model = Model::quad();
    model.primitive()["mode"] = 3.into();
    model.json["nodes"] = json!([
        { "mesh": 0 }, { "mesh": 0, "scale": [10, 10, 10] }, { "mesh": 0, "scale": [1, 1, 0] },
    ]);
    model.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    let scene = loaded("a.gltf", model.json.to_string().as_bytes(), Some(0.5)).unwrap();
    let radius = |object: usize| strands(&scene, object).radii[0];
    assert_eq!([radius(0), radius(1), radius(2)], [0.25, 0.025, 0.0]);
    assert!(scene.warnings.iter().any(|w| w.contains("squashed flat")), "{:?}", scene.warnings);
}

#[test]
fn lines_that_cannot_be_are_refused() {
    let refused = |text: &str, width| loaded("a.obj", text.as_bytes(), width).unwrap_err();
    assert!(
        refused("v 0 0 0\nv 1 0 0\nl 1 3\n", None)
            .contains("line 3 ('l 1 3'): vertex 3 is not there")
    );
    assert!(refused("v 0 0 0\nl\n", None).contains("the line has no points"));
    assert!(refused("v 0 0 0\nv 0 0 0\nl 1 2\n", None).contains("lines of no extent"));
    assert!(refused("v 0 0 0\nv 1 0 0\nl 1 x\n", None).contains("line 3"));
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(CURVES, Some(width)).contains("give a width above 0"));
    }
    let face = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert!(refused(face, Some(1.0)).contains("leave the line width out"));
}

#[test]
fn curves_of_gltf_files_are_joined_where_they_meet() {
    // The quad's corners 0 to 3, as lines 0-1, 1-2, 3-0; as a loop; as a strip.
    let scene = |mode: u32, indices: &[u16], width| {
        let mut model = Model::quad();
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let accessor = model.add(&bytes, 5123, "SCALAR", indices.len());
        let primitive = model.primitive();
        primitive["mode"] = mode.into();
        primitive["indices"] = accessor.into();
        model.json["nodes"][0]["scale"] = json!([2, 2, 2]);
        loaded("a.gltf", model.json.to_string().as_bytes(), width)
    };
    for (mode, indices, starts) in [
        (1, &[0, 1, 1, 2, 3, 0][..], &[0, 3, 5][..]),
        (2, &[0, 1, 2, 3], &[0, 5]),
        (3, &[0, 1, 2, 3], &[0, 4]),
    ] {
        let scene = scene(mode, indices, Some(0.5)).unwrap();
        let strands = strands(&scene, 0);
        assert_eq!(strands.starts, starts, "{mode}");
        // In the node's units, which are half as many.
        assert!(strands.radii.iter().all(|r| (r - 0.125).abs() < 1e-7), "{:?}", strands.radii);
        assert_eq!(scene.warnings, [""; 0]);
    }
    let error = scene(1, &[0, 9], None).unwrap_err();
    assert!(error.contains("it names vertex 9, of 4"), "{error}");
}
