//! What is exported reads back, and `docs/STUDIES.md` says what all of it is.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, UInt64Type};
use arrow_array::{Array, RecordBatch};
use arrow_ipc::reader::FileReader;

use super::table::{Cell, Column, Kind, columns};
use super::*;
use screendoor_study::metrics::Estimate;
use screendoor_study::study::analysis::made_up::plausible;
use screendoor_study::study::file::{SceneEntry, Study};
use screendoor_study::study::record::{PostFiltered, Record};
use screendoor_study::study::throughput::Spread;

/// Records with a value in every column, and with what is awkward.
fn records() -> Vec<Record> {
    let mut records = plausible(3, 18, &[4, 8]).records;
    records[1].series = "a \"quoted\", b;\n=1+1|".into();
    records[2].covered.rmse =
        Estimate { low: f64::NEG_INFINITY, high: f64::INFINITY, ..Estimate::exactly(3.5) };
    records[2].fine = Estimate::exactly(0.1 + 0.2);
    records[2].blocks = Some(Estimate::exactly(0.25));
    records[3].post = vec![PostFiltered {
        filter: "alpha".into(),
        covered: Estimate::exactly(1.5),
        interior: Estimate::exactly(1.25),
        edges: Estimate::exactly(1.75),
        flip: Some(Estimate::exactly(0.125)),
        blur: 0.5,
    }];
    records[3].events.hashes = u64::MAX;
    let gpu = records[3].speed.get_mut("gpu").unwrap();
    gpu.kernel = Some(Spread { low: 1e-9, median: 2e-7, high: 0.3 });
    gpu.threads = Some(1);
    let r = &mut records[4];
    (r.flip, r.flip_hdr, r.spectrum, r.covered.variance) = (None, None, None, None);
    r.filtered.clear();
    r.speed.clear();
    records
}

#[test]
fn json_lines_read_back_as_the_records() {
    let records = records();
    let text = String::from_utf8(json_lines(&records)).unwrap();
    let read: Vec<Record> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(read, records);
    // What is not known stays so: NaN does not equal itself.
    let mut unknown = records[0].clone();
    unknown.edges.rmse = Estimate::exactly(f64::NAN);
    let read: Record = serde_json::from_slice(&json_lines(&[unknown])).unwrap();
    assert!(read.edges.rmse.value.is_nan());
}

fn rows(csv: &[u8]) -> Vec<BTreeMap<String, String>> {
    ::csv::Reader::from_reader(csv).deserialize().map(|row| row.unwrap()).collect()
}

#[test]
fn csv_has_every_value_and_no_other() {
    let records = records();
    let rows = rows(&csv(&records));
    assert_eq!(rows.len(), records.len());
    for (row, r) in rows.iter().zip(&records) {
        assert_eq!(row["series"], r.series);
        assert_eq!(row["events.hashes"].parse(), Ok(r.events.hashes));
        assert_eq!(row["fine.value"].parse(), Ok(r.fine.value));
        assert_eq!(row["promises.seeded"].parse(), Ok(r.promises.seeded));
        let absent = |of: Option<f64>| of.map_or(String::new(), |v| format!("{v:?}"));
        assert_eq!(row["covered.variance"], absent(r.covered.variance));
        assert_eq!(row["flip.mean.value"], absent(r.flip.map(|f| f.mean.value)));
        let finite = |v: f64| v.is_finite().then_some(v);
        assert_eq!(row["covered.rmse.low"], absent(finite(r.covered.rmse.low)));
        let power = r.spectrum.as_ref().map_or(vec![], |s| s.power.clone());
        let read: Vec<f64> =
            row["spectrum.power"].split_whitespace().map(|v| v.parse().unwrap()).collect();
        assert_eq!(read, power);
        let time = r.nanoseconds_per_fragment("fast").map(|s| s.median);
        assert_eq!(row["nanoseconds_per_fragment.fast.median"], absent(time));
        assert_eq!(row["state_bytes"], absent(r.state_bytes()));
        assert_eq!(row["covered.mean.value"].parse(), Ok(r.covered.mean.value));
        assert_eq!(row["tied_share"], absent(r.tied_share()));
        assert_eq!(row["unbiased_here"].parse(), Ok(r.kept().unbiased));
    }
}

#[test]
fn columns_do_not_depend_on_the_order_of_records() {
    let mut records = records();
    let names = |records: &[Record]| -> Vec<String> {
        columns(records).into_iter().map(|c| c.name).collect()
    };
    let forwards = names(&records);
    records.reverse();
    assert_eq!(names(&records), forwards);
    records.rotate_left(7);
    assert_eq!(names(&records), forwards);
    let place = |name: &str| forwards.iter().position(|n| n == name).unwrap();
    assert_eq!((place("id"), place("scene")), (0, 1));
    assert!(place("speed.gpu.seconds.low") < place("state_bytes"));
    let distinct: BTreeSet<&String> = forwards.iter().collect();
    assert_eq!(distinct.len(), forwards.len());
}

fn batch(bytes: Vec<u8>) -> Option<RecordBatch> {
    FileReader::try_new(Cursor::new(bytes), None).unwrap().next().map(|batch| batch.unwrap())
}

/// A row of an Arrow column.
fn cell(array: &dyn Array, kind: Kind, row: usize) -> Option<Cell> {
    array.is_valid(row).then(|| match kind {
        Kind::Flag => Cell::Flag(array.as_boolean().value(row)),
        Kind::Count => Cell::Count(array.as_primitive::<UInt64Type>().value(row)),
        Kind::Number => Cell::Number(array.as_primitive::<Float64Type>().value(row)),
        Kind::List => {
            let list = array.as_list::<i32>().value(row);
            Cell::List(list.as_primitive::<Float64Type>().iter().collect())
        }
        Kind::Text => Cell::Text(array.as_string::<i32>().value(row).into()),
    })
}

#[test]
fn arrow_has_the_same_columns_typed() {
    let records = records();
    let batch = batch(arrow(&records)).unwrap();
    let columns = columns(&records);
    assert_eq!((batch.num_rows(), batch.num_columns()), (records.len(), columns.len()));
    for (column, field) in columns.iter().zip(batch.schema().fields()) {
        assert_eq!(field.name(), &column.name);
        let array = batch.column_by_name(&column.name).unwrap();
        for (row, expected) in column.cells.iter().enumerate() {
            assert_eq!(&cell(array, column.kind, row), expected, "{} {row}", column.name);
        }
    }
}

#[test]
fn without_records_there_are_no_columns() {
    assert!(batch(arrow(&[])).is_none());
    assert!(csv(&[]).is_empty());
    assert!(json_lines(&[]).is_empty());
}

const DOCUMENT: &str = include_str!("../../../../docs/STUDIES.md");

/// The rows of the table under a heading of the document, their first cells without quotes.
fn documented(heading: &str) -> Vec<Vec<String>> {
    let (_, part) = DOCUMENT.split_once(&format!("# {heading}\n")).expect(heading);
    let part = part.split("\n#").next().unwrap();
    let rows = part.lines().filter(|l| l.starts_with("| `"));
    let cells = |l: &str| l.trim_matches('|').split('|').map(|c| c.trim().to_string()).collect();
    let mut rows: Vec<Vec<String>> = rows.map(cells).collect();
    rows.iter_mut().for_each(|row| row[0] = row[0].trim_matches('`').into());
    rows
}

/// A column's name as the document has it, and what it holds there.
fn general(column: &Column, records: &[Record]) -> (String, &'static str) {
    let engine = |s: &str| records.iter().any(|r| r.speed.contains_key(s));
    let segment = |s: &str| match s {
        "frame" | "covered" | "interior" | "edges" => "REGION".to_string(),
        s if engine(s) => "ENGINE".into(),
        s if s.parse::<usize>().is_ok() => "N".into(),
        s => s.into(),
    };
    let name = column.name.split('.').map(segment).collect::<Vec<_>>().join(".");
    let exact = match column.kind {
        Kind::Flag => "yes or no",
        Kind::Count => "count",
        Kind::Number => "number",
        Kind::List => "list",
        Kind::Text => "text",
    };
    match name.rsplit_once('.') {
        Some((whole, "value")) => (whole.into(), "estimate"),
        Some((whole, "median")) => (whole.into(), "spread"),
        _ => (name, exact),
    }
}

#[test]
fn every_column_is_documented_and_every_documented_one_is_there() {
    let records = records();
    let is: BTreeSet<(String, &str)> =
        columns(&records).iter().map(|c| general(c, &records)).collect();
    // An interval's ends and quartiles stand under what they belong to.
    let whole = |name: &str| {
        name.strip_suffix(".low").or(name.strip_suffix(".high")).is_some_and(|whole| {
            ["estimate", "spread"].iter().any(|holds| is.contains(&(whole.into(), holds)))
        })
    };
    let is: BTreeSet<(String, String)> =
        is.iter().filter(|(n, _)| !whole(n)).map(|(n, h)| (n.clone(), h.to_string())).collect();
    let table = documented("Columns of the results");
    let said: BTreeSet<(String, String)> =
        table.iter().map(|row| (row[0].clone(), row[1].clone())).collect();
    assert_eq!(is, said);
    for derived in DERIVED {
        let row = table.iter().find(|r| r[0].split(".ENGINE").next() == Some(derived.name));
        assert_eq!(row.unwrap()[2], derived.unit, "{}", derived.name);
    }
}

/// A scene with a value for every key.
fn whole_scene(small: &SceneEntry) -> SceneEntry {
    SceneEntry {
        name: small.name.clone(),
        source: Some(String::new()),
        trace: Some(String::new()),
        size: small.size,
        alpha: Some(0.5),
        texture: Some(String::new()),
        white: small.white,
        order: small.order,
        order_seed: small.order_seed,
        faces: small.faces,
        pattern: small.pattern,
        captured_samples: small.captured_samples,
        angle: Some([0.0; 2]),
        distance: Some(1.0),
        fov: Some(1.0),
        camera: Some(String::new()),
        camera_name: Some(String::new()),
        splat_rules: Some(String::new()),
        opacity: Some(String::new()),
        screen_door: Some(String::new()),
        axes: Some(Default::default()),
        line_width: Some(1.0),
        space: Some(Default::default()),
        background: Some([0.0; 3]),
        light: Some(String::new()),
        pixel: Some([0; 2]),
        shadow: Some(toml::from_str("design = 'lk'").unwrap()),
    }
}

#[test]
fn every_key_of_a_study_is_documented_with_its_default() {
    let text = "name = 'a'\ndesigns = ['lk']\nsamples = [8]\n[[scene]]\nname = 'b'\nsource = 'c'";
    let mut study = Study::parse(text, "a.toml").unwrap();
    let given: toml::Table = toml::from_str(text).unwrap();
    let small: toml::Table = toml::from_str(&study.to_toml()).unwrap();
    let scene = |study: &toml::Table| study["scene"][0].as_table().unwrap().clone();
    let shadow_given: toml::Table = toml::from_str("design = 'lk'").unwrap();
    let (given_scene, small_scene) = (scene(&given), scene(&small));
    study.scenes[0] = whole_scene(&study.scenes[0]);
    let whole: toml::Table = toml::from_str(&study.to_toml()).unwrap();
    // Of a shadow all keys are always written.
    let shadow = scene(&whole)["shadow"].as_table().unwrap().clone();
    let keys = [
        ("Keys of a study", small, given, whole.clone()),
        ("Keys of a scene", small_scene, given_scene, scene(&whole)),
        ("Keys of a shadow", shadow.clone(), shadow_given, shadow),
    ];
    for (heading, small, given, whole) in keys {
        let table = documented(heading);
        let said: BTreeSet<&String> = table.iter().map(|row| &row[0]).collect();
        assert_eq!(said, whole.keys().collect(), "{heading}");
        for row in &table {
            // Defaults that depend on something are told in words.
            let told = row[2].strip_prefix('`').and_then(|t| t.strip_suffix('`'));
            let default = small.get(&row[0]).filter(|_| !given.contains_key(&row[0]));
            let default = default
                .filter(|_| !["baseline", "pictures"].contains(&&*row[0]))
                .map(toml::Value::to_string);
            assert_eq!(told, default.as_deref(), "{heading}: {}", row[0]);
        }
    }
}

#[test]
fn studies_that_are_shown_are_some() {
    let mut examples =
        DOCUMENT.split("```toml\n").skip(1).map(|part| part.split("```").next().unwrap());
    let study = Study::parse(examples.next().unwrap(), "STUDIES.md").unwrap();
    assert_eq!((study.scenes.len(), study.seeds), (2, 16));
    let lit = examples.next().unwrap();
    let lit = format!("name = 'a'\ndesigns = ['lk']\nsamples = [8]\n{lit}");
    let lit = Study::parse(&lit, "STUDIES.md").unwrap();
    assert_eq!(
        (lit.scenes.len(), lit.scenes[11].name.as_str()),
        (12, "hair-merging-layers-8-8-16")
    );
    for (name, text) in [
        ("shadows", include_str!("../../../../workflow/shadows.toml")),
        ("opacity", include_str!("../../../../workflow/opacity.toml")),
        ("filters", include_str!("../../../../workflow/filters.toml")),
    ] {
        let study = Study::parse(text, name).unwrap();
        let scenes = study.scenes.len();
        assert!(scenes >= 3 && study.designs.len() >= 2, "{name}: {scenes}");
    }
    let small = include_str!("../../../../workflow/small.toml");
    let small = Study::parse(small, "small.toml").unwrap();
    assert!(small.scenes.iter().all(|s| s.size == Some([64, 64])));
}
