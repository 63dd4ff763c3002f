//! What `benches/gpu.sh` measures beside `screendoor throughput`: a device's peaks; and its table.
//!
//! `-- peaks FILE [--adapter NAME]` measures, `-- designs` names those that have a port, `-- table
//! FOLDER OUT` writes `OUT.json` and `OUT.md` of what the script has left in a folder. With `--test` peaks are measured for a moment.

mod peaks;
mod table;

use std::fs;
use std::process::ExitCode;

use screendoor::design::DESIGNS;
use screendoor::gpu::Gpu;

fn main() -> ExitCode {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let given: Vec<&str> = given.iter().map(String::as_str).collect();
    let done = match given[..] {
        ["peaks", file] => write_peaks(file, None),
        ["peaks", file, "--adapter", name] => write_peaks(file, Some(name)),
        ["table", folder, out] => table::write(folder.as_ref(), out),
        ["designs"] => {
            print_designs();
            Ok(())
        }
        ["--test"] => try_peaks(),
        // As `cargo bench` runs it.
        [] => {
            println!("benches/gpu.sh measures GPUs");
            Ok(())
        }
        _ => Err("say 'peaks FILE', 'designs' or 'table FOLDER OUT'".to_string()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}

fn write_peaks(file: &str, adapter: Option<&str>) -> Result<(), String> {
    let peaks = peaks::measure(adapter, true)?;
    println!("{}", peaks.adapter);
    let text = serde_json::to_string_pretty(&peaks).expect("it is only numbers");
    fs::write(file, text).map_err(|e| format!("{file}: {e}"))
}

/// The designs that have a port, as `throughput` takes them.
fn print_designs() {
    let ported = DESIGNS.iter().filter(|entry| entry.is_ported());
    let names: Vec<_> = ported.map(|entry| entry.info.name).collect();
    println!("{}", names.join(","));
}

/// That the kernels compile and run; a machine without a GPU has nothing to try.
fn try_peaks() -> Result<(), String> {
    if Gpu::adapters().is_empty() {
        println!("no adapter: no peaks");
        return Ok(());
    }
    let peaks = peaks::measure(None, false)?;
    assert!(peaks.copy > 0.0 && peaks.xor_add.is_finite());
    Ok(())
}
