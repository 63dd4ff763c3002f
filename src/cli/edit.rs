//! `screendoor convert`, `trim`, `join` and `shuffle`: traces made of traces.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::arguments::{MemoryArgument, option, range, samples, size};
use crate::cli::console::{Console, grouped};
use crate::cli::files::{Json, JsonArgument, check, keep_trace, open_trace, print_trace, report};
use crate::cli::kind::{Kind, check_output};
use crate::edit::{
    Area, Constants, Convert, ConvertOptions, Edit, Merge, MergeOptions, Sequence, Shuffle,
    ShuffleOptions, Trim, TrimOptions, write,
};
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::trace::{ColourFormat, Compression, Trace, TraceWriter, WriteOptions, Written};

/// Write a trace anew: with checksums, packed, colours in another precision
#[derive(Debug, Args)]
#[command(mut_arg("compress", |compress| {
    compress.help("How its columns are stored, however they were before").default_value("none")
}))]
pub(super) struct ConvertArguments {
    /// The trace, of any program
    trace: PathBuf,
    #[command(flatten)]
    target: Target,
    /// Keep colours in half precision; how many that changes is told
    #[arg(long, conflicts_with = "float_colour")]
    half_colour: bool,
    /// Keep colours in single precision
    #[arg(long)]
    float_colour: bool,
    /// Which columns the header states, of those that have one value in all rows
    #[arg(long, default_value = "keep", value_parser = option::<Constants>())]
    constants: Constants,
}

/// Keep a part of a trace: a rectangle of the frame, the first samples, some primitives
#[derive(Debug, Args)]
pub(super) struct TrimArguments {
    /// The trace
    trace: PathBuf,
    #[command(flatten)]
    target: Target,
    /// A rectangle of pixels from column X and row Y on: the new frame
    #[arg(long, value_name = "X,Y,WxH", value_parser = area)]
    area: Option<Area>,
    /// Leave the frame as large as it is, with --area: designs draw randomness from a fragment's pixel, so
    /// that the part looks as it did in the whole
    #[arg(long, requires = "area")]
    keep_frame: bool,
    /// The first N samples of each pixel
    #[arg(long, value_name = "N", value_parser = samples, allow_negative_numbers = true)]
    samples: Option<u32>,
    /// Rows of the trace, from 0 on
    #[arg(long, value_name = "A-B", value_parser = range::<u64>)]
    rows: Option<RangeInclusive<u64>>,
    /// Primitives, by their numbers
    #[arg(long, value_name = "A-B", value_parser = range::<u32>)]
    primitives: Option<RangeInclusive<u32>>,
    /// Objects, by their numbers: draws, where a trace numbers them so
    #[arg(long, value_name = "A-B", value_parser = range::<u32>)]
    objects: Option<RangeInclusive<u32>>,
}

/// Put traces of one frame together, one after the other
#[derive(Debug, Args)]
pub(super) struct JoinArguments {
    /// The traces, in the order in which their fragments are to stand
    #[arg(required = true)]
    traces: Vec<PathBuf>,
    #[command(flatten)]
    target: Target,
    /// Keep the numbers of primitives and objects, where the traces are parts of one scene;
    /// else those of each come after those of the ones before
    #[arg(long)]
    keep_numbers: bool,
}

/// Put a trace's fragments in another order
#[derive(Debug, Args)]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that fragments may take that are held together; less takes more passes")
}))]
pub(super) struct ShuffleArguments {
    /// The trace
    trace: PathBuf,
    #[command(flatten)]
    target: Target,
    /// The order
    #[arg(long, default_value = "random", value_parser = option::<Sequence>())]
    order: Sequence,
    /// Which of the random orders
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true)]
    seed: u32,
    #[command(flatten)]
    memory: MemoryArgument,
}

/// Where the new trace goes.
#[derive(Debug, Args)]
pub(super) struct Target {
    /// The trace to write
    #[arg(long, short, value_name = "TRACE")]
    output: PathBuf,
    /// How its columns are stored; where not given, as those of the (first) trace are
    #[arg(long, value_parser = option::<Compression>())]
    compress: Option<Compression>,
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(Serialize)]
pub(super) struct Document<'a> {
    trace: String,
    from: Vec<&'a str>,
    width: u32,
    height: u32,
    samples: u32,
    /// Of the traces that it is made of, together.
    fragments_before: u64,
    fragments: u64,
    /// Fragments whose colours lost something.
    rounded: u64,
    bytes: u64,
    content: String,
    #[serde(skip)]
    written: Written,
}

impl Document<'_> {
    /// Says in a line what was written.
    pub fn print(&self, console: &Console) -> Result<()> {
        print_trace(&self.trace, &self.written, self.fragments_before, console)
    }
}

pub(super) fn run_convert(arguments: &ConvertArguments, console: &Console) -> Result<()> {
    let (traces, files) = arguments.target.begin(&[&arguments.trace], console)?;
    let options = ConvertOptions {
        colour: match (arguments.half_colour, arguments.float_colour) {
            (true, _) => Some(ColourFormat::F16),
            (_, true) => Some(ColourFormat::F32),
            _ => None,
        },
        constants: arguments.constants,
    };
    let progress = console.progress("looking at columns", "fragments");
    let convert = Convert::new(&traces[0], options, &mut |done, of| progress.set(done, of))?;
    drop(progress);
    files.save(&convert, &traces, console)
}

pub(super) fn run_trim(arguments: &TrimArguments, console: &Console) -> Result<()> {
    let TrimArguments { area, keep_frame, samples, .. } = *arguments;
    let (rows, primitives) = (arguments.rows.clone(), arguments.primitives.clone());
    let objects = arguments.objects.clone();
    let options = TrimOptions { area, keep_frame, samples, rows, primitives, objects };
    if options.is_all() {
        return Err(Error::config(
            "it is not said which part of the trace is kept",
            "give --area, --samples, --rows, --primitives or --objects",
        ));
    }
    let (traces, files) = arguments.target.begin(&[&arguments.trace], console)?;
    files.save(&Trim::new(&traces[0], options)?, &traces, console)
}

pub(super) fn run_join(arguments: &JoinArguments, console: &Console) -> Result<()> {
    let inputs: Vec<&Path> = arguments.traces.iter().map(|path| &**path).collect();
    let (traces, files) = arguments.target.begin(&inputs, console)?;
    let merge = Merge::new(&traces, MergeOptions { keep_numbers: arguments.keep_numbers })?;
    if merge.lost_view() {
        console.warn("the traces do not have one view, so the new one has none");
    }
    files.save(&merge, &traces, console)
}

pub(super) fn run_shuffle(arguments: &ShuffleArguments, console: &Console) -> Result<()> {
    let (traces, files) = arguments.target.begin(&[&arguments.trace], console)?;
    let ShuffleArguments { order, seed, .. } = *arguments;
    let options = ShuffleOptions { order, seed, memory: arguments.memory.bytes() };
    files.save(&Shuffle::new(&traces[0], options)?, &traces, console)
}

/// The files to write, begun.
pub(super) struct Files {
    compression: Compression,
    file: OutputFile,
    json: Option<Json>,
}

impl Target {
    /// Checks the files, opens the traces and begins what is written.
    pub fn begin(&self, inputs: &[&Path], console: &Console) -> Result<(Vec<Trace>, Files)> {
        let outputs: Vec<&Path> = [&*self.output].into_iter().chain(self.json.path()).collect();
        check(inputs, &outputs)?;
        check_output(&self.output, Kind::Trace)?;
        let open = |path: &&Path| open_trace(path, console);
        let traces = inputs.iter().map(open).collect::<Result<Vec<Trace>>>()?;
        let compression = match self.compress {
            Some(compression) => compression,
            None => traces[0].compression()?,
        };
        let file = OutputFile::create(&self.output)?;
        let json = self.json.open()?;
        Ok((traces, Files { compression, file, json }))
    }
}

impl Files {
    /// Writes the new trace, and says so.
    fn save(self, edit: &dyn Edit, traces: &[Trace], console: &Console) -> Result<()> {
        let (document, json) = self.write(edit, traces, console)?;
        report(json, "screendoor.edit", &document, console, || document.print(console))
    }

    /// Writes the new trace; what there is to say of it. What of the old ones no trace has is named.
    pub fn write<'a>(
        self,
        edit: &dyn Edit,
        traces: &'a [Trace],
        console: &Console,
    ) -> Result<(Document<'a>, Option<Json>)> {
        let Files { compression, file, json } = self;
        for trace in traces {
            let lost = trace.extra_columns().iter().map(|(name, _)| format!("column '{name}'"));
            let lost = lost.chain(trace.extra_metadata().map(|key| format!("entry '{key}'")));
            let lost: Vec<String> = lost.collect();
            if !lost.is_empty() {
                let (place, lost) = (trace.place(), lost.join(", "));
                console.warn(&format!("{place}: not in the new trace, as no trace has it: {lost}"));
            }
        }
        let header = edit.header();
        let place = file.path().display().to_string();
        let options = WriteOptions { compression, ..WriteOptions::default() };
        let mut writer = TraceWriter::new(file, &place, header.clone(), options)?;
        let progress = console.progress("writing", "fragments");
        write(edit, &mut writer, &mut |done, of| progress.set(done, of))?;
        drop(progress);
        let (file, written) = writer.finish()?;
        let before = traces.iter().map(Trace::rows).sum();
        if written.rows == 0 && before > 0 {
            console.warn("the new trace has no fragments");
        }
        let rounded = edit.rounded();
        if rounded > 0 {
            let rounded = grouped(rounded);
            console.warn(&format!("half precision rounds the colours of {rounded} fragments"));
        }
        keep_trace(file)?;
        let document = Document {
            trace: place,
            from: traces.iter().map(Trace::place).collect(),
            width: header.width,
            height: header.height,
            samples: header.pattern.samples(),
            fragments_before: before,
            fragments: written.rows,
            rounded,
            bytes: written.bytes,
            content: written.content.clone(),
            written,
        };
        Ok((document, json))
    }
}

/// Reads `X,Y,WIDTHxHEIGHT`.
fn area(text: &str) -> Result<Area, String> {
    let bad = || format!("'{text}' is no rectangle; write it as 100,50,320x240");
    let mut parts = text.splitn(3, ',');
    let mut origin = || parts.next()?.trim().parse().ok();
    let origin = origin().zip(origin()).ok_or_else(bad)?;
    let (width, height) = size(parts.next().ok_or_else(bad)?.trim()).map_err(|_| bad())?;
    Ok(Area { origin: origin.into(), size: [width, height] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles() {
        let expected = Area { origin: [3, 4], size: [50, 60] };
        assert_eq!(area("3, 4,50x60"), Ok(expected));
        for bad in ["", "3,4", "3,4,50", "3,50x60", "-1,0,5x5", "0,0,0x5", "1,2,3x4,5"] {
            assert!(area(bad).is_err(), "{bad}");
        }
    }
}
