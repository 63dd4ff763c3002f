//! JSON lines and CSV.

use crate::export::table::columns;
use screendoor_study::study::record::Record;

/// Records as JSON, one a line. Numbers that are not finite are `null`.
pub fn json_lines(records: &[Record]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for record in records {
        serde_json::to_writer(&mut bytes, record).expect("keys are texts, and memory takes all");
        bytes.push(b'\n');
    }
    bytes
}

/// Records as CSV with a header, one a row. The columns are those in which any record has a
/// value; a cell without one is empty. No records make an empty file.
pub fn csv(records: &[Record]) -> Vec<u8> {
    const MEMORY: &str = "rows are of one length, and memory takes all";
    let columns = columns(records);
    if columns.is_empty() {
        return Vec::new();
    }
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.iter().map(|c| &c.name)).expect(MEMORY);
    for row in 0..records.len() {
        let cell = |i: usize| columns[i].cells[row].as_ref().map_or(String::new(), |c| c.text());
        writer.write_record((0..columns.len()).map(cell)).expect(MEMORY);
    }
    writer.into_inner().expect(MEMORY)
}
