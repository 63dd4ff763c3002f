//! Files that are damaged, foreign or lie: each gives one clear error.
//!
//! The corpus lies in `traces/hostile/`. It is made by this file (run the ignored
//! test to write it anew) and is held against it.

use std::collections::HashMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow_array::types::{Float32Type, Int32Type};
use arrow_array::{
    Array, ArrayRef, DictionaryArray, Float32Array, Int64Array, PrimitiveArray, RecordBatch,
    StringArray, UInt16Array,
};
use arrow_ipc::CompressionType;
use arrow_ipc::reader::FileReader;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions, StreamWriter};
use arrow_schema::{Field, Schema};
use flate2::Compression;
use flate2::write::GzEncoder;
use screendoor::capture::{Capture, CaptureOptions};
use screendoor::trace::{Header, Trace, WriteOptions};

use crate::util::{endlessly_scaled, half_header as header, random_fragments, trace_bytes};

/// A hostile file: its name, its bytes, what the error must say.
struct Hostile {
    name: &'static str,
    bytes: Vec<u8>,
    says: &'static str,
    what: &'static str,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("traces/hostile")
}

/// A plain Arrow file, as another program writes it.
pub fn arrow_file(
    metadata: HashMap<String, String>,
    columns: Vec<(&str, ArrayRef)>,
    compression: Option<CompressionType>,
) -> Vec<u8> {
    let fields: Vec<Field> = columns
        .iter()
        .map(|(name, array)| Field::new(*name, array.data_type().clone(), true))
        .collect();
    let schema = Arc::new(Schema::new(fields).with_metadata(metadata));
    let options = IpcWriteOptions::try_new(8, false, arrow_ipc::MetadataVersion::V5)
        .unwrap()
        .try_with_compression(compression)
        .unwrap();
    let mut bytes = Vec::new();
    let mut writer = FileWriter::try_new_with_options(&mut bytes, &schema, options).unwrap();
    let arrays = columns.into_iter().map(|(_, array)| array).collect();
    writer.write(&RecordBatch::try_new(schema, arrays).unwrap()).unwrap();
    writer.finish().unwrap();
    drop(writer);
    bytes
}

/// The same as a stream.
pub fn arrow_stream(metadata: HashMap<String, String>, columns: Vec<(&str, ArrayRef)>) -> Vec<u8> {
    let file = arrow_file(metadata, columns, None);
    let reader = FileReader::try_new(std::io::Cursor::new(file), None).unwrap();
    let mut writer = StreamWriter::try_new(Vec::new(), &reader.schema()).unwrap();
    reader.for_each(|batch| writer.write(&batch.unwrap()).unwrap());
    writer.into_inner().unwrap()
}

/// The length of the first batch's body, as a stream's message has it.
fn body_length(stream: &[u8]) -> [u8; 8] {
    let message = |at: usize| {
        let length = u32::from_le_bytes(stream[at + 4..at + 8].try_into().unwrap()) as usize;
        (at + 8 + length, &stream[at + 8..at + 8 + length])
    };
    let (batch, _) = message(0);
    arrow_ipc::root_as_message(message(batch).1).unwrap().bodyLength().to_le_bytes()
}

/// A good trace taken apart: the schema's metadata and the columns.
pub fn parts(
    header: &Header,
    rows: usize,
) -> (HashMap<String, String>, Vec<(&'static str, ArrayRef)>) {
    let sealed = trace_bytes(header, &random_fragments(header, rows, 3), WriteOptions::default());
    let mut reader = FileReader::try_new(std::io::Cursor::new(sealed), None).unwrap();
    let schema = reader.schema();
    let mut metadata: HashMap<String, String> =
        schema.metadata().iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    metadata.remove("screendoor.checksums");
    let batch = reader.next().unwrap().unwrap();
    let names =
        ["x", "y", "coverage", "z", "dzdx", "dzdy", "r", "g", "b", "alpha", "primitive", "object"];
    let columns = names.into_iter().map(|n| (n, batch.column_by_name(n).unwrap().clone()));
    (metadata, columns.collect())
}

fn traces() -> Vec<Hostile> {
    const ROWS: usize = 123;
    let viewed = header(32, 32, 8);
    let header = Header { view: None, ..viewed.clone() };
    let options = WriteOptions { batch_rows: 64, ..WriteOptions::default() };
    let sealed = trace_bytes(&header, &random_fragments(&header, ROWS, 3), options);
    let flipped = |at: usize| {
        let mut bytes = sealed.clone();
        bytes[at] ^= 0x10;
        bytes
    };
    let last = |text: &[u8]| sealed.windows(text.len()).rposition(|w| w == text).unwrap();
    let (metadata, columns) = parts(&header, ROWS);
    let with_metadata = |key: &str, value: &str| {
        let mut metadata = metadata.clone();
        metadata.insert(format!("screendoor.{key}"), value.to_string());
        arrow_file(metadata, columns.clone(), None)
    };
    let with_column = |name: &str, array: ArrayRef| {
        let mut columns = columns.clone();
        columns.iter_mut().find(|(n, _)| *n == name).unwrap().1 = array;
        arrow_file(metadata.clone(), columns, None)
    };
    let replaced = |bytes: &[u8], from: &[u8], to: &[u8]| {
        let mut bytes = bytes.to_vec();
        let places: Vec<usize> =
            (0..bytes.len() - from.len()).filter(|i| bytes[*i..].starts_with(from)).collect();
        assert!(!places.is_empty());
        for at in places {
            bytes[at..at + to.len()].copy_from_slice(to);
        }
        bytes
    };
    let plain = arrow_file(metadata.clone(), columns.clone(), None);
    let zstd = arrow_file(metadata.clone(), columns.clone(), Some(CompressionType::ZSTD));
    let alphas = columns[9].1.as_any().downcast_ref::<Float32Array>().unwrap();
    let mut bad_alphas: Vec<f32> = alphas.values().to_vec();
    bad_alphas[77] = f32::NAN;
    let nulls: PrimitiveArray<Float32Type> =
        (0..ROWS).map(|i| (i != 5).then_some(0.5_f32)).collect();
    let mut missing = columns.clone();
    missing.remove(3);
    let wide: Vec<i64> = (0..ROWS).map(|i| if i == 5 { 1 << 16 } else { 1 }).collect();
    let names = StringArray::from(vec!["1"; ROWS]);
    let dictionary: DictionaryArray<Int32Type> = vec!["a"; ROWS].into_iter().collect();
    let mut tagged = columns.clone();
    tagged.insert(4, ("tag", Arc::new(dictionary)));
    let stream = arrow_stream(metadata.clone(), columns.clone());
    let huge = (1_u64 << 40).to_le_bytes();
    let x_length = (2 * ROWS as u64).to_le_bytes();

    let hostile = |name, bytes, says, what| Hostile { name, bytes, says, what };
    vec![
        hostile("empty.arrow", Vec::new(), "not an Arrow IPC file", "no bytes at all"),
        hostile(
            "text.arrow",
            b"x,y,coverage\n1,2,3\n".to_vec(),
            "not an Arrow IPC file",
            "another format",
        ),
        hostile(
            "truncated.arrow",
            sealed[..sealed.len() * 2 / 3].to_vec(),
            "truncated",
            "the first two thirds of a trace",
        ),
        hostile("flipped-head.arrow", flipped(200), "damaged", "one bit of the head"),
        hostile("flipped-body.arrow", flipped(sealed.len() / 2), "batch", "one bit of a batch"),
        hostile(
            "flipped-footer.arrow",
            flipped(last(b"screendoor.blocks")),
            "damaged",
            "one bit of the footer",
        ),
        hostile(
            "foreign.arrow",
            arrow_file(
                HashMap::new(),
                vec![("name", Arc::new(StringArray::from(vec!["a", "b"])) as ArrayRef)],
                None,
            ),
            "the metadata 'screendoor.version' is missing",
            "a good Arrow file of something else",
        ),
        hostile(
            "newer.arrow",
            with_metadata("version", "2.0"),
            "format version 2.0",
            "a newer major version",
        ),
        hostile(
            "view.arrow",
            {
                let (mut metadata, columns) = parts(&viewed, ROWS);
                metadata.insert("screendoor.view.near".into(), "500".into());
                arrow_file(metadata, columns, None)
            },
            "metadata 'screendoor.view.near'",
            "a view whose near plane stands behind its far one",
        ),
        hostile(
            "huge-frame.arrow",
            with_metadata("width", "1000000"),
            "1000000 pixels wide",
            "a frame 10^6 pixels wide",
        ),
        hostile(
            "three-samples.arrow",
            with_metadata("positions", "0,0 1,1 2,2"),
            "positions",
            "positions that are not as many as samples",
        ),
        hostile(
            "outside-positions.arrow",
            with_metadata("positions", "0,0 1,1 2,2 3,3 4,4 5,5 6,6 99,0"),
            "outside its pixel",
            "a sample outside its pixel",
        ),
        hostile(
            "small-frame.arrow",
            with_metadata("height", "20"),
            "y lies outside the frame",
            "rows beyond the frame",
        ),
        hostile(
            "constant-twice.arrow",
            with_metadata("constant.alpha", "0.5"),
            "both a column and a constant",
            "a column that is declared constant too",
        ),
        hostile(
            "nan-alpha.arrow",
            with_column("alpha", Arc::new(Float32Array::from(bad_alphas))),
            "row 77: alpha",
            "an alpha that is no number",
        ),
        hostile(
            "nulls.arrow",
            with_column("alpha", Arc::new(nulls)),
            "'alpha' has nulls",
            "a column with nulls",
        ),
        hostile(
            "wide-x.arrow",
            with_column("x", Arc::new(Int64Array::from(wide))),
            "row 5: column 'x' holds 65536 as int64, which no uint16 is",
            "a column of a wider type with a value that does not fit",
        ),
        hostile(
            "text-x.arrow",
            with_column("x", Arc::new(names)),
            "the column 'x' is of type utf8; cast it to uint16",
            "a column of text",
        ),
        hostile(
            "dictionary.arrow",
            arrow_file(metadata.clone(), tagged, None),
            "the column 'tag' is dictionary-encoded",
            "a column more, dictionary-encoded",
        ),
        hostile(
            "cut-stream.arrow",
            stream[..stream.len() - 8].to_vec(),
            "truncated",
            "a stream without its end marker",
        ),
        hostile(
            "long-stream.arrow",
            replaced(&stream, &body_length(&stream), &(1_u64 << 60).to_le_bytes()),
            "truncated",
            "a stream whose batch claims 2^60 bytes",
        ),
        hostile(
            "unsealed.arrow",
            with_metadata("checksums", "crc32"),
            "says that it is sealed and has no seal",
            "a sealed trace that another program wrote anew",
        ),
        hostile(
            "parquet.arrow",
            b"PAR1\x15\x04\x15\x10PAR1".to_vec(),
            "it is a Parquet file, no Arrow IPC file; convert it",
            "another format that holds tables",
        ),
        hostile(
            "coverage.arrow",
            with_column("coverage", Arc::new(UInt16Array::from(vec![1_u16 << 9; ROWS]))),
            "coverage",
            "samples that do not exist",
        ),
        hostile(
            "missing-z.arrow",
            arrow_file(metadata.clone(), missing, None),
            "'z' is missing",
            "no depths",
        ),
        hostile(
            "many-rows.arrow",
            replaced(&plain, &(ROWS as u64).to_le_bytes(), &huge),
            "claims 1099511627776 rows",
            "a batch that claims 2^40 rows",
        ),
        hostile(
            "bomb.arrow",
            replaced(&zstd, &x_length, &(1_u64 << 61).to_le_bytes()),
            "claims another length",
            "a compressed column that claims 2^61 bytes",
        ),
    ]
}

/// A glTF file with one triangle, changed by `edit`.
pub fn gltf(edit: impl Fn(&mut serde_json::Value)) -> Vec<u8> {
    let positions: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
    let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, bytes);
    let mut json = serde_json::json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "buffers": [{ "byteLength": 36, "uri": format!("data:application/octet-stream;base64,{data}") }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0],
        }],
    });
    edit(&mut json);
    serde_json::to_vec_pretty(&json).unwrap()
}

fn scenes() -> Vec<Hostile> {
    let text = |name, text: &str, says, what| Hostile { name, bytes: text.into(), says, what };
    let edited = |name, says, what, edit: fn(&mut serde_json::Value)| Hostile {
        name,
        bytes: gltf(edit),
        says,
        what,
    };
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    vec![
        text(
            "nan.obj",
            "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
            "line 2 ('v nan 0 0'): 'nan' is no finite number",
            "a vertex that is no number",
        ),
        text(
            "flat.obj",
            "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 1 1 2\n",
            "have no area",
            "only triangles without area",
        ),
        text(
            "index.obj",
            &format!("{triangle}f 1 2 9\n"),
            "line 4",
            "a face that names a vertex that is not there",
        ),
        text(
            "number.obj",
            "v 0 0 zero\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "line 1",
            "a coordinate that is no number",
        ),
        text(
            "corners.obj",
            &format!("{triangle}f 1 2 3\nf\n"),
            "line 5 ('f'): the face has no corners",
            "a face without corners",
        ),
        text("two.obj", "v 0 0\nf 1 1 1\n", "line 1 ('v 0 0'): a vertex has", "half a vertex"),
        text(
            "normal.obj",
            &format!("{triangle}vn 0 0 1\nf 1//1 2//1 3//2\n"),
            "line 5 ('f 1//1 2//1 3//2'): normal 2 is not there",
            "a corner that names a normal that is not there",
        ),
        text(
            "large-index.obj",
            &format!("{triangle}vn 0 0 1\nf 1//9223372036854775807 2//1 3//1\n"),
            "normal 9223372036854775807 is not there",
            "a number that overflows when it is multiplied",
        ),
        text("points.obj", triangle, "no triangles", "vertices and no faces"),
        text("empty.obj", "", "no triangles", "no bytes at all"),
        text("not-json.gltf", "{ \"asset\": ", "cannot be read as glTF", "half a document"),
        Hostile {
            name: "truncated.glb",
            bytes: [&b"glTF\x02\0\0\0\xff\xff\0\0"[..], &[0; 10]].concat(),
            says: "cannot be read as glTF",
            what: "a header that promises more than there is",
        },
        edited("no-scene.gltf", "it has no scene", "a document without a scene", |j| {
            j.as_object_mut().unwrap().remove("scene");
            j["scenes"] = serde_json::json!([]);
        }),
        edited(
            "outside.gltf",
            "leads out of the scene's folder",
            "a buffer outside the folder",
            |j| {
                j["buffers"][0]["uri"] = "../../../etc/passwd".into();
            },
        ),
        edited("url.gltf", "leads out of the scene's folder", "a buffer on the network", |j| {
            j["buffers"][0]["uri"] = "http://example.org/a.bin".into();
        }),
        edited("missing-buffer.gltf", "cannot read", "a buffer whose file is not there", |j| {
            j["buffers"][0]["uri"] = "nowhere.bin".into();
        }),
        edited("short-buffer.gltf", "has 36 of 99 bytes", "a buffer shorter than it says", |j| {
            j["buffers"][0]["byteLength"] = 99.into();
        }),
        edited(
            "beyond.gltf",
            "reaches beyond its buffer",
            "an accessor longer than its data",
            |j| {
                j["accessors"][0]["count"] = 4_000_000_000_u64.into();
            },
        ),
        edited("sparse.gltf", "reaches beyond", "a sparse accessor of 10^12 zeros", |j| {
            j["accessors"][0].as_object_mut().unwrap().remove("bufferView");
            j["accessors"][0]["count"] = 1_000_000_000_000_u64.into();
            j["accessors"][0]["sparse"] = serde_json::json!({
                "count": 1,
                "indices": { "bufferView": 0, "componentType": 5125 },
                "values": { "bufferView": 0 },
            });
        }),
        edited(
            "wrong-type.gltf",
            "type is not one that glTF allows",
            "positions of another type",
            |j| {
                j["accessors"][0]["componentType"] = 5121.into();
            },
        ),
        edited("circle.gltf", "its own ancestor", "a node that is its own child", |j| {
            j["nodes"][0]["children"] = serde_json::json!([0]);
        }),
        edited("doubling.gltf", "it has two parents", "2^40 ways to one node", |j| {
            let node = |i: usize| match i {
                40 => serde_json::json!({ "mesh": 0 }),
                _ => serde_json::json!({ "children": [i + 1, i + 1] }),
            };
            j["nodes"] = (0..41).map(node).collect();
        }),
        edited("listed-twice.gltf", "is listed twice", "a node listed twice", |j| {
            j["scenes"][0]["nodes"] = serde_json::json!([0, 0]);
        }),
        edited(
            "no-accessor.gltf",
            "an accessor that is not there",
            "positions without accessors",
            |j| {
                j.as_object_mut().unwrap().remove("accessors");
            },
        ),
        edited("version.gltf", "it wants glTF 9.0", "a version to come", |j| {
            j["asset"]["version"] = "9.0".into();
        }),
        edited("min-version.gltf", "it wants glTF 3.0", "a file for newer readers", |j| {
            j["asset"]["minVersion"] = "3.0".into();
        }),
        Hostile {
            name: "short-header.glb",
            bytes: b"glTF\x02\0\0\0\x03\0\0\0".to_vec(),
            says: "the header of the GLB is cut off",
            what: "a header that claims 3 bytes",
        },
        edited("index.gltf", "names vertices", "indices beyond the vertices", |j| {
            // The positions' own bytes, read as indices.
            j["accessors"] = serde_json::json!([j["accessors"][0], {
                "bufferView": 0, "componentType": 5125, "count": 9, "type": "SCALAR",
            }]);
            j["meshes"][0]["primitives"][0]["indices"] = 1.into();
        }),
        edited("no-mesh.gltf", "no triangles", "nodes without a mesh", |j| {
            j["nodes"] = serde_json::json!([{}]);
        }),
        edited("nowhere.gltf", "no finite place", "a transformation to infinity", |j| {
            j["nodes"] = endlessly_scaled(serde_json::json!({ "mesh": 0 }));
            j["scenes"][0]["nodes"] = serde_json::json!([0]);
        }),
        edited(
            "extension.gltf",
            "the extension is not supported",
            "a required extension that is not known",
            |j| {
                j["extensionsRequired"] = serde_json::json!(["KHR_draco_mesh_compression"]);
                j["extensionsUsed"] = serde_json::json!(["KHR_draco_mesh_compression"]);
            },
        ),
        text(
            "mesh.ply",
            "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
            "neither Gaussian splats nor faces",
            "a PLY file of nothing",
        ),
        text(
            "many.ply",
            "ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\n\
             property uint packed_color\nend_header\n",
            "999999999999 rows of 4 bytes, and 0 bytes are left",
            "10^12 splats in no bytes",
        ),
        Hostile {
            name: "many.tfx",
            bytes: [&4_f32.to_le_bytes()[..], &[0xff, 0, 0, 0, 0xff, 0, 0, 0, 0xa0], &[0; 147]]
                .concat(),
            says: "needs 4",
            what: "65025 points of hair in no bytes",
        },
        Hostile {
            name: "metadata.vdb",
            bytes: [
                &b" BDV\0\0\0\0\xe0\0\0\0\x0b\0\0\0\0\0\0\0\x01"[..],
                &[b'0'; 36],
                b"\x01\0\0\0\xff\xff\xff\xff",
            ]
            .concat(),
            says: "needs 4294967295",
            what: "a name 4 GiB long",
        },
        text("scene.fbx", "solid\n", "do not come as '.fbx'", "another format"),
        text(
            "list.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
             property float z\nelement face 1\nproperty list uint int vertex_indices\n\
             end_header\n0 0 0\n4294967295 0 0 0\n",
            "ends within its element 'face'",
            "a face of 2^32 - 1 corners in 3 numbers",
        ),
        Hostile {
            name: "many.splat",
            bytes: vec![0x7f; 33],
            says: "33 bytes, and splats of 32",
            what: "a splat and a byte",
        },
        Hostile {
            name: "many.spz",
            bytes: [&b"NGSP\x04\0\0\0\xff\xff\xff\xff\x04\x0c\0\x06"[..], &[0; 16]].concat(),
            says: "claims 4294967295 splats in 32 bytes",
            what: "2^32 - 1 splats of degree 4 in no bytes",
        },
        Hostile {
            name: "bomb.spz",
            bytes: {
                let mut packed = GzEncoder::new(Vec::new(), Compression::best());
                packed.write_all(b"NGSP\x02\0\0\0\x00\x08\0\0\x03\x0c\0\0").unwrap();
                packed.write_all(&vec![0; 1 << 20]).unwrap();
                packed.finish().unwrap()
            },
            says: "claims 2048 splats in",
            what: "2048 splats, and a MiB that packs into a KiB",
        },
        Hostile {
            name: "many.hair",
            bytes: [&b"HAIR\x01\0\0\0\0\0\0\x04\x1e\0\0\0\xff\xff\xff\x03"[..], &[0; 108]].concat(),
            says: "needs 805306368",
            what: "2^26 points of hair in no bytes",
        },
        Hostile {
            name: "many.stl",
            bytes: [&[0; 80][..], &[0xff; 4], &[0; 50]].concat(),
            says: "its 4294967295 triangles take 214748364834 bytes, and it has 134",
            what: "2^32 - 1 triangles in the bytes of one",
        },
    ]
}

fn corpus() -> Vec<Hostile> {
    traces().into_iter().chain(scenes()).collect()
}

/// Names and bytes of all files of the corpus.
pub fn files() -> impl Iterator<Item = (&'static str, Vec<u8>)> {
    corpus().into_iter().map(|h| (h.name, h.bytes))
}

/// Does with a file what a user would; the error.
fn open(path: &Path) -> Result<(), screendoor::error::Error> {
    if path.extension().is_some_and(|e| e == "arrow") {
        return Trace::open(path)?.verify(|_| ()).map(|_| ());
    }
    let scene = screendoor::scene::load(&path.display().to_string())?;
    let options = CaptureOptions { width: 16, height: 16, ..CaptureOptions::default() };
    Capture::new(&scene, &options)?.to_memory(|_, _| ()).map(|_| ())
}

#[test]
fn every_file_of_the_corpus_gives_its_error() {
    for hostile in corpus() {
        let path = folder().join(hostile.name);
        let error = open(&path).expect_err(hostile.name).to_string();
        assert!(error.contains(hostile.says), "{}: {error}", hostile.name);
        assert!(error.contains(hostile.name), "the error does not say where: {error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn the_corpus_on_disk_is_the_one_made_here() {
    for hostile in corpus() {
        let found = fs::read(folder().join(hostile.name)).expect(hostile.name);
        assert!(found == hostile.bytes, "{}: run the ignored test 'write_corpus'", hostile.name);
    }
    assert_eq!(fs::read_to_string(folder().join("README.md")).unwrap(), readme());
}

fn readme() -> String {
    let mut text = String::from(
        "# Hostile files\n\n\
         Each is damaged, foreign or lies, and must give one clear error: no panic, no hang, no\n\
         allocation that the file merely claims to need. Made by `tests/it/hostile.rs`; to write\n\
         them anew: `cargo test write_corpus -- --ignored`.\n\n\
         | file | what | the error says |\n|---|---|---|\n",
    );
    for hostile in corpus() {
        text += &format!("| {} | {} | {} |\n", hostile.name, hostile.what, hostile.says);
    }
    text
}

#[test]
#[ignore = "writes traces/hostile"]
fn write_corpus() {
    fs::create_dir_all(folder()).unwrap();
    for hostile in corpus() {
        fs::write(folder().join(hostile.name), hostile.bytes).unwrap();
    }
    fs::write(folder().join("README.md"), readme()).unwrap();
}
