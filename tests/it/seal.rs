//! The seal: a file sealed as `docs/TRACE_FORMAT.md` says holds, and no bit of it can change.
//!
//! The sealing here is written from that document, with nothing of the library's.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use arrow_array::{ArrayRef, RecordBatch, StringArray};
use arrow_ipc::writer::FileWriter;
use arrow_ipc::{CompressionType, MetadataVersion, root_as_footer, writer::IpcWriteOptions};
use arrow_schema::{Field, Schema};
use rayon::prelude::*;
use screendoor::trace::{Checksums, ColumnId, Compression, Scalar, Trace, WriteOptions};

use crate::hostile::parts;
use crate::util::{half_header as header, random_fragments, trace_bytes};

/// Which seal is made.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    /// As it was before `screendoor.tail`.
    Old,
    Whole,
}

fn write(batches: &[RecordBatch], footer: &[(&str, String)]) -> Vec<u8> {
    let options = IpcWriteOptions::try_new(8, false, MetadataVersion::V5)
        .unwrap()
        .try_with_compression(Some(CompressionType::ZSTD))
        .unwrap();
    let mut writer =
        FileWriter::try_new_with_options(Vec::new(), &batches[0].schema(), options).unwrap();
    batches.iter().for_each(|batch| writer.write(batch).unwrap());
    footer.iter().for_each(|(key, value)| writer.write_metadata(*key, value));
    writer.into_inner().unwrap()
}

fn find(bytes: &[u8], text: &str) -> Range<usize> {
    let at: Vec<usize> = (0..=bytes.len() - text.len())
        .filter(|at| bytes[*at..].starts_with(text.as_bytes()))
        .collect();
    assert_eq!(at.len(), 1, "'{text}' stands {} times", at.len());
    at[0]..at[0] + text.len()
}

fn hash_of(metadata: &BTreeMap<String, String>, batches: &[RecordBatch]) -> String {
    let mut hasher = blake3::Hasher::new();
    let left_out = |key: &str| key == "screendoor.checksums" || key.starts_with("screendoor.view.");
    for (key, value) in metadata.iter().filter(|(key, _)| !left_out(key)) {
        let raised = key == "screendoor.version" && value == "1.1";
        let value = if raised { "1.0" } else { value };
        hasher.update(format!("{key}={value}\n").as_bytes());
    }
    let rows: usize = batches.iter().map(RecordBatch::num_rows).sum();
    hasher.update(format!("rows={rows}\n").as_bytes());
    for (i, field) in batches[0].schema().fields().iter().enumerate() {
        if !ColumnId::ALL.iter().any(|id| id.name() == field.name()) {
            continue;
        }
        let mut column = blake3::Hasher::new();
        for batch in batches {
            let data = batch.column(i).to_data();
            let width = data.data_type().primitive_width().unwrap();
            let (from, to) = (data.offset() * width, (data.offset() + data.len()) * width);
            column.update(&data.buffers()[0].as_slice()[from..to]);
        }
        hasher.update(format!("{}={}\n", field.name(), column.finalize().to_hex()).as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// A sealed file and its content hash: `columns` in two batches.
fn sealed(
    metadata: &HashMap<String, String>,
    columns: &[(&str, ArrayRef)],
    kind: Kind,
) -> (Vec<u8>, String) {
    let mut metadata: BTreeMap<String, String> = metadata.clone().into_iter().collect();
    metadata.insert("screendoor.checksums".into(), "crc32".into());
    let fields: Vec<Field> = columns
        .iter()
        .map(|(name, array)| Field::new(*name, array.data_type().clone(), true))
        .collect();
    let schema =
        Schema::new(fields).with_metadata(metadata.clone().into_iter().collect::<HashMap<_, _>>());
    let arrays = columns.iter().map(|(_, array)| array.clone()).collect();
    let all = RecordBatch::try_new(Arc::new(schema), arrays).unwrap();
    let half = all.num_rows() / 2;
    let batches = [all.slice(0, half), all.slice(half, all.num_rows() - half)];

    // A first time, to learn where the batches lie.
    let bytes = write(&batches, &[]);
    let length = bytes.len();
    let footer_length = i32::from_le_bytes(bytes[length - 10..length - 6].try_into().unwrap());
    let footer = root_as_footer(&bytes[length - 10 - footer_length as usize..length - 10]).unwrap();
    let blocks: Vec<_> = footer.recordBatches().unwrap().iter().collect();
    let mut ends = vec![(0, blocks[0].offset() as usize)];
    for (block, batch) in blocks.iter().zip(&batches) {
        let end = block.offset() + i64::from(block.metaDataLength()) + block.bodyLength();
        ends.push((batch.num_rows(), end as usize));
    }
    let mut start = 0;
    let mut entries = Vec::new();
    for (rows, end) in &ends {
        entries.push(format!("{rows}:{end}:{:08x}", crc32fast::hash(&bytes[start..*end])));
        start = *end;
    }
    let content = hash_of(&metadata, &batches);
    let mut footer = vec![
        ("screendoor.blocks", entries.join(" ")),
        ("screendoor.content", content.clone()),
        ("screendoor.rows", all.num_rows().to_string()),
    ];
    let seal = |footer: &[(&str, String)]| {
        let mut lines: Vec<_> = footer.iter().map(|(k, v)| format!("{k}={v}\n")).collect();
        lines.sort();
        format!("{:08x}", crc32fast::hash(lines.concat().as_bytes()))
    };
    if kind == Kind::Old {
        footer.push(("screendoor.seal", seal(&footer)));
        return (write(&batches, &footer), content);
    }
    // A second time with places for the digits, which are zeros while the tail is summed.
    let marks = [("screendoor.seal", "<<seal>>"), ("screendoor.tail", "<<tail>>")];
    footer.extend(marks.map(|(key, mark)| (key, mark.to_string())));
    let mut bytes = write(&batches, &footer);
    let places = marks.map(|(_, mark)| find(&bytes, mark));
    places.iter().for_each(|place| bytes[place.clone()].fill(b'0'));
    let tail = format!("{:08x}", crc32fast::hash(&bytes[start..]));
    footer.truncate(3);
    footer.push(("screendoor.tail", tail.clone()));
    bytes[places[0].clone()].copy_from_slice(seal(&footer).as_bytes());
    bytes[places[1].clone()].copy_from_slice(tail.as_bytes());
    (bytes, content)
}

fn verify(bytes: Vec<u8>) -> screendoor::error::Result<String> {
    Trace::from_bytes(bytes, "flipped")?.verify(|_| ())
}

/// The bits of a file that can change without being refused.
fn open_bits(good: &[u8]) -> Vec<usize> {
    let hash = verify(good.to_vec()).unwrap();
    let passes = |bit: &usize| {
        let mut bytes = good.to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        match verify(bytes) {
            Ok(found) => {
                assert_eq!(found, hash, "bit {bit} changed the content");
                true
            }
            Err(_) => false,
        }
    };
    (0..good.len() * 8).into_par_iter().filter(passes).collect()
}

/// A trace as another program makes it: keys, an order and a column of its own.
fn elsewhere(kind: Kind) -> (Vec<u8>, String) {
    let (mut metadata, mut columns) = parts(&header(16, 16, 8), 24);
    metadata.insert("screendoor.background".into(), "0.0 0 0e0".into());
    metadata.insert("another.program".into(), "x = y".into());
    columns.reverse();
    let names: Vec<String> = (0..24).map(|i| format!("leaf {i}")).collect();
    columns.insert(3, ("name", Arc::new(StringArray::from(names))));
    sealed(&metadata, &columns, kind)
}

#[test]
fn no_bit_of_a_sealed_file_can_change() {
    let mut small = header(16, 16, 8);
    let fragments = random_fragments(&small, 24, 5);
    let plain = WriteOptions { compression: Compression::None, batch_rows: 16 };
    let zstd = WriteOptions { compression: Compression::Zstd, batch_rows: 16 };
    let first = trace_bytes(&small, &fragments, plain);
    small.constants = [(ColumnId::Object, Scalar::Unsigned(0))].into();
    let second = trace_bytes(&small, &fragments, zstd);
    let layers = Path::new(env!("CARGO_MANIFEST_DIR")).join("traces/layers.arrow");
    let files = [
        ("plain", first),
        ("zstd", second),
        ("elsewhere", elsewhere(Kind::Whole).0),
        ("layers", std::fs::read(layers).unwrap()),
    ];
    for (name, good) in files {
        let trace = Trace::from_bytes(good.clone(), name).unwrap();
        assert_eq!(trace.checksums(), Checksums::All, "{name}");
        let open = open_bits(&good);
        assert_eq!(open, [0; 0], "{name}, of {} bits", good.len() * 8);
    }
}

#[test]
fn the_search_finds_what_an_older_seal_leaves_open() {
    let (good, _) = elsewhere(Kind::Old);
    assert_eq!(Trace::from_bytes(good.clone(), "old").unwrap().checksums(), Checksums::Batches);
    let open = open_bits(&good);
    eprintln!("an older seal leaves {} of {} bits open", open.len(), good.len() * 8);
    assert!(!open.is_empty());
    // All of them in the footer, which the older seal covers in part.
    let (whole, _) = elsewhere(Kind::Whole);
    assert!(whole.len() > good.len() && open.iter().all(|bit| bit / 8 > good.len() / 2));
}

#[test]
fn what_is_sealed_as_the_document_says_holds() {
    for kind in [Kind::Old, Kind::Whole] {
        let (bytes, content) = elsewhere(kind);
        let trace = Trace::from_bytes(bytes, "elsewhere").unwrap();
        assert_eq!(trace.content(), Some(&content[..]), "{kind:?}");
        assert_eq!(trace.verify(|_| ()).unwrap(), content, "{kind:?}");
        assert_eq!(trace.extra_columns(), [("name".to_string(), "utf8".to_string())]);
    }
    // Sealed by a Python program, with one more key.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/sealed-elsewhere.arrow");
    let trace = Trace::open(path).unwrap();
    let content = "1f026e97cc2628b64041cd1b0b2a9e73460a8b1ab00d4d3d686f4d47dd571cc7";
    assert_eq!(trace.verify(|_| ()).unwrap(), content);
}

#[test]
fn what_is_spelt_otherwise_has_another_hash() {
    let (metadata, columns) = parts(&header(16, 16, 8), 24);
    let hash = |key: &str, value: &str| {
        let mut metadata = metadata.clone();
        metadata.insert(key.into(), value.into());
        let (bytes, content) = sealed(&metadata, &columns, Kind::Whole);
        assert_eq!(verify(bytes).unwrap(), content);
        content
    };
    let plain = hash("screendoor.background", "0 0 0");
    assert_ne!(hash("screendoor.background", "0.0 0 0"), plain);
    assert_ne!(hash("another.program", "1"), plain);
}
