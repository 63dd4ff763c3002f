//! Traces that other programs write: what can be read without a guess is read, and of the
//! rest the error names the column, its type and what to do.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::builder::{ListBuilder, UInt32Builder};
use arrow_array::{
    Array, ArrayRef, BooleanArray, DictionaryArray, Float16Array, Float32Array, Float64Array,
    Int8Array, Int16Array, Int32Array, Int64Array, NullArray, StringArray, StringViewArray,
    StructArray, UInt8Array, UInt16Array, UInt32Array, UInt64Array, types::Int32Type,
};
use arrow_schema::{DataType, Field};
use half::f16;
use screendoor::random::Stream;
use screendoor::trace::{DepthPlane, Fragment, Header, SampleMask, Trace, Unorm32, ValueType};

use crate::hostile::{arrow_file, arrow_stream, parts};
use crate::util::{design, half_header as header, picture, random_fragments};

const ROWS: usize = 90;

type Columns = Vec<(&'static str, ArrayRef)>;

/// The metadata and columns of a trace, and what it holds.
fn good() -> (Header, HashMap<String, String>, Columns, Vec<Fragment>) {
    let header = header(32, 32, 8);
    let (metadata, columns) = parts(&header, ROWS);
    let half = |c: f32| f16::from_f32(c).to_f32();
    let fragments = random_fragments(&header, ROWS, 3)
        .into_iter()
        .map(|f| Fragment { colour: f.colour.map(half), ..f });
    (header, metadata, columns, fragments.collect())
}

fn replace(columns: &mut Columns, name: &str, array: ArrayRef) {
    columns.iter_mut().find(|(n, _)| *n == name).unwrap().1 = array;
}

fn fragments(trace: &Trace) -> Vec<Fragment> {
    trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
}

/// A file with one column changed.
fn with(name: &str, array: impl Array + 'static) -> Vec<u8> {
    let (_, metadata, mut columns, _) = good();
    replace(&mut columns, name, Arc::new(array));
    arrow_file(metadata, columns, None)
}

fn refusal(bytes: Vec<u8>) -> String {
    let error = Trace::from_bytes(bytes, "foreign").and_then(|trace| trace.verify(|_| ()));
    let error = error.expect_err("it is refused").to_string();
    assert!(error.starts_with("foreign") && !error.contains('\n'), "{error}");
    error
}

#[test]
fn columns_in_any_order_among_others_are_read() {
    let (_, metadata, columns, expected) = good();
    let texts: Vec<String> =
        (0..ROWS).map(|i| format!("a name of more than 12 bytes {i}")).collect();
    let mut lists = ListBuilder::new(UInt32Builder::new());
    (0..ROWS as u32).for_each(|i| lists.append_value([Some(i), None]));
    let flags: ArrayRef = Arc::new(BooleanArray::from(vec![true; ROWS]));
    let some: Float64Array = (0..ROWS).map(|i| (i % 2 == 0).then_some(0.5)).collect();
    let field = Arc::new(Field::new("z", DataType::Boolean, true));
    let others: Columns = vec![
        ("name", Arc::new(StringArray::from(texts.clone()))),
        ("view", Arc::new(StringViewArray::from_iter_values(texts))),
        ("list", Arc::new(lists.finish())),
        ("nested", Arc::new(StructArray::from(vec![(field, flags.clone())]))),
        ("nothing", Arc::new(NullArray::new(ROWS))),
        ("flag", flags),
        ("gaps", Arc::new(some)),
        ("number", Arc::new(Int64Array::from(vec![-1; ROWS]))),
    ];
    let mut random = Stream::new([0xf0e1]);
    for turn in 0..20 {
        let mut mixed: Columns = columns.iter().chain(&others).cloned().collect();
        random.shuffle(&mut mixed);
        for bytes in [
            arrow_file(metadata.clone(), mixed.clone(), None),
            arrow_stream(metadata.clone(), mixed),
        ] {
            let trace = Trace::from_bytes(bytes, "mixed").unwrap();
            assert!(fragments(&trace) == expected, "turn {turn}");
            let mut names: Vec<_> = trace.extra_columns().iter().map(|(n, _)| &n[..]).collect();
            names.sort_unstable();
            let all = ["flag", "gaps", "list", "name", "nested", "nothing", "number", "view"];
            assert_eq!(names, all);
            assert_eq!(trace.converted_columns().count(), 0);
            trace.verify(|_| ()).unwrap();
        }
    }
}

#[test]
fn numbers_of_other_types_are_read_where_they_fit() {
    let (header, metadata, columns, _) = good();
    // Values that the narrowest of all types can hold.
    let fragment = |i: usize| Fragment {
        x: i as u16 % 32,
        y: 31 - i as u16 % 32,
        coverage: SampleMask(1 + i as u64),
        depth: DepthPlane { z: Unorm32(i as u32), dzdx: i as i32 - 40, dzdy: -(i as i32) },
        colour: [0.25 * i as f32, 0.5, 1.0],
        alpha: [0.0, 0.5, 1.0][i % 3],
        primitive: i as u32,
        object: 99 - i as u32,
        ..Fragment::default()
    };
    let expected: Vec<Fragment> = (0..ROWS).map(fragment).collect();
    let whole = |name: &str, f: &Fragment| match name {
        "x" => i64::from(f.x),
        "y" => i64::from(f.y),
        "coverage" => f.coverage.0 as i64,
        "z" => i64::from(f.depth.z.0),
        "dzdx" => i64::from(f.depth.dzdx),
        "dzdy" => i64::from(f.depth.dzdy),
        "primitive" => i64::from(f.primitive),
        _ => i64::from(f.object),
    };
    let real = |name: &str, f: &Fragment| match name {
        "r" => f.colour[0],
        "g" => f.colour[1],
        "b" => f.colour[2],
        _ => f.alpha,
    };
    let array = |name: &str, bits: &str| -> ArrayRef {
        let wholes = expected.iter().map(|f| whole(name, f));
        let reals = expected.iter().map(|f| real(name, f));
        match bits {
            "int8" => Arc::new(Int8Array::from_iter_values(wholes.map(|v| v as i8))),
            "int16" => Arc::new(Int16Array::from_iter_values(wholes.map(|v| v as i16))),
            "int32" => Arc::new(Int32Array::from_iter_values(wholes.map(|v| v as i32))),
            "int64" => Arc::new(Int64Array::from_iter_values(wholes)),
            "uint8" => Arc::new(UInt8Array::from_iter_values(wholes.map(|v| v as u8))),
            "uint16" => Arc::new(UInt16Array::from_iter_values(wholes.map(|v| v as u16))),
            "uint32" => Arc::new(UInt32Array::from_iter_values(wholes.map(|v| v as u32))),
            "uint64" => Arc::new(UInt64Array::from_iter_values(wholes.map(|v| v as u64))),
            "float16" => Arc::new(Float16Array::from_iter_values(reals.map(f16::from_f32))),
            "float32" => Arc::new(Float32Array::from_iter_values(reals)),
            _ => Arc::new(Float64Array::from_iter_values(reals.map(f64::from))),
        }
    };
    let is_real = |name: &str| ["r", "g", "b", "alpha"].contains(&name);
    let all = |whole: &str, signed: &str, real: &str| -> Columns {
        let bits = |name: &str| match name {
            _ if is_real(name) => real.to_string(),
            "dzdx" | "dzdy" => signed.to_string(),
            _ => whole.to_string(),
        };
        columns.iter().map(|(name, _)| (*name, array(name, &bits(name)))).collect()
    };
    let canonical = arrow_file(metadata.clone(), all("uint32", "int32", "float32"), None);
    let canonical = Trace::from_bytes(canonical, "canonical").unwrap();
    let shown = picture(&design("lk"), &canonical, header.pattern.samples(), 1);
    for (whole, signed, real) in [
        ("uint8", "int8", "float16"),
        ("int8", "int16", "float16"),
        ("int16", "int16", "float64"),
        ("int32", "int64", "float32"),
        ("uint16", "int8", "float16"),
        ("uint64", "int64", "float64"),
        ("int64", "int64", "float64"),
    ] {
        let bytes = arrow_file(metadata.clone(), all(whole, signed, real), None);
        let trace = Trace::from_bytes(bytes, whole).unwrap();
        assert!(fragments(&trace) == expected, "{whole} {real}");
        assert!(trace.converted_columns().all(|(name, from, to)| {
            from == if is_real(name) {
                real
            } else if name.starts_with('d') {
                signed
            } else {
                whole
            } && from != to.to_string()
        }));
        assert!(trace.converted_columns().count() >= 5);
        let found = picture(&design("lk"), &trace, header.pattern.samples(), 1);
        assert_eq!(found.hash(), shown.hash(), "{whole} {real}");
    }
}

#[test]
fn what_is_converted_keeps_the_ends_of_the_range() {
    let (_, metadata, mut columns, _) = good();
    let mut z = vec![7_i64; ROWS];
    (z[0], z[1]) = (0, i64::from(u32::MAX));
    let mut slope = vec![7_i64; ROWS];
    (slope[0], slope[1]) = (i32::MIN.into(), i32::MAX.into());
    replace(&mut columns, "z", Arc::new(Int64Array::from(z)));
    replace(&mut columns, "dzdx", Arc::new(Int64Array::from(slope)));
    let trace = Trace::from_bytes(arrow_file(metadata, columns, None), "ends").unwrap();
    let planes: Vec<DepthPlane> = fragments(&trace).iter().take(2).map(|f| f.depth).collect();
    assert_eq!((planes[0].z.0, planes[0].dzdx), (0, i32::MIN));
    assert_eq!((planes[1].z.0, planes[1].dzdx), (u32::MAX, i32::MAX));
    let read: Vec<_> = trace.converted_columns().map(|(name, _, to)| (name, to)).collect();
    assert_eq!(read, [("z", ValueType::U32), ("dzdx", ValueType::I32)]);
}

/// `value` in row 5 and `rest` in all others.
fn once<T: Clone>(value: T, rest: T) -> Vec<T> {
    (0..ROWS).map(|row| if row == 5 { value.clone() } else { rest.clone() }).collect()
}

#[test]
fn what_would_be_a_guess_or_a_loss_is_refused_by_name() {
    let words: DictionaryArray<Int32Type> = vec!["7"; ROWS].into_iter().collect();
    let numbers = |value, rest| Int64Array::from(once(value, rest));
    let reals = |value, rest| Float64Array::from(once(value, rest));
    let cases: Vec<(Vec<u8>, &[&str])> = vec![
        (with("x", numbers(-1, 1)), &["row 5", "'x' holds -1 as int64", "numbers that are uint16"]),
        (with("y", numbers(65536, 1)), &["row 5", "'y' holds 65536"]),
        (with("z", numbers(1 << 32, 1)), &["row 5", "'z' holds 4294967296", "no uint32"]),
        (with("z", numbers(-1, 1)), &["row 5", "'z' holds -1"]),
        (with("dzdy", numbers(1 << 31, 1)), &["row 5", "'dzdy' holds 2147483648", "no int32"]),
        (with("dzdy", numbers(-(1 << 31) - 1, 1)), &["row 5", "'dzdy' holds -2147483649"]),
        (with("coverage", numbers(-1, 1)), &["row 5", "'coverage' holds -1", "no uint64"]),
        (with("coverage", numbers(256, 1)), &["row 5", "samples that do not exist"]),
        (with("alpha", reals(0.1, 0.5)), &["row 5", "'alpha' holds 0.1 as float64", "float32"]),
        (with("r", reals(1e300, 0.5)), &["row 5", "'r' holds"]),
        (with("g", reals(f64::NAN, 0.5)), &["row 5", "'g' holds NaN"]),
        (
            with("b", UInt8Array::from(vec![255; ROWS])),
            &["'b' is of type uint8", "float16 or float32"],
        ),
        (with("x", reals(1.0, 1.0)), &["'x' is of type float64", "cast it to uint16"]),
        (with("z", Float32Array::from(vec![0.5; ROWS])), &["'z' is of type float32", "uint32"]),
        (with("x", StringArray::from(vec!["1"; ROWS])), &["'x' is of type utf8", "uint16"]),
        (with("object", words), &["'object' is dictionary-encoded"]),
        (with("alpha", BooleanArray::from(vec![true; ROWS])), &["'alpha' is of type bool"]),
        (with("x", numbers(40, 1)), &["row 5", "x lies outside the frame"]),
    ];
    for (bytes, words) in cases {
        let error = refusal(bytes);
        assert!(words.iter().all(|word| error.contains(word)), "{error}, not {words:?}");
    }

    let (_, metadata, mut columns, _) = good();
    columns.push(columns[3].clone());
    let error = refusal(arrow_file(metadata, columns, None));
    assert!(error.contains("'z' stands there twice"), "{error}");

    // A mask that cannot name all samples.
    let (metadata, mut columns) = parts(&header(32, 32, 16), ROWS);
    replace(&mut columns, "coverage", Arc::new(UInt8Array::from(vec![1; ROWS])));
    let error = refusal(arrow_file(metadata, columns, None));
    assert!(
        error.contains("'coverage' is of type uint8") && error.contains("uint16 or"),
        "{error}"
    );
}

#[test]
fn a_stream_is_read_as_a_file_and_its_damage_never_panics() {
    let (_, metadata, columns, expected) = good();
    let stream = arrow_stream(metadata.clone(), columns.clone());
    let trace = Trace::from_bytes(stream.clone(), "stream").unwrap();
    assert!(!trace.is_sealed() && fragments(&trace) == expected);
    let file = Trace::from_bytes(arrow_file(metadata.clone(), columns.clone(), None), "f").unwrap();
    assert_eq!(trace.verify(|_| ()).unwrap(), file.verify(|_| ()).unwrap());
    for length in 4..stream.len() {
        let error = refusal(stream[..length].to_vec());
        assert!(error.contains("damaged"), "{length}: {error}");
    }
    let more = [&stream[..], &[0; 8]].concat();
    assert!(refusal(more).contains("stray bytes"));
    for bit in 0..stream.len() * 8 {
        let mut bytes = stream.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let _ = Trace::from_bytes(bytes, "flipped").and_then(|trace| trace.verify(|_| ()));
    }
    // Rewritten as a stream, a sealed trace still says that it is sealed.
    let mut metadata = metadata;
    metadata.insert("screendoor.checksums".into(), "crc32".into());
    let error = refusal(arrow_stream(metadata, columns));
    assert!(error.contains("has no seal") && error.contains("leave the metadata"), "{error}");
}

#[test]
fn other_formats_are_named() {
    for (bytes, words) in [
        (&b"PAR1\x15\x04"[..], ["a Parquet file", "pyarrow.parquet"]),
        (b"FEA1\0\0", ["Feather file of version 1", "Arrow IPC file"]),
        (b"\x1f\x8b\x08\0", ["gzip", "gunzip"]),
        (b"\x28\xb5\x2f\xfd", ["zstd", "unzstd"]),
        (b"\x04\x22\x4d\x18", ["lz4", "unlz4"]),
        (b"\xfd7zXZ\0", ["xz", "unxz"]),
        (b"BZh9", ["bzip2", "bunzip2"]),
        (b"PK\x03\x04", ["ZIP", "unpack"]),
        (b"x,y,coverage\n", ["not an Arrow IPC file", "screendoor capture"]),
    ] {
        let error = refusal(bytes.to_vec());
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}
