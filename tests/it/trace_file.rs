//! The trace file: what goes in comes out, and damage never passes.

use half::f16;
use screendoor::random::Stream;
use screendoor::trace::{
    ColourFormat, ColumnId, Compression, Fragment, Header, SampleMask, Scalar, Trace, TraceWriter,
    WriteOptions, statistics,
};

use crate::util::{half_header as header, random_fragments, trace, trace_bytes};

const COMPRESSIONS: [Compression; 3] = [Compression::None, Compression::Lz4, Compression::Zstd];

fn as_stored(header: &Header, fragment: &Fragment) -> Fragment {
    let mut stored = *fragment;
    if header.colour == ColourFormat::F16 {
        stored.colour = stored.colour.map(|c| f16::from_f32(c).to_f32());
    }
    stored
}

#[test]
fn round_trip_at_every_sample_count_colour_format_and_compression() {
    for samples in [1, 2, 4, 8, 16, 32, 64] {
        for colour in [ColourFormat::F16, ColourFormat::F32] {
            let mut header = header(100, 70, samples);
            header.colour = colour;
            let fragments = random_fragments(&header, 1000, samples);
            let expected: Vec<_> = fragments.iter().map(|f| as_stored(&header, f)).collect();
            let mut content = None;
            for compression in COMPRESSIONS {
                for batch_rows in [1, 7, 1000, 65536] {
                    if batch_rows == 1 && samples != 8 {
                        continue;
                    }
                    let options = WriteOptions { compression, batch_rows };
                    let bytes = trace_bytes(&header, &fragments, options);
                    let trace = Trace::from_bytes(bytes, "test").unwrap();
                    assert_eq!(trace.header(), &header);
                    assert_eq!(trace.rows(), 1000);
                    let read: Vec<Fragment> = trace
                        .batches()
                        .flat_map(|b| b.unwrap().iter().collect::<Vec<_>>())
                        .collect();
                    assert!(read == expected, "{samples} {colour:?} {compression:?} {batch_rows}");
                    // One content, one hash, however it is stored.
                    let hash = trace.verify(|_| ()).unwrap();
                    assert_eq!(*content.get_or_insert(hash.clone()), hash);
                }
            }
        }
    }
}

#[test]
fn constants_take_no_column_and_come_back() {
    let plain = header(10, 10, 4);
    let mut fragments = random_fragments(&plain, 50, 1);
    for f in &mut fragments {
        (f.alpha, f.object, f.depth.dzdx) = (0.3, 12, -5);
        (f.colour, f.coverage) = ([1.0, 0.5, 0.5], SampleMask(0b1111));
    }
    let mut header = plain.clone();
    header.constants = [
        (ColumnId::Alpha, Scalar::Real(0.3)),
        (ColumnId::Object, Scalar::Unsigned(12)),
        (ColumnId::Dzdx, Scalar::Signed(-5)),
        (ColumnId::R, Scalar::Real(1.0)),
        (ColumnId::Coverage, Scalar::Unsigned(0b1111)),
    ]
    .into();
    assert_eq!(plain.row_bytes() - header.row_bytes(), 4 + 4 + 4 + 2 + 1);
    let trace = trace(&header, &fragments);
    assert_eq!(trace.header(), &header);
    let read: Vec<Fragment> = trace.batch(0).unwrap().iter().collect();
    assert!(read == fragments);

    let mut writer = TraceWriter::new(Vec::new(), "t", header, WriteOptions::default()).unwrap();
    fragments[0].object = 13;
    let error = writer.push(&fragments[0]).unwrap_err().to_string();
    assert!(error.contains("row 0") && error.contains("'object'"), "{error}");
}

#[test]
fn an_empty_trace_is_a_trace() {
    let trace = trace(&header(5, 5, 8), &[]);
    assert_eq!((trace.rows(), trace.batches().count()), (0, 0));
    let stats = statistics(&trace, |_| ()).unwrap();
    assert_eq!((stats.covered_pixels, stats.depth_complexity.max), (0, 0));
}

#[test]
fn the_writer_refuses_what_no_trace_may_hold() {
    let header = header(8, 8, 4);
    let good = random_fragments(&header, 1, 3)[0];
    let cases: [(&str, Fragment); 8] = [
        ("x lies outside", Fragment { x: 8, ..good }),
        ("y lies outside", Fragment { y: 65535, ..good }),
        ("coverage", Fragment { coverage: SampleMask::NONE, ..good }),
        ("coverage", Fragment { coverage: SampleMask(1 << 4), ..good }),
        ("coverage", Fragment { coverage: SampleMask(1 << 40), ..good }),
        ("alpha", Fragment { alpha: f32::NAN, ..good }),
        ("alpha", Fragment { alpha: 1.0 + f32::EPSILON, ..good }),
        ("colour", Fragment { colour: [0.0, 70000.0, 0.0], ..good }),
    ];
    for (expected, fragment) in cases {
        let mut writer =
            TraceWriter::new(Vec::new(), "t", header.clone(), WriteOptions::default()).unwrap();
        let pushed = writer.push(&good).and_then(|()| writer.push(&fragment));
        let error = pushed.and_then(|()| writer.finish().map(|_| ())).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("row 1"), "{error}");
    }
}

/// Reads everything that can be read: `Ok` is the content hash.
fn read_all(bytes: Vec<u8>) -> screendoor::error::Result<String> {
    Trace::from_bytes(bytes, "damaged")?.verify(|_| ())
}

#[test]
fn no_bit_flip_passes_and_none_panics() {
    let header = header(30, 30, 8);
    let fragments = random_fragments(&header, 300, 5);
    for compression in COMPRESSIONS {
        let options = WriteOptions { compression, batch_rows: 128 };
        let good = trace_bytes(&header, &fragments, options);
        read_all(good.clone()).unwrap();
        for bit in 0..good.len() * 8 {
            // Every bit of the frame; every 13th of the bulk.
            let byte = bit / 8;
            let in_frame = byte < 4096 || byte + 4096 > good.len();
            if !in_frame && bit % 13 != 0 {
                continue;
            }
            let mut bytes = good.clone();
            bytes[byte] ^= 1 << (bit % 8);
            assert!(read_all(bytes).is_err(), "{compression:?}: bit {bit} passes");
        }
    }
}

#[test]
fn no_truncation_or_splice_passes_and_none_panics() {
    let header = header(30, 30, 8);
    let fragments = random_fragments(&header, 200, 6);
    let options = WriteOptions { compression: Compression::Zstd, batch_rows: 64 };
    let good = trace_bytes(&header, &fragments, options);
    read_all(good.clone()).unwrap();
    for length in 0..good.len() {
        let error = read_all(good[..length].to_vec()).unwrap_err().to_string();
        assert!(error.starts_with("damaged"), "{error}");
    }
    let mut random = Stream::new([77]);
    for _ in 0..2000 {
        let mut bytes = good.clone();
        let from = random.below(bytes.len() as u32) as usize;
        let to = from + random.below((bytes.len() - from) as u32) as usize;
        match random.below(3) {
            0 => drop(bytes.drain(from..=to.min(bytes.len() - 1))),
            1 => bytes[from..to].fill(random.word() as u8),
            _ => bytes[from..to].reverse(),
        }
        assert!(bytes == good || read_all(bytes).is_err());
    }
}

/// The same trace as another program would write it: plain Arrow IPC, no seal.
pub fn unsealed(header: &Header, fragments: &[Fragment], compression: Compression) -> Vec<u8> {
    use arrow_array::RecordBatch;
    use arrow_ipc::CompressionType;
    use arrow_ipc::reader::FileReader;
    use arrow_ipc::writer::{FileWriter, IpcWriteOptions};

    let sealed = trace_bytes(header, fragments, WriteOptions::default());
    let reader = FileReader::try_new(std::io::Cursor::new(sealed), None).unwrap();
    let mut schema = (*reader.schema()).clone();
    schema.metadata.remove("screendoor.checksums");
    let options = IpcWriteOptions::try_new(8, false, arrow_ipc::MetadataVersion::V5).unwrap();
    let options = options
        .try_with_compression(match compression {
            Compression::None => None,
            Compression::Lz4 => Some(CompressionType::LZ4_FRAME),
            Compression::Zstd => Some(CompressionType::ZSTD),
        })
        .unwrap();
    let mut bytes = Vec::new();
    let mut writer = FileWriter::try_new_with_options(&mut bytes, &schema, options).unwrap();
    let schema = std::sync::Arc::new(schema);
    for batch in reader {
        let batch: RecordBatch = batch.unwrap();
        let columns = batch.columns().to_vec();
        writer.write(&RecordBatch::try_new(schema.clone(), columns).unwrap()).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes
}

#[test]
fn an_unsealed_file_reads_alike_and_its_damage_never_panics() {
    let header = header(30, 30, 8);
    let fragments = random_fragments(&header, 200, 8);
    let expected: Vec<_> = fragments.iter().map(|f| as_stored(&header, f)).collect();
    for compression in COMPRESSIONS {
        let good = unsealed(&header, &fragments, compression);
        let trace = Trace::from_bytes(good.clone(), "foreign").unwrap();
        assert!(!trace.is_sealed() && trace.content().is_none());
        let read: Vec<Fragment> = trace.batch(0).unwrap().iter().collect();
        assert!(read == expected);
        for bit in (0..good.len() * 8).filter(|bit| bit / 8 < 2048 || bit % 7 == 0) {
            let mut bytes = good.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let _ = read_all(bytes);
        }
        let mut random = Stream::new([78]);
        for _ in 0..20_000 {
            let mut bytes = good.clone();
            for _ in 0..=random.below(4) {
                let at = random.below(bytes.len() as u32) as usize;
                bytes[at] = [0, 0xff, 0x7f, random.word() as u8][random.below(4) as usize];
            }
            let _ = read_all(bytes);
        }
    }
}

#[test]
fn a_seal_cannot_be_lost() {
    // The mark in the schema's metadata says that there must be a seal: without
    // the footer's entries the file is damaged, not foreign.
    let header = header(30, 30, 8);
    let good = trace_bytes(&header, &random_fragments(&header, 10, 9), WriteOptions::default());
    let key = b"screendoor.blocks";
    let at = good.windows(key.len()).position(|w| w == key).unwrap();
    let mut bytes = good.clone();
    bytes[at + 3] ^= 1;
    let error = read_all(bytes).unwrap_err().to_string();
    assert!(error.contains("damaged"), "{error}");
}

#[test]
fn statistics_count_what_is_there() {
    let header = header(40, 40, 4);
    let whole = SampleMask(0b1111);
    let base = random_fragments(&header, 1, 9)[0];
    let at = |x, coverage, alpha, object| Fragment { x, y: 3, coverage, alpha, object, ..base };
    let fragments = [
        at(0, whole, 0.0, 7),
        at(0, whole, 1.0, 7),
        at(0, whole, 0.55, 8),
        at(20, SampleMask(0b0011), 0.5, 7),
    ];
    let stats = statistics(&trace(&header, &fragments), |_| ()).unwrap();
    assert_eq!((stats.fragments, stats.covered_pixels), (4, 2));
    assert_eq!((stats.whole_fragments, stats.interior_pixels), (3, 1));
    let depth = &stats.depth_complexity;
    assert_eq!((depth.mean, depth.median, depth.p95, depth.max), (2.0, 1, 3, 3));
    assert_eq!(depth.histogram, [1, 0, 1]);
    assert_eq!(stats.layers, (3.0 + 0.5) / 2.0);
    let alpha = &stats.alpha;
    assert_eq!((alpha.min, alpha.max, alpha.zero, alpha.opaque), (0.0, 1.0, 1, 1));
    assert_eq!(alpha.histogram, [1, 0, 0, 0, 0, 2, 0, 0, 0, 1]);
    assert_eq!((stats.objects.count, &stats.objects.largest[..]), (2, &[(7, 3), (8, 1)][..]));
}
