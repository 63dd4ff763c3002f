//! Records as a table: nested fields become columns with dotted names.

use std::collections::BTreeMap;

use crate::export::derived::DERIVED;
use crate::export::tree::Tree;
use screendoor_study::study::record::Record;

/// What a column holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    Flag,
    Count,
    Number,
    List,
    Text,
}

impl Kind {
    /// What holds both.
    fn with(self, other: Self) -> Self {
        match (self, other) {
            (a, b) if a == b => a,
            (Kind::Count | Kind::Number, Kind::Count | Kind::Number) => Kind::Number,
            _ => Kind::Text,
        }
    }
}

#[derive(Clone, PartialEq, Debug)]
pub(super) enum Cell {
    Flag(bool),
    Count(u64),
    Number(f64),
    List(Vec<Option<f64>>),
    Text(String),
}

impl Cell {
    fn kind(&self) -> Kind {
        match self {
            Cell::Flag(_) => Kind::Flag,
            Cell::Count(_) => Kind::Count,
            Cell::Number(_) => Kind::Number,
            Cell::List(_) => Kind::List,
            Cell::Text(_) => Kind::Text,
        }
    }

    /// As text. Numbers read back as the same; those of a list stand between spaces.
    pub(super) fn text(&self) -> String {
        match self {
            Cell::Flag(flag) => flag.to_string(),
            Cell::Count(count) => count.to_string(),
            Cell::Number(number) => format!("{number:?}"),
            Cell::List(list) => {
                let numbers = list.iter().map(|v| format!("{:?}", v.unwrap_or(f64::NAN)));
                numbers.collect::<Vec<_>>().join(" ")
            }
            Cell::Text(text) => text.clone(),
        }
    }

    /// As a number, if it is one.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Cell::Count(count) => Some(*count as f64),
            Cell::Number(number) => Some(*number),
            _ => None,
        }
    }
}

/// A column: every record's cell, or none where it has no value.
pub(super) struct Column {
    pub name: String,
    pub kind: Kind,
    pub cells: Vec<Option<Cell>>,
}

/// The columns in which at least one record has a value: the record's own in the order of
/// its fields, then the derived ones.
pub(super) fn columns(records: &[Record]) -> Vec<Column> {
    let rows: Vec<_> = records.iter().map(row).collect();
    let mut names: Vec<&str> = Vec::new();
    for row in &rows {
        let mut next = 0;
        for (name, _) in row {
            // What this record has and none before had stands where it has it.
            let known = match names.get(next) {
                Some(expected) if expected == name => Some(next),
                _ => names.iter().position(|n| n == name),
            };
            let place = known.unwrap_or(next);
            if known.is_none() {
                names.insert(place, name);
            }
            next = place + 1;
        }
    }
    let mut rows: Vec<BTreeMap<&str, &Option<Cell>>> =
        rows.iter().map(|row| row.iter().map(|(n, cell)| (n.as_str(), cell)).collect()).collect();
    let column = |name: &str| {
        let cells: Vec<Option<Cell>> =
            rows.iter_mut().map(|row| row.remove(name).cloned().flatten()).collect();
        let kind = cells.iter().flatten().map(Cell::kind).reduce(Kind::with)?;
        Some(Column { name: name.into(), kind, cells })
    };
    names.into_iter().filter_map(column).collect()
}

type Row = Vec<(String, Option<Cell>)>;

fn row(record: &Record) -> Row {
    let mut row = Row::new();
    flatten(String::new(), Tree::of(record), &mut row);
    for derived in DERIVED {
        flatten(derived.name.into(), derived.of(record), &mut row);
    }
    row
}

/// Fields by their names, entries of lists by their numbers; a list of numbers is one cell.
/// What has no value keeps its place.
fn flatten(name: String, value: Tree, row: &mut Row) {
    let below = |key: &str| if name.is_empty() { key.into() } else { format!("{name}.{key}") };
    let cell = match value {
        Tree::Map(map) if !map.is_empty() => {
            return map.into_iter().for_each(|(key, value)| flatten(below(&key), value, row));
        }
        Tree::List(list) if !list.is_empty() => match list.iter().map(number).collect() {
            Some(numbers) => Some(Cell::List(numbers)),
            None => {
                let numbered = list.into_iter().enumerate();
                return numbered.for_each(|(i, v)| flatten(below(&i.to_string()), v, row));
            }
        },
        Tree::Missing | Tree::Map(_) | Tree::List(_) => None,
        Tree::Flag(flag) => Some(Cell::Flag(flag)),
        Tree::Count(count) => Some(Cell::Count(count)),
        Tree::Number(number) => Some(Cell::Number(number)),
        Tree::Text(text) => Some(Cell::Text(text)),
    };
    row.push((name, cell));
}

/// An entry of a list of numbers; `None` where it is something else.
fn number(value: &Tree) -> Option<Option<f64>> {
    match value {
        Tree::Count(count) => Some(Some(*count as f64)),
        Tree::Number(number) => Some(Some(*number)),
        Tree::Missing => Some(None),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_become_dotted_names() {
        let json = r#"{"a": {"b": 1, "c": null}, "d": [{"e": "x"}, {"e": true}],
            "f": [1, 2.5, null], "g": []}"#;
        let mut row = Row::new();
        flatten(String::new(), serde_json::from_str(json).unwrap(), &mut row);
        let list = Cell::List(vec![Some(1.0), Some(2.5), None]);
        assert_eq!(list.text(), "1.0 2.5 NaN");
        let expected = [
            ("a.b", Some(Cell::Count(1))),
            ("a.c", None),
            ("d.0.e", Some(Cell::Text("x".into()))),
            ("d.1.e", Some(Cell::Flag(true))),
            ("f", Some(list)),
            ("g", None),
        ];
        assert_eq!(row, expected.map(|(name, cell)| (name.to_string(), cell)));
    }
}
