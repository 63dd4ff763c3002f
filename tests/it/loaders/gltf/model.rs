//! Small glTF files, made part by part.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use screendoor::capture::{CameraOptions, Capture, CaptureOptions};
use screendoor::error::Error;
use screendoor::scene::Scene;
use screendoor::trace::{ColourFormat, Fragment};
use serde_json::{Value, json};

use crate::loaders::{folder, load_in};

/// A document with the files beside it.
pub struct Model {
    pub json: Value,
    pub files: Vec<(String, Vec<u8>)>,
    /// Whether it is written as GLB, with its first buffer in it.
    pub glb: bool,
}

impl Model {
    /// A quad from (−1, −1) to (1, 1) that faces +z, with texture coordinates and a white
    /// material without light and shade.
    pub fn quad() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "materials": [{ "extensions": { "KHR_materials_unlit": {} } }],
            "extensionsUsed": ["KHR_materials_unlit"],
            "buffers": [], "bufferViews": [], "accessors": [],
        });
        let mut model = Model { json, files: Vec::new(), glb: false };
        let corners = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0].map(|v| v as f32);
        let position = model.floats(&corners, "VEC3");
        let uv = model.floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0], "VEC2");
        let indices = model.add(&[0, 1, 2, 0, 2, 3], 5121, "SCALAR", 6);
        model.json["meshes"] = json!([{ "primitives": [{
            "attributes": { "POSITION": position, "TEXCOORD_0": uv },
            "indices": indices,
            "material": 0,
        }] }]);
        model
    }

    /// Adds an accessor with a buffer of its own.
    pub fn add(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let list = |json: &mut Value, name: &str, what: Value| {
            let list = json[name].as_array_mut().unwrap();
            list.push(what);
            list.len() - 1
        };
        let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes));
        let buffer =
            list(&mut self.json, "buffers", json!({ "byteLength": bytes.len(), "uri": uri }));
        let view = json!({ "buffer": buffer, "byteLength": bytes.len() });
        let view = list(&mut self.json, "bufferViews", view);
        let accessor = json!({
            "bufferView": view, "componentType": component, "type": shape, "count": count,
        });
        list(&mut self.json, "accessors", accessor)
    }

    /// Adds an accessor of floats.
    pub fn floats(&mut self, numbers: &[f32], shape: &str) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.add(&bytes, 5126, shape, numbers.len() / width)
    }

    /// Adds a file.
    pub fn file(&mut self, name: &str, bytes: Vec<u8>) {
        self.files.push((name.to_string(), bytes));
    }

    /// The primitive.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// The material.
    pub fn material(&mut self) -> &mut Value {
        &mut self.json["materials"][0]
    }

    /// Gives the material a base texture in `a.png`, of two texels beside each other.
    pub fn textured(&mut self, left: [u8; 4], right: [u8; 4]) {
        let texel = |x, _| image::Rgba(if x == 0 { left } else { right });
        let image = crate::loaders::png(image::RgbaImage::from_fn(2, 1, texel));
        self.file("a.png", image);
        self.json["images"] = json!([{ "uri": "a.png" }]);
        self.json["textures"] = json!([{ "source": 0 }]);
        self.material()["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 0 } });
    }

    /// Adds another primitive, of points or what `mode` says, that has the first one's
    /// vertices.
    pub fn another(&mut self, mode: u32) {
        let mut primitive = self.primitive().clone();
        primitive["mode"] = mode.into();
        primitive.as_object_mut().unwrap().remove("indices");
        self.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }

    /// Declares that an extension is used, and required.
    pub fn requires(&mut self, name: &str) {
        for list in ["extensionsUsed", "extensionsRequired"] {
            if !self.json[list].is_array() {
                self.json[list] = json!([]);
            }
            self.json[list].as_array_mut().unwrap().push(name.into());
        }
    }

    /// Writes it to a folder of its own and loads it.
    pub fn load(&self) -> Result<Scene, Error> {
        let (name, bytes) = if self.glb {
            ("a.glb", self.to_glb())
        } else {
            ("a.gltf", serde_json::to_vec(&self.json).unwrap())
        };
        let mut files: Vec<(&str, &[u8])> = vec![(name, &bytes)];
        files.extend(self.files.iter().map(|(name, bytes)| (&name[..], &bytes[..])));
        load_in(folder(&files).path(), name)
    }

    fn to_glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let uri = json["buffers"][0].as_object_mut().unwrap().remove("uri").unwrap();
        let data = uri.as_str().unwrap().split_once(',').unwrap().1;
        let mut chunks = Vec::new();
        let parts: [(&[u8], Vec<u8>, u8); 3] = [
            (b"JSON", serde_json::to_vec(&json).unwrap(), b' '),
            (b"ACME", vec![1, 2, 3, 4], 0),
            (b"BIN\0", STANDARD.decode(data).unwrap(), 0),
        ];
        for (kind, mut bytes, padding) in parts {
            bytes.resize(bytes.len().next_multiple_of(4), padding);
            chunks.extend([&(bytes.len() as u32).to_le_bytes()[..], kind, &bytes].concat());
        }
        let length = (chunks.len() as u32 + 12).to_le_bytes();
        [&b"glTF\x02\0\0\0"[..], &length, &chunks].concat()
    }
}

/// All fragments of a scene seen from the front along parallel lines, 32 × 32 pixels.
pub fn drawn(scene: &Scene) -> Vec<Fragment> {
    let camera = CameraOptions {
        angle: Some([0.0, 0.0]),
        field_of_view: Some(0.0),
        ..CameraOptions::default()
    };
    let options = CaptureOptions {
        width: 32,
        height: 32,
        samples: 4,
        colour: ColourFormat::F32,
        camera,
        ..CaptureOptions::default()
    };
    let trace = Capture::new(scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
}

/// The colour and the alpha of the first fragment at a pixel.
pub fn at(scene: &Scene, x: u16, y: u16) -> Option<([f32; 3], f32)> {
    let all = drawn(scene);
    all.iter().find(|f| (f.x, f.y) == (x, y)).map(|f| (f.colour, f.alpha))
}

/// The same, in the middle.
pub fn middle(scene: &Scene) -> Option<([f32; 3], f32)> {
    at(scene, 16, 16)
}

/// Whether there is such a fragment, but for rounding.
pub fn is(found: Option<([f32; 3], f32)>, colour: [f32; 3], alpha: f32) -> bool {
    let near = |a: f32, b: f32| (a - b).abs() < 1e-3;
    found.is_some_and(|(c, a)| near(a, alpha) && (0..3).all(|i| near(c[i], colour[i])))
}
