//! Optional columns in files: stored, constant and absent, by a column of the tests' own.

use crate::error::Result;
use crate::trace::{
    ColumnId, Fragment, Header, SampleMask, SamplePattern, Scalar, Trace, TraceWriter, WriteOptions,
};

fn header() -> Header {
    let positions = vec![[0, 0]];
    let pattern = SamplePattern { name: "one".into(), positions, nested: false };
    Header { width: 64, height: 1, pattern, ..Header::default() }
}

fn fragments(probe: impl Fn(u16) -> f32) -> Vec<Fragment> {
    let fragment = |x| {
        let mut f = Fragment { x, coverage: SampleMask(1), alpha: 0.5, ..Fragment::default() };
        f.optional.probe = probe(x);
        f
    };
    (0..64).map(fragment).collect()
}

fn write(header: Header, fragments: &[Fragment]) -> Result<Vec<u8>> {
    let options = WriteOptions { batch_rows: 20, ..WriteOptions::default() };
    let mut writer = TraceWriter::new(Vec::new(), "t", header, options)?;
    fragments.iter().try_for_each(|f| writer.push(f))?;
    Ok(writer.finish()?.0)
}

fn read(file: Vec<u8>) -> (Header, Vec<(ColumnId, usize)>, Vec<Fragment>) {
    let trace = Trace::from_bytes(file, "t").unwrap();
    trace.verify(|_| ()).unwrap();
    let stored = trace.columns().iter().map(|(id, t)| (*id, t.bytes())).collect();
    let fragments = trace.batches().flat_map(|b| b.unwrap().iter().collect::<Vec<_>>()).collect();
    (trace.header().clone(), stored, fragments)
}

#[test]
fn an_absent_column_has_its_default_and_no_place_in_the_file() {
    let fragments = fragments(|_| 0.5);
    let file = write(header(), &fragments).unwrap();
    let text = String::from_utf8_lossy(&file).into_owned();
    assert!(!text.contains("probe"));
    let (found, stored, rows) = read(file);
    assert!(found == header() && stored.iter().all(|(id, _)| *id != ColumnId::Probe));
    assert_eq!(rows, fragments);
}

#[test]
fn a_stored_column_is_read_back_bit_for_bit() {
    let mut header = header();
    header.optional.insert(ColumnId::Probe);
    let fragments = fragments(|x| f32::from(x) / 3.0);
    let (found, stored, rows) = read(write(header.clone(), &fragments).unwrap());
    assert!(found == header && stored.last() == Some(&(ColumnId::Probe, 4)));
    assert_eq!(rows, fragments);
}

#[test]
fn a_constant_column_is_stated_once() {
    let mut header = header();
    header.optional.insert(ColumnId::Probe);
    header.constants.insert(ColumnId::Probe, Scalar::Real(7.25));
    let fragments = fragments(|_| 7.25);
    let (found, stored, rows) = read(write(header.clone(), &fragments).unwrap());
    assert!(found == header && stored.iter().all(|(id, _)| *id != ColumnId::Probe));
    assert_eq!(rows, fragments);
}

#[test]
fn what_the_header_does_not_name_is_not_lost_in_silence() {
    let error = write(header(), &fragments(f32::from)).unwrap_err().to_string();
    assert!(error.contains("row 0") && error.contains("'probe'"), "{error}");
    let mut header = header();
    header.constants.insert(ColumnId::Probe, Scalar::Real(1.0));
    let error = write(header, &fragments(|_| 1.0)).unwrap_err().to_string();
    assert!(error.contains("'probe'") && error.contains("optional columns"), "{error}");
}

#[test]
fn its_values_are_checked() {
    let mut header = header();
    header.optional.insert(ColumnId::Probe);
    let bad = |x| if x == 33 { f32::NAN } else { 0.5 };
    let error = write(header, &fragments(bad)).unwrap_err().to_string();
    assert!(error.contains("after row 20, row 13"), "{error}");
}
