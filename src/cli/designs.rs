//! `screendoor designs`.

use std::sync::Arc;

use clap::Args;

use crate::cli::console::Console;
use crate::cli::files::{JsonArgument, report};
use crate::design::{Configured, DESIGNS, Entry};
use crate::error::Result;
use crate::param::{Kind, Options as _, Param};
use crate::rop::{Family, Frame, Implementation, Info, Layout, Promises, StateBits};
use crate::tile::TileGrid;

/// List the designs with their citations and parameters
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(serde::Serialize)]
struct List<'a> {
    designs: &'a [Document],
}

#[derive(serde::Serialize)]
struct Document {
    #[serde(flatten)]
    info: Info,
    /// With default parameters.
    promises: Promises,
    /// Whether `replay --engine gpu` can run it.
    gpu: bool,
    /// What it costs at [`SAMPLES`] samples of 16-bit colours, with default parameters.
    needs: Needs,
    /// The same on a scene with opaque fragments, where that is more.
    needs_with_opaque: Option<Needs>,
}

/// What a design takes.
#[derive(PartialEq, serde::Serialize)]
struct Needs {
    samples: u32,
    passes: u32,
    state_bits: StateBits,
    layout: Layout,
}

/// Samples for which the listing says what a pixel takes.
const SAMPLES: u32 = 8;

impl Needs {
    fn of(design: &Configured, opaque: bool) -> Result<Self> {
        let frame = Frame {
            grid: TileGrid::new(1, 1),
            positions: [[0; 2]; SAMPLES as usize].into(),
            background: [0.0; 3],
            space: Default::default(),
            seed: 0,
            colour_bits: 48,
            view: None,
            opaque,
            primitive_depths: Some(Arc::default()),
            columns: Default::default(),
        };
        let engine = design.build(&frame, Implementation::Reference)?;
        let (state_bits, layout) = (engine.state_bits(), engine.layout());
        Ok(Needs { samples: SAMPLES, passes: engine.passes(), state_bits, layout })
    }

    fn words(&self) -> String {
        let passes = if self.passes == 1 { "pass" } else { "passes" };
        let bytes = match self.state_bits.unbounded {
            true => "grows".to_string(),
            false => format!("{} B", self.state_bits.total().div_ceil(8)),
        };
        format!("{bytes}, {} {passes}", self.passes)
    }
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let json = arguments.json.open()?;
    let document = |entry: &Entry| -> Result<Document> {
        let design = entry.configure(&[])?;
        let (needs, most) = (Needs::of(&design, false)?, Needs::of(&design, true)?);
        Ok(Document {
            info: entry.info,
            promises: design.promises(),
            gpu: entry.is_ported(),
            needs_with_opaque: (most != needs).then_some(most),
            needs,
        })
    };
    let documents = DESIGNS.iter().map(document).collect::<Result<Vec<_>>>()?;
    let list = List { designs: &documents };
    report(json, "screendoor.designs", &list, console, || print(&documents, console))
}

fn print(documents: &[Document], console: &Console) -> Result<()> {
    for (family, about) in Family::ALL.iter().zip(Family::CHOICES) {
        console.print(format_args!("{}: {}\n", about.name, about.help))?;
        for Document { info, promises, gpu, needs, needs_with_opaque } in
            documents.iter().filter(|d| d.info.family == *family)
        {
            console
                .print(format_args!("{}\n  {}\n  {}", info.name, info.summary, info.citation))?;
            let port = gpu.then(|| "runs on GPUs too".to_string());
            let words: Vec<String> = promises.words().into_iter().chain(port).collect();
            console.print(format_args!("  {}", words.join(", ")))?;
            let more = needs_with_opaque.as_ref().map(|n| format!("; {} with opaque", n.words()));
            let (few, more) = (needs.words(), more.unwrap_or_default());
            let shown = needs_with_opaque.as_ref().unwrap_or(needs);
            console.print(format_args!("  {few}{more}, at {SAMPLES} samples: {}", shown.layout))?;
            print_params(info.params, console)?;
        }
        console.print(format_args!(""))?;
    }
    Ok(())
}

/// Prints parameters with their values, defaults and helps.
pub(super) fn print_params(params: &[Param], console: &Console) -> Result<()> {
    for param in params {
        console.print(format_args!("    {}={}  {}", param.name, param.default, param.help))?;
        match param.kind {
            Kind::Choice { options } => {
                for option in options {
                    console.print(format_args!("        {:<16} {}", option.name, option.help))?;
                }
            }
            _ => console.print(format_args!("        {}", param.values()))?,
        }
    }
    Ok(())
}
