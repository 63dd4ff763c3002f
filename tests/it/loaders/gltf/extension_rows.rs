//! What the rows of extensions are tried with.

use glam::{DVec3, Vec2, Vec3};
use screendoor::scene::Shape;
use serde_json::json;

use super::model::{Model, is, middle};
use super::table::{Case, GREEN, RED, case, told, white, x_of};
use crate::loaders::mesh;

/// One splat of that size in place of the mesh.
pub fn splats(m: &mut Model, scale: f32) {
    let name = |name: &str| format!("KHR_gaussian_splatting:{name}");
    let mut attributes = serde_json::Map::new();
    attributes.insert("POSITION".into(), m.floats(&[1.0, 2.0, 3.0], "VEC3").into());
    attributes.insert(name("ROTATION"), m.add(&[0, 0, 127, 0], 5120, "VEC4", 1).into());
    attributes.insert(name("SCALE"), m.floats(&[scale; 3], "VEC3").into());
    attributes.insert(name("OPACITY"), m.floats(&[0.25], "SCALAR").into());
    for (l, n) in [(0, 0), (1, 0), (1, 1), (1, 2)] {
        let harmonic = m.floats(&[1.0 + n as f32, 2.0, 3.0 - n as f32], "VEC3");
        attributes.insert(name(&format!("SH_DEGREE_{l}_COEF_{n}")), harmonic.into());
    }
    *m.primitive() = json!({ "mode": 0, "attributes": attributes, "extensions": {
        "KHR_gaussian_splatting": { "kernel": "ellipse", "colorSpace": "srgb_rec709_display",
            "projection": "perspective", "sortingMethod": "cameraDistance" } } });
}

/// The rows of extensions that are not only named.
pub fn cases() -> Vec<Case> {
    vec![
        case(
            "EXT_mesh_gpu_instancing",
            |m| {
                let places = m.floats(&[-4.0, 0.0, 0.0, 4.0, 0.0, 0.0], "VEC3");
                let turns = m.add(&[0, 0, 127, 0, 0, 0, 0, 127], 5120, "VEC4", 2);
                let sizes = m.floats(&[2.0, 2.0, 2.0, 1.0, 1.0, 1.0], "VEC3");
                m.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": {
                    "attributes": { "TRANSLATION": places, "ROTATION": turns, "SCALE": sizes } } });
            },
            |s| {
                let corner = s.objects[0].place.transform_point3(DVec3::ONE);
                s.objects.len() == 2
                    && x_of(s, 1) == 4.0
                    && corner.distance(DVec3::new(-6.0, -2.0, 2.0)) < 1e-6
            },
        ),
        case(
            "EXT_texture_webp",
            |m| {
                let mut bytes = std::io::Cursor::new(Vec::new());
                let image = image::RgbImage::from_pixel(2, 2, image::Rgb([0, 0, 255]));
                image.write_to(&mut bytes, image::ImageFormat::WebP).unwrap();
                m.textured(RED, RED);
                m.file("a.webp", bytes.into_inner());
                m.json["images"] = json!([{ "uri": "a.png" }, { "uri": "a.webp" }]);
                m.json["textures"][0]["extensions"] =
                    json!({ "EXT_texture_webp": { "source": 1 } });
            },
            |s| is(middle(s), [0.0, 0.0, 1.0], 1.0),
        ),
        case(
            "KHR_materials_emissive_strength",
            |m| {
                m.json["materials"] = json!([{
                    "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] },
                    "emissiveFactor": [1, 0.5, 0],
                    "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } },
                }]);
            },
            |s| is(middle(s), [8.0, 4.0, 0.0], 1.0),
        ),
        case(
            "KHR_materials_pbrSpecularGlossiness",
            |m| {
                m.textured([255, 0, 0, 128], [255, 0, 0, 128]);
                let texture = json!({ "index": 0 });
                m.json["materials"] = json!([{ "alphaMode": "BLEND", "extensions": {
                    "KHR_materials_unlit": {},
                    "KHR_materials_pbrSpecularGlossiness":
                        { "diffuseFactor": [1, 1, 1, 0.5], "diffuseTexture": texture } } }]);
            },
            |s| is(middle(s), [1.0, 0.0, 0.0], 0.5 * 128.0 / 255.0),
        ),
        case(
            "KHR_materials_transmission",
            |m| {
                m.textured([51, 0, 0, 0], [51, 0, 0, 0]);
                m.json["materials"] = json!([{
                    "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 0.5, 1] },
                    "extensions": {
                        "KHR_materials_unlit": {},
                        "KHR_materials_transmission":
                            { "transmissionFactor": 0.5, "transmissionTexture": { "index": 0 } },
                    },
                }]);
            },
            // Its texture's numbers are no colours, and its alpha does not count.
            |s| is(middle(s), [1.0, 1.0, 0.5], 1.0 - 0.5 * 0.2 * 2.5 / 3.0),
        ),
        case(
            "KHR_materials_unlit",
            |m| {
                m.material()["emissiveFactor"] = json!([1, 1, 1]);
                m.material()["pbrMetallicRoughness"] = json!({ "baseColorFactor": [0, 0.5, 0, 1] });
            },
            |s| is(middle(s), [0.0, 0.5, 0.0], 1.0),
        ),
        case(
            "KHR_mesh_quantization",
            |m| {
                let corners =
                    [-100_i16, -100, 0, 0, 100, -100, 0, 0, 100, 100, 0, 0, -100, 100, 0, 0];
                let bytes: Vec<u8> = corners.iter().flat_map(|v| v.to_le_bytes()).collect();
                let position = m.add(&bytes, 5122, "VEC3", 4);
                m.json["bufferViews"][position]["byteStride"] = 8.into();
                let normal = m.add(&[0, 0, 127, 0].repeat(4), 5120, "VEC3", 4);
                m.json["bufferViews"][normal]["byteStride"] = 4.into();
                let uv = m.add(&[0, 2, 2, 2, 2, 0, 0, 0], 5121, "VEC2", 4);
                m.primitive()["attributes"] =
                    json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv });
                m.textured(RED, RED);
            },
            |s| {
                let mesh = mesh(s, 0);
                mesh.positions[2] == Vec3::new(100.0, 100.0, 0.0)
                    && mesh.normals[0] == Vec3::Z
                    && mesh.uvs[1] == Vec2::new(2.0, 2.0)
            },
        ),
        case(
            "KHR_node_visibility",
            |m| {
                m.json["nodes"] = json!([
                    { "children": [1], "extensions": { "KHR_node_visibility": { "visible": false } } },
                    { "mesh": 0 },
                    { "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": true } } },
                ]);
                m.json["scenes"][0]["nodes"] = json!([0, 2]);
            },
            |s| s.objects.len() == 1 && s.objects[0].name == "node 2",
        ),
        case(
            "KHR_texture_transform",
            |m| {
                m.textured(RED, GREEN);
                m.material()["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = json!({
                    "KHR_texture_transform":
                        { "offset": [0.75, 0], "scale": [0, 1], "rotation": 0, "texCoord": 0 } });
            },
            |s| is(middle(s), [0.0, 1.0, 0.0], 1.0),
        ),
        case(
            "KHR_gaussian_splatting",
            |m| splats(m, 0.5),
            |s| {
                let [Shape::Splats(splats)] = &s.shapes[..] else { return false };
                splats.means == [Vec3::new(1.0, 2.0, 3.0)]
                    && splats.scales == [Vec3::new(0.5, 0.5, 0.5)]
                    && splats.rotations[0].z == 1.0
                    && splats.opacities == [0.25]
                    && (splats.degree, splats.harmonics[3]) == (1, [3.0, 2.0, 1.0])
            },
        ),
        case(
            "KHR_gaussian_splatting_compression_spz_2",
            |m| {
                let bytes = crate::loaders::splats::spz(2, false);
                let accessor = m.add(&bytes, 5121, "SCALAR", bytes.len());
                let spz = m.json["accessors"][accessor]["bufferView"].clone();
                *m.primitive() = json!({ "mode": 0, "attributes": {}, "extensions": {
                    "KHR_gaussian_splatting": { "extensions": {
                        "KHR_gaussian_splatting_compression_spz_2": { "bufferView": spz } } } } });
            },
            |s| matches!(&s.shapes[..], [Shape::Splats(splats)] if splats.means.len() == 3),
        ),
        told("KHR_lights_punctual", "by the capture's own lights (2 triangles)", |m| {
            m.json["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
        }),
        told("KHR_materials_variants", "with their default materials (2 triangles)", |m| {
            m.primitive()["extensions"] = json!({ "KHR_materials_variants": { "mappings": [] } });
        }),
        told("MSFT_lod", "MSFT_lod is not read", |m| {
            m.json["nodes"][0]["extensions"] = json!({ "MSFT_lod": { "ids": [0] } });
        }),
        told("Extensions that are not known", "ACME_glow is not read", |m| {
            m.material()["extensions"]["ACME_glow"] = json!({ "a": 1 });
        }),
        told("Extensions that are not known and required", "it requires ACME_glow", |m| {
            m.requires("ACME_glow");
        }),
    ]
}

/// A row of which nothing is known but its name: the extension stands where it has its
/// place and is required.
pub fn named(row: &'static str) -> Case {
    let edit: fn(&mut Model) = if row.contains("_texture_") {
        |_| ()
    } else {
        |m| m.material()["extensions"]["THE_ROW"] = json!({})
    };
    Case { row, edit, says: row, good: white }
}
