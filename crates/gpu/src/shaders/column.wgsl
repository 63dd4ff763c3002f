// A column of a chunk; which there are, `Columns` says, made of the table of columns.

struct Column {
    // The first word of the column.
    at: u32,
    // A constant column's value.
    low: u32,
    high: u32,
    unused: u32,
}
