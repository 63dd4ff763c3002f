//! What the rows of glTF's core are tried with.

use glam::{DVec3, Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::model::{Model, at, drawn, is, middle};
use super::table::{Case, GREEN, NOTHING, RED, case, told, white, x_of};
use crate::loaders::mesh;

/// The rows of the core.
pub fn cases() -> Vec<Case> {
    vec![
        case("GLB files", |m| m.glb = true, white),
        case(
            "Buffers and images in files",
            |m| {
                m.textured(RED, RED);
                let corners = [-1_f32, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0];
                let bytes = corners.iter().flat_map(|v| v.to_le_bytes()).collect();
                m.file("a b.bin", bytes);
                m.json["buffers"][0]["uri"] = "a%20b.bin".into();
            },
            |s| is(middle(s), [1.0, 0.0, 0.0], 1.0),
        ),
        case("Data URIs", |_| (), white),
        case(
            "Strides and offsets",
            |m| {
                let corner = |x: f32, y: f32| [9.0, x, y, 0.0, 9.0];
                let all = [corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)];
                let position = m.floats(&all.concat(), "VEC3");
                m.json["accessors"][position]["count"] = 4.into();
                m.json["accessors"][position]["byteOffset"] = 4.into();
                m.json["bufferViews"][position]["byteStride"] = 20.into();
                m.primitive()["attributes"]["POSITION"] = position.into();
            },
            white,
        ),
        case(
            "Sparse accessors",
            |m| sparse(m, 1),
            |s| mesh(s, 0).positions[1] == Vec3::new(5.0, 6.0, 7.0),
        ),
        told(
            "Sparse values beyond the accessor's count",
            "accessor 0: its sparse values include element 4 of only 4",
            |m| sparse(m, 4),
        ),
        case(
            "Node transformations",
            |m| {
                let turned = std::f32::consts::FRAC_1_SQRT_2;
                m.json["nodes"] = json!([
                    { "children": [1], "matrix":
                        [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 10, 0, 0, 1] },
                    { "mesh": 0, "translation": [1, 2, 3], "scale": [3, 1, 1],
                      "rotation": [0, 0, turned, turned] },
                ]);
            },
            |s| {
                let p = s.objects[0].place.transform_point3(DVec3::X);
                p.distance(DVec3::new(12.0, 10.0, 6.0)) < 1e-5
            },
        ),
        told("Nodes with two parents", "it has two parents", |m| {
            m.json["nodes"] = json!([{ "children": [1, 2] }, { "children": [2] }, { "mesh": 0 }]);
        }),
        case("Triangles", |_| (), white),
        case("Triangle strips", |m| of_mode(m, 5, &[0, 1, 3, 2]), white),
        case("Triangle fans", |m| of_mode(m, 6, &[0, 1, 2, 3]), white),
        told("Points", "points are not drawn (4 points)", |m| m.another(0)),
        told("Lines", "9 lines beside surfaces are not drawn", |m| {
            (1..=3).for_each(|mode| m.another(mode))
        }),
        told(
            "Primitives without positions",
            "without positions are not drawn (2 triangles)",
            |m| {
                let mut primitive = m.primitive().clone();
                primitive["attributes"].as_object_mut().unwrap().remove("POSITION");
                m.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
            },
        ),
        case(
            "Normals",
            |m| {
                let normals = m.floats(&[0.0, 1.0, 0.0].repeat(4), "VEC3");
                m.primitive()["attributes"]["NORMAL"] = normals.into();
                m.json["materials"] = json!([{}]);
            },
            // Upwards is not where it is seen from.
            |s| middle(s).is_some_and(|(c, _)| (c[0] - 0.6559).abs() > 0.01),
        ),
        case(
            "Tangents",
            |m| {
                let tangents = m.floats(&[1.0, 0.0, 0.0, 1.0].repeat(4), "VEC4");
                m.primitive()["attributes"]["TANGENT"] = tangents.into();
            },
            white,
        ),
        case(
            "Vertex colours",
            |m| {
                let colours = m.add(&[255, 0, 0, 51].repeat(4), 5121, "VEC4", 4);
                m.json["accessors"][colours]["normalized"] = true.into();
                m.primitive()["attributes"]["COLOR_0"] = colours.into();
                m.material()["alphaMode"] = "BLEND".into();
            },
            |s| is(middle(s), [1.0, 0.0, 0.0], 0.2),
        ),
        case(
            "Attributes of applications",
            |m| m.primitive()["attributes"]["_ID"] = 999.into(),
            white,
        ),
        case(
            "Two sets of texture coordinates",
            |m| {
                sets(m);
                m.material()["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 0.into();
            },
            |s| {
                let material = &s.materials[0];
                let sets =
                    [material.base_texture, material.emissive_texture].map(|t| t.unwrap().set);
                // Red where the base is sampled, green where the emission is.
                sets == [0, 1] && is(middle(s), [0.6559, 1.0, 0.0], 1.0)
            },
        ),
        Case {
            row: "Three sets of texture coordinates",
            says: "more than 2 sets of texture coordinates",
            edit: |m| {
                sets(m);
                m.material()["extensions"] = json!({ "KHR_materials_transmission":
                    { "transmissionFactor": 0, "transmissionTexture":
                        { "index": 0, "texCoord": 2 } } });
            },
            good: |s| is(middle(s), [1.6559, 0.0, 0.0], 1.0),
        },
        Case {
            row: "Missing texture coordinates",
            says: "TEXCOORD_7 of materials are not there (2 triangles)",
            edit: |m| {
                m.textured(RED, GREEN);
                m.json["samplers"] = json!([{ "magFilter": 9728 }]);
                m.json["textures"][0]["sampler"] = 0.into();
                m.material()["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 7.into();
            },
            good: |s| is(middle(s), [1.0, 0.0, 0.0], 1.0),
        },
        case(
            "Base colours",
            |m| {
                m.textured(RED, RED);
                m.material()["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 1, 1, 1]);
            },
            |s| is(middle(s), [0.5, 0.0, 0.0], 1.0),
        ),
        case(
            "Opaque materials",
            |m| m.textured(NOTHING, [255; 4]),
            |s| drawn(s).iter().all(|f| f.alpha == 1.0 && f.colour == [1.0; 3]),
        ),
        case(
            "Masked materials",
            |m| {
                m.textured([255, 255, 255, 100], [255; 4]);
                m.material()["alphaMode"] = "MASK".into();
            },
            |s| at(s, 8, 16).is_none() && is(at(s, 24, 16), [1.0; 3], 1.0),
        ),
        case(
            "Blended materials",
            |m| {
                m.textured([255, 0, 0, 51], [255, 0, 0, 51]);
                m.material()["alphaMode"] = "BLEND".into();
                m.material()["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0.5]);
            },
            |s| is(middle(s), [1.0, 0.0, 0.0], 0.1),
        ),
        case(
            "One-sided materials",
            |m| {
                m.json["nodes"] = json!([{ "children": [1, 2] }, { "mesh": 0 },
                    { "mesh": 0, "rotation": [0, 1, 0, 0], "translation": [0, 0, 1] }]);
            },
            |s| drawn(s).iter().all(|f| f.object == 0) && white(s),
        ),
        case(
            "Emission",
            |m| {
                m.textured([0, 255, 0, 0], [0, 255, 0, 0]);
                m.json["materials"] = json!([{
                    "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] },
                    "emissiveFactor": [1, 0.5, 1], "emissiveTexture": { "index": 0 },
                }]);
            },
            |s| is(middle(s), [0.0, 0.5, 0.0], 1.0),
        ),
        case(
            "Metals and roughness",
            |m| {
                m.json["materials"] = json!([{ "pbrMetallicRoughness":
                    { "metallicFactor": 1, "roughnessFactor": 0 } }]);
            },
            |s| is(middle(s), [0.6559; 3], 1.0),
        ),
        told("Metallic-roughness textures", "metallicRoughness textures are not read", |m| {
            m.material()["pbrMetallicRoughness"] =
                json!({ "metallicRoughnessTexture": { "index": 0 } });
        }),
        told("Normal textures", "normal textures are not read", |m| {
            m.material()["normalTexture"] = json!({ "index": 0, "scale": 2 });
        }),
        told("Occlusion textures", "occlusion textures are not read", |m| {
            m.material()["occlusionTexture"] = json!({ "index": 0 });
        }),
        case(
            "Nearest filters",
            |m| {
                m.textured(RED, GREEN);
                m.json["samplers"] = json!([{ "magFilter": 9728, "minFilter": 9728 }]);
                m.json["textures"][0]["sampler"] = 0.into();
            },
            |s| {
                let pure = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
                drawn(s).iter().all(|f| pure.contains(&f.colour))
            },
        ),
        case(
            "Wrapping",
            |m| {
                m.textured(RED, GREEN);
                m.json["samplers"] = json!([{ "wrapS": 33648, "wrapT": 33071 }]);
                m.json["textures"][0]["sampler"] = 0.into();
            },
            |s| {
                // Mirrored aside: beyond the left edge comes the left texel again.
                let texture = &s.textures[0];
                let beyond = |x, y| texture.sample(Vec2::new(x, y), Vec2::ZERO, Vec2::ZERO);
                beyond(-0.25, 0.5) == Vec4::new(1.0, 0.0, 0.0, 1.0)
                    && beyond(0.25, 9.5) == beyond(0.25, 0.5)
            },
        ),
        case(
            "PNG and JPEG images",
            |m| {
                m.textured(RED, RED);
                let image = image::RgbImage::from_pixel(8, 8, image::Rgb([0, 0, 255]));
                let mut jpeg = std::io::Cursor::new(Vec::new());
                image.write_to(&mut jpeg, image::ImageFormat::Jpeg).unwrap();
                m.file("b.jpg", jpeg.into_inner());
                m.json["images"] = json!([{ "uri": "a.png" }, { "uri": "b.jpg" }]);
                m.json["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
                let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 } },
                    "extensions": { "KHR_materials_unlit": {} } });
                m.json["materials"].as_array_mut().unwrap().push(material);
                m.json["meshes"] = json!([m.json["meshes"][0], m.json["meshes"][0]]);
                m.json["meshes"][1]["primitives"][0]["material"] = 1.into();
                m.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1, "translation": [2, 0, 0] }]);
                m.json["scenes"] = json!([{ "nodes": [0, 1] }]);
            },
            |s| {
                let blue = |c: [f32; 3]| c[2] > 0.95 && c[0] < 0.01;
                let seen = drawn(s);
                seen.iter().all(|f| if f.object == 0 { f.colour[0] == 1.0 } else { blue(f.colour) })
                    && seen.iter().any(|f| f.object == 1)
            },
        ),
        told("Images that are missing", "image 0: cannot read", |m| {
            m.textured(RED, RED);
            m.files.clear();
        }),
        case("Skins", skin, |s| {
            let xs: Vec<f32> = mesh(s, 0).positions.iter().map(|p| p.x).collect();
            // Half of each joint: 4 + 6 aside of where the vertices are, whatever the node says.
            xs == [4.0, 6.0, 6.0, 4.0] && x_of(s, 0) == 0.0
        }),
        case("Morph targets", morph, |s| {
            let mesh = mesh(s, 0);
            // A quarter of the first and nothing of the second.
            mesh.positions[1] == Vec3::new(2.0, -1.0, 0.0)
                && mesh.uvs[0] == Vec2::new(0.25, 1.0)
                && mesh.colours[0] == Vec4::new(0.25, 0.0, 0.0, 1.0)
        }),
        told("Animations", "its 2 animations are not played (2 triangles)", |m| {
            animation(m, json!({ "node": 0, "path": "translation" }));
            animation(m, json!({ "node": 0, "path": "pointer" }));
        }),
        told("Channels without a node", "its animation 'a b' is not played (0 triangles)", |m| {
            animation(m, json!({ "path": "translation" }));
            m.json["animations"][0]["name"] = "a\nb".into();
        }),
        case(
            "Cameras",
            |m| {
                m.json["cameras"] = json!([{ "type": "perspective",
                    "perspective": { "yfov": 1, "znear": 1 } }]);
                m.json["nodes"][0]["camera"] = 0.into();
            },
            |s| white(s) && s.cameras[0].field_of_view == Some(1.0),
        ),
        told("Several scenes", "of its 2 scenes only 'main' is drawn (1 other scene)", |m| {
            m.json["scenes"] = json!([{ "nodes": [] }, { "nodes": [0], "name": "main" }]);
            m.json["scene"] = 1.into();
        }),
        case("Extras", |m| m.json["nodes"][0]["extras"] = json!({ "a": [1, null] }), white),
        told("Later versions", "it wants glTF 3.0", |m| {
            m.json["asset"]["minVersion"] = "3.0".into()
        }),
    ]
}

fn sparse(m: &mut Model, element: u8) {
    let index = m.add(&[element], 5121, "SCALAR", 1);
    let value = m.floats(&[5.0, 6.0, 7.0], "VEC3");
    let view = |m: &Model, a: usize| m.json["accessors"][a]["bufferView"].clone();
    m.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": view(m, index), "componentType": 5121 },
        "values": { "bufferView": view(m, value) },
    });
}

fn of_mode(m: &mut Model, mode: u32, indices: &[u8]) {
    let indices = m.add(indices, 5121, "SCALAR", 4);
    m.primitive()["mode"] = mode.into();
    m.primitive()["indices"] = indices.into();
}

/// A base texture by the set 0 and an emissive one by the set 1, which looks elsewhere.
fn sets(m: &mut Model) {
    m.textured(RED, GREEN);
    m.json["samplers"] = json!([{ "magFilter": 9728, "minFilter": 9728 }]);
    m.json["textures"][0]["sampler"] = 0.into();
    for (set, u) in [(0, 0.25), (1, 0.75), (2, 0.25)] {
        let uvs = m.floats(&[u, 0.5].repeat(4), "VEC2");
        m.primitive()["attributes"][format!("TEXCOORD_{set}")] = uvs.into();
    }
    m.json["materials"] = json!([{
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
        "emissiveFactor": [1, 1, 1],
        "emissiveTexture": { "index": 0, "texCoord": 1 },
    }]);
}

/// Two joints at 4 and at 6, half of each, and a node that stands elsewhere.
fn skin(m: &mut Model) {
    let joints = m.add(&[0, 1, 0, 0].repeat(4), 5121, "VEC4", 4);
    let weights = m.floats(&[0.5, 0.5, 0.0, 0.0].repeat(4), "VEC4");
    let attributes = &mut m.primitive()["attributes"];
    attributes["JOINTS_0"] = joints.into();
    attributes["WEIGHTS_0"] = weights.into();
    m.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [0, 100, 0] },
        { "children": [2], "translation": [4, 0, 0] },
        { "translation": [2, 0, 0] },
    ]);
    m.json["scenes"][0]["nodes"] = json!([0, 1]);
    m.json["skins"] = json!([{ "joints": [1, 2] }]);
}

fn morph(m: &mut Model) {
    let moved = m.floats(&[4.0, 0.0, 0.0].repeat(4), "VEC3");
    let far = m.floats(&[99.0; 12], "VEC3");
    let uvs = m.floats(&[1.0, 0.0].repeat(4), "VEC2");
    let colours = m.floats(&[0.0; 16], "VEC4");
    let black = m.floats(&[0.0, 0.0, 0.0, 1.0].repeat(4), "VEC4");
    let red = m.floats(&[1.0, 0.0, 0.0].repeat(4), "VEC3");
    m.primitive()["attributes"]["COLOR_0"] = black.into();
    m.primitive()["targets"] = json!([
        { "POSITION": moved, "TEXCOORD_0": uvs, "COLOR_0": red },
        { "POSITION": far, "COLOR_0": colours },
    ]);
    // The node's weights come before the mesh's.
    m.json["meshes"][0]["weights"] = json!([0, 1]);
    m.json["nodes"][0]["weights"] = json!([0.25, 0]);
    m.textured([255; 4], [255; 4]);
}

fn animation(m: &mut Model, target: Value) {
    let times = m.floats(&[0.0, 1.0], "SCALAR");
    let places = m.floats(&[0.0; 6], "VEC3");
    let animation = json!({
        "samplers": [{ "input": times, "output": places }],
        "channels": [{ "sampler": 0, "target": target }],
    });
    if !m.json["animations"].is_array() {
        m.json["animations"] = json!([]);
    }
    m.json["animations"].as_array_mut().unwrap().push(animation);
}
