//! `screendoor designs`.

use clap::Args;

use crate::cli::console::Console;
use crate::cli::files::{JsonArgument, report};
use crate::design::{DESIGNS, Entry};
use crate::error::Result;
use crate::param::{Kind, Options as _, Param};
use crate::rop::{Family, Info, Promises};

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
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let json = arguments.json.open()?;
    let document = |entry: &Entry| -> Result<Document> {
        let promises = entry.configure(&[])?.promises();
        Ok(Document { info: entry.info, promises, gpu: entry.is_ported() })
    };
    let documents = DESIGNS.iter().map(document).collect::<Result<Vec<_>>>()?;
    let list = List { designs: &documents };
    report(json, "screendoor.designs", &list, console, || print(&documents, console))
}

fn print(documents: &[Document], console: &Console) -> Result<()> {
    for (family, about) in Family::ALL.iter().zip(Family::CHOICES) {
        console.print(format_args!("{}: {}\n", about.name, about.help))?;
        for Document { info, promises, gpu } in
            documents.iter().filter(|d| d.info.family == *family)
        {
            console
                .print(format_args!("{}\n  {}\n  {}", info.name, info.summary, info.citation))?;
            let port = gpu.then(|| "runs on GPUs too".to_string());
            let words: Vec<String> = promises.words().into_iter().chain(port).collect();
            console.print(format_args!("  {}", words.join(", ")))?;
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
