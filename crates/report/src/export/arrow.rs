//! Arrow IPC.

use std::sync::Arc;

use arrow_array::{
    Array, ArrayRef, BooleanArray, Float64Array, ListArray, RecordBatch, StringArray, UInt64Array,
};
use arrow_buffer::{NullBuffer, OffsetBuffer};
use arrow_ipc::writer::FileWriter;
use arrow_schema::{ArrowError, DataType, Field, Schema};

use crate::export::table::{Cell, Column, Kind, columns};
use screendoor_study::study::record::Record;

/// Records as an Arrow IPC file, one a row, with the columns of [`csv`](super::csv): texts as
/// Utf8, counts as UInt64, numbers as Float64, lists as List of Float64, yes or no as
/// Boolean. A value that is missing is null.
pub fn arrow(records: &[Record]) -> Vec<u8> {
    file(&columns(records)).expect("columns are of one length, and memory takes all")
}

fn file(columns: &[Column]) -> Result<Vec<u8>, ArrowError> {
    let arrays: Vec<ArrayRef> = columns.iter().map(array).collect();
    let field = |(c, a): (&Column, &ArrayRef)| Field::new(&c.name, a.data_type().clone(), true);
    let fields: Vec<Field> = columns.iter().zip(&arrays).map(field).collect();
    let schema = Arc::new(Schema::new(fields));
    let mut writer = FileWriter::try_new(Vec::new(), &schema)?;
    if !arrays.is_empty() {
        writer.write(&RecordBatch::try_new(schema, arrays)?)?;
    }
    writer.into_inner()
}

fn array(column: &Column) -> ArrayRef {
    let cells = || column.cells.iter().map(Option::as_ref);
    match column.kind {
        Kind::Flag => Arc::new(BooleanArray::from_iter(cells().map(|cell| match cell? {
            Cell::Flag(flag) => Some(*flag),
            _ => None,
        }))),
        Kind::Count => Arc::new(UInt64Array::from_iter(cells().map(|cell| match cell? {
            Cell::Count(count) => Some(*count),
            _ => None,
        }))),
        Kind::Number => Arc::new(Float64Array::from_iter(cells().map(|cell| cell?.number()))),
        Kind::List => Arc::new(list(&column.cells)),
        Kind::Text => Arc::new(StringArray::from_iter(cells().map(|cell| Some(cell?.text())))),
    }
}

fn list(cells: &[Option<Cell>]) -> ListArray {
    let lists = || {
        cells.iter().map(|cell| match cell {
            Some(Cell::List(list)) => Some(&list[..]),
            _ => None,
        })
    };
    let lengths = lists().map(|list| list.map_or(0, <[_]>::len));
    let values = Float64Array::from_iter(lists().flatten().flatten());
    let entry = Arc::new(Field::new_list_field(DataType::Float64, true));
    let nulls = NullBuffer::from_iter(lists().map(|list| list.is_some()));
    ListArray::new(entry, OffsetBuffer::from_lengths(lengths), Arc::new(values), Some(nulls))
}
