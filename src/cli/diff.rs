//! `screendoor diff`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::arguments::MemoryArgument;
use crate::cli::console::{Console, grouped, shown};
use crate::cli::files::{JsonArgument, check, open_trace, report};
use crate::edit::{
    Difference, FirstDifference, HeaderDifference, Kept, difference, header_differences,
};
use crate::error::Result;
use crate::trace::{ColumnId, ColumnKind, Scalar, Trace};

/// Compare two traces fragment by fragment; ends with 3 where anything differs that a replay can
/// depend on
#[derive(Debug, Args)]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that pixels and fragments may take that are looked at; less takes more passes")
}))]
pub(super) struct Arguments {
    /// A trace
    first: PathBuf,
    /// Another one
    second: PathBuf,
    #[command(flatten)]
    memory: MemoryArgument,
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(Serialize)]
struct Document {
    traces: [String; 2],
    /// Whether every replay of the two gives the same picture, bit for bit.
    same: bool,
    header: Vec<HeaderDifference>,
    /// How the fragments differ; null where the frames are not of one size.
    fragments: Option<Difference>,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let paths = [&*arguments.first, &*arguments.second];
    let outputs: Vec<&Path> = arguments.json.path().into_iter().collect();
    check(&paths, &outputs)?;
    let [a, b] = [open_trace(paths[0], console)?, open_trace(paths[1], console)?];
    let json = arguments.json.open()?;
    let header = header_differences(a.header(), b.header());
    let size = |trace: &Trace| (trace.header().width, trace.header().height);
    let compare = || {
        let progress = console.progress("comparing", "rows of pixels");
        difference([&a, &b], arguments.memory.bytes(), &mut |done, of| progress.set(done, of))
    };
    let fragments = (size(&a) == size(&b)).then(compare).transpose()?;
    let alike = fragments.as_ref().is_some_and(|found| found.same <= Kept::Pixels);
    let document = Document {
        traces: [&a, &b].map(|trace| trace.place().to_string()),
        same: alike && !header.iter().any(|entry| entry.matters),
        header,
        fragments,
    };
    // Before it is printed: who reads no further is told by the program's end all the same.
    if !document.same {
        console.differ();
    }
    report(json, "screendoor.diff", &document, console, || print(&document, console))
}

fn print(document: &Document, console: &Console) -> Result<()> {
    let line =
        |name: &str, value: String| console.print(format_args!("{name:<17} {}", shown(value)));
    for HeaderDifference { entry, values: [a, b], .. } in &document.header {
        line(entry, format!("{a} | {b}"))?;
    }
    let Some(found) = &document.fragments else {
        return console
            .print(format_args!("fragments of frames of different sizes are not compared"));
    };
    let [a, b] = found.fragments.map(grouped);
    line("fragments", if a == b { a } else { format!("{a} | {b}") })?;
    if let Some(row) = found.row {
        line("rows", format!("the first that differs is row {}", grouped(row)))?;
    }
    let more = [
        (found.reordered, "the same fragments in another order"),
        (found.counts, "not as many fragments in both"),
    ];
    let more = more.into_iter().filter(|(n, _)| *n > 0);
    let more: Vec<String> = more.map(|(n, what)| format!("{} have {what}", grouped(n))).collect();
    let more = if more.is_empty() { String::new() } else { format!(": {}", more.join(", ")) };
    if found.pixels > 0 {
        line("pixels", format!("{} differ{more}", grouped(found.pixels)))?;
    }
    if let Some(first) = &found.first {
        line("first", told(first))?;
    }
    let comparable = found.pixels - found.counts;
    if found.counts > 0 || found.compared < comparable {
        let [compared, all] = [found.compared, comparable].map(grouped);
        let memory = if found.compared < comparable { "; more take more --memory" } else { "" };
        line(
            "columns",
            format!("of {compared} of the {all} pixels that have as many in both{memory}"),
        )?;
    }
    for column in &found.columns {
        let (fragments, most) = (grouped(column.fragments), column.most);
        let unit = if column.column == ColumnId::Coverage.name() { " samples" } else { "" };
        line(
            &format!("  {}", column.column),
            format!("differs in {fragments} fragments, by {most}{unit} at most"),
        )?;
    }
    console.print(format_args!(
        "{}",
        match (found.same, document.same) {
            (Kept::Rows, true) => "the same fragments in the same order",
            (Kept::Pixels, true) =>
                "in each pixel the same fragments in the same order: replays give the same pictures",
            (Kept::Rows | Kept::Pixels, false) => "the same fragments under headers that differ",
            (Kept::Fragments, _) => "in each pixel the same fragments, not all in the same order",
            (Kept::Nothing, _) => "the fragments differ",
        }
    ))
}

/// The first fragment that differs, in a line.
fn told(first: &FirstDifference) -> String {
    let FirstDifference { pixel: [x, y], fragment, rows, fragments, columns } = first;
    let place = format!("pixel {x},{y}, its fragment {fragment}");
    match (rows, fragments) {
        ([Some(a), Some(b)], [Some(of_a), Some(of_b)]) => {
            let differs = |id: &ColumnId| columns.contains(&id.name());
            let values = ColumnId::ALL.into_iter().filter(differs).map(|id| {
                let [a, b] = [of_a, of_b].map(|fragment| match (id.kind(), fragment.value(id)) {
                    (ColumnKind::Mask, Scalar::Unsigned(mask)) => format!("{mask:#x}"),
                    (_, value) => value.to_string(),
                });
                format!("{} {a} | {b}", id.name())
            });
            let values: Vec<String> = values.collect();
            format!("{place} (rows {a} | {b}): {}", values.join(", "))
        }
        ([Some(row), None], _) => format!("{place}: only in the first trace (row {row})"),
        ([None, Some(row)], _) => format!("{place}: only in the second trace (row {row})"),
        _ => place,
    }
}
