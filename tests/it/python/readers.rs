//! What other programs read of our traces, and what is read of theirs: pyarrow, polars and
//! DuckDB, at the versions that are installed.

use std::path::Path;

use screendoor::trace::{
    ColourFormat, Compression, Fragment, Header, Trace, TraceWriter, WriteOptions,
};

use super::run;
use crate::util::{half_header as header, random_fragments, trace_bytes};

/// Holds what each of the three reads of a file to the others.
const READ: &str = r#"
import pyarrow as pa, polars as pl, duckdb
for name in open("names").read().split():
    table = pa.ipc.open_file(name).read_all()
    mapped = pa.ipc.open_file(pa.memory_map(name)).read_all()
    assert mapped.equals(table)
    expected = {c: table[c].to_pylist() for c in table.column_names}
    assert table.num_rows == 500 and len(expected) == 12
    frame = pl.read_ipc(name)
    assert {c: frame[c].to_list() for c in frame.columns} == expected, name
    lazy = pl.scan_ipc(name).select(pl.col("z").cast(pl.UInt64).sum()).collect().item()
    assert lazy == sum(expected["z"])
    # DuckDB knows no half floats: they are widened.
    wide = [pa.field(f.name, pa.float32() if f.type == pa.float16() else f.type) for f in table.schema]
    widened = table.cast(pa.schema(wide))
    rows = duckdb.sql("select * from widened").fetchall()
    assert rows == list(zip(*expected.values())), name
    # Where that is said no longer, TRACE_FORMAT.md is to be corrected.
    as_it_is = table
    try:
        assert duckdb.sql("select * from as_it_is").fetchall() == rows, name
        assert "half" not in name, "DuckDB reads half floats"
    except duckdb.NotImplementedException:
        assert "half" in name
    print(name, table.num_rows)
"#;

#[test]
#[ignore = "needs python3 with pyarrow, polars and duckdb (SCREENDOOR_PYTHON names another one)"]
fn three_readers_read_what_we_write() {
    let folder = tempfile::tempdir().unwrap();
    let mut names = Vec::new();
    for colour in [ColourFormat::F16, ColourFormat::F32] {
        for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
            let header = Header { colour, ..header(20, 20, 8) };
            let options = WriteOptions { compression, batch_rows: 128 };
            let bytes = trace_bytes(&header, &random_fragments(&header, 500, 4), options);
            let width = if colour == ColourFormat::F16 { "half" } else { "single" };
            let name = format!("{width}-{compression:?}.arrow").to_lowercase();
            std::fs::write(folder.path().join(&name), bytes).unwrap();
            names.push(name);
        }
    }
    std::fs::write(folder.path().join("names"), names.join(" ")).unwrap();
    let said = run(folder.path(), READ);
    let expected: String = names.iter().map(|name| format!("{name} 500\n")).collect();
    assert_eq!(said, expected);
}

/// Writes a trace anew in the ways of other programs.
const WRITE: &str = r#"
import gzip, numpy as np, pyarrow as pa, pyarrow.feather as feather, pyarrow.parquet as parquet, polars as pl
table = pa.ipc.open_file("good.arrow").read_all()
said = {k: v for k, v in table.schema.metadata.items() if k != b"screendoor.checksums"}
def file(name, table, stream=False):
    table = table.replace_schema_metadata(said)
    new = pa.ipc.new_stream if stream else pa.ipc.new_file
    with new(name, table.schema) as writer:
        writer.write_table(table)
file("plain.arrow", table)
file("stream.arrow", table, stream=True)
file("reordered.arrow", table.select(sorted(table.column_names)))
extra = pa.array([f"leaf {i}" for i in range(table.num_rows)])
file("extra.arrow", table.add_column(4, "name", extra).append_column("nested", pa.array([{"a": [1, None]}] * table.num_rows)))
file("pandas.arrow", pa.table({c: np.asarray(v).astype(np.float64 if c in ("r", "g", "b", "alpha") else np.int64)
                               for c, v in zip(table.column_names, table.columns)}))
frame = pl.from_arrow(table).with_columns(pl.lit("a name that is long").alias("name"))
file("polars.arrow", frame.to_arrow())
file("polars-views.arrow", frame.to_arrow(compat_level=pl.CompatLevel.newest()))
feather.write_feather(table.replace_schema_metadata(said), "feather.arrow")
file("chunks.arrow", pa.concat_tables([table.slice(0, 77), table.slice(77)]))
# Refused, with a word on what to do.
file("dictionary.arrow", table.set_column(11, "object", table["object"].dictionary_encode()))
file("gaps.arrow", table.set_column(11, "object", pa.array([None] + table["object"].to_pylist()[1:], pa.uint32())))
parquet.write_table(table, "table.parquet")
with open("good.arrow", "rb") as good, gzip.open("good.arrow.gz", "wb") as out:
    out.write(good.read())
with pa.ipc.new_file("resealed.arrow", table.schema) as writer:
    writer.write_table(table)
"#;

#[test]
#[ignore = "needs python3 with pyarrow, polars and numpy (SCREENDOOR_PYTHON names another one)"]
fn what_others_write_is_read_or_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let header = Header { colour: ColourFormat::F32, ..header(20, 20, 8) };
    let fragments = random_fragments(&header, 300, 5);
    let path = |name: &str| folder.path().join(name);
    let mut writer = TraceWriter::create(path("good.arrow"), header, Default::default()).unwrap();
    fragments.iter().for_each(|f| writer.push(f).unwrap());
    writer.finish().unwrap().0.commit().unwrap();
    run(folder.path(), WRITE);

    let read = |path: &Path| -> Vec<Fragment> {
        let trace = Trace::open(path).unwrap();
        assert!(!trace.is_sealed());
        trace.verify(|_| ()).unwrap();
        trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
    };
    for name in [
        "plain",
        "stream",
        "reordered",
        "extra",
        "pandas",
        "polars",
        "polars-views",
        "feather",
        "chunks",
    ] {
        assert!(read(&path(&format!("{name}.arrow"))) == fragments, "{name}");
    }
    for (name, words) in [
        ("dictionary.arrow", ["'object'", "dictionary-encoded"]),
        ("gaps.arrow", ["'object'", "has nulls"]),
        ("table.parquet", ["Parquet", "python3 -c"]),
        ("good.arrow.gz", ["gzip", "gunzip"]),
        ("resealed.arrow", ["has no seal", "screendoor.checksums"]),
    ] {
        let error = Trace::open(path(name)).and_then(|trace| trace.verify(|_| ())).unwrap_err();
        let error = error.to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }

    // The line that the refusal of a Parquet file gives does what it says.
    let error = Trace::open(path("table.parquet")).unwrap_err().to_string();
    let line = error.split("python3 -c \"").nth(1).unwrap().split('"').next().unwrap();
    run(folder.path(), &line.replace("FILE", "table.parquet").replace("NEW", "converted"));
    assert!(read(&path("converted.arrow")) == fragments);
}
