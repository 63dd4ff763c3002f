//! Whether two versions of the program give the same bytes: traces of all built-in scenes, and
//! what a study of all designs on them finds, its pictures with it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use serde_json::Value;

use crate::process::{Result, call};

/// Compare what two versions of the program give, byte for byte
#[derive(Args)]
pub(crate) struct Arguments {
    /// A commit, which is built in a worktree of its own, or the path of a program
    before: String,
    /// The same of what is held against it
    after: String,
    /// Measure the default study, too, as it is and on all its scenes: minutes
    #[arg(long)]
    default_study: bool,
}

/// What of a record depends on the machine and the moment.
const TIMES: &str = "speed";

pub(crate) fn run(arguments: &Arguments) -> Result<bool> {
    let folder = tempfile::tempdir()?;
    let sides = [("before", &arguments.before), ("after", &arguments.after)];
    let mut found = Vec::new();
    for (side, version) in sides {
        let program = program(version)?;
        let of_side = folder.path().join(side);
        fs::create_dir(&of_side)?;
        found.push(Outcome::of(&program, &of_side, arguments.default_study)?);
    }
    let [before, after] = &found[..] else { unreachable!("there are two sides") };
    Ok(compare(before, after))
}

/// The program of a version, built if it is a commit.
fn program(version: &str) -> Result<PathBuf> {
    let path = Path::new(version);
    if path.is_file() {
        return Ok(path.canonicalize()?);
    }
    let tree = std::env::current_dir()?.join("target/same").join(version);
    if !tree.exists() {
        let add = ["worktree", "add", "--quiet", "--detach"];
        call(Command::new("git").args(add).arg(&tree).arg(version))?;
    }
    let build = ["build", "--locked", "--release", "--bin", "screendoor"];
    call(Command::new("cargo").args(build).current_dir(&tree))?;
    Ok(tree.join("target/release/screendoor"))
}

/// What a version gives: files by their names, and records by theirs.
#[derive(Default)]
struct Outcome {
    files: BTreeMap<String, Vec<u8>>,
    records: BTreeMap<String, Value>,
}

impl Outcome {
    fn of(program: &Path, folder: &Path, default_study: bool) -> Result<Self> {
        let mut outcome = Outcome::default();
        let names = |command: &str| -> Result<Vec<String>> {
            let text = call(Command::new(program).args([command, "--json", "-"]))?;
            let json: Value = serde_json::from_slice(&text)?;
            let list = json.as_array().or_else(|| json[command].as_array());
            let list = list.ok_or_else(|| format!("'{command} --json -' gives no list"))?;
            let name = |entry: &Value| {
                let name = entry.get("name").or_else(|| entry["info"].get("name"));
                name.and_then(Value::as_str).map(str::to_string)
            };
            Ok(list.iter().filter_map(name).collect())
        };
        let (scenes, designs) = (names("scenes")?, names("designs")?);
        if scenes.is_empty() || designs.is_empty() {
            return Err("a program without scenes or designs".into());
        }
        let mut study = format!(
            "name = \"same\"\ndescription = \"Two versions.\"\ndesigns = {designs:?}\n\
             samples = [1, 4, 8, 64]\nseeds = 2\ntiming = 0\nbaseline = \"lk\"\n"
        );
        for scene in &scenes {
            let trace = folder.join(format!("{scene}.arrow"));
            let source = format!("builtin:{scene}");
            let size = ["--size", "96x80", "--order", "random", "--quiet"];
            let capture = ["capture", source.as_str(), "-o"];
            call(Command::new(program).args(capture).arg(&trace).args(size))?;
            outcome.files.insert(format!("{scene}.arrow"), fs::read(&trace)?);
            study += &format!(
                "\n[[scene]]\nname = \"{scene}\"\nsource = \"{source}\"\nsize = [96, 80]\n"
            );
        }
        let plan = folder.join("same.toml");
        fs::write(&plan, study)?;
        let result = folder.join("study");
        call(Command::new(program).args(["study", "--quiet"]).arg(&plan).arg("-o").arg(&result))?;
        outcome.take("study", &result)?;
        if default_study {
            let result = folder.join("default");
            call(Command::new(program).args(["report", "--quiet", "-o"]).arg(&result))?;
            outcome.take("default", &result)?;
        }
        Ok(outcome)
    }

    /// The records and pictures in a study's folder.
    fn take(&mut self, name: &str, folder: &Path) -> Result<()> {
        for line in fs::read_to_string(folder.join("results.jsonl"))?.lines() {
            let mut record: Value = serde_json::from_str(line)?;
            if let Some(fields) = record.as_object_mut() {
                fields.remove(TIMES);
            }
            let id = record["id"].as_str().ok_or("a record without a name")?.to_string();
            self.records.insert(format!("{name}/{id}"), record);
        }
        let mut pictures = vec![folder.join("pictures")];
        while let Some(path) = pictures.pop() {
            if path.is_dir() {
                for entry in fs::read_dir(&path)? {
                    pictures.push(entry?.path());
                }
            } else {
                let relative = path.strip_prefix(folder)?.display().to_string();
                self.files.insert(format!("{name}/{relative}"), fs::read(&path)?);
            }
        }
        Ok(())
    }
}

/// Prints where two versions differ; whether they do not.
fn compare(before: &Outcome, after: &Outcome) -> bool {
    let files: BTreeSet<&String> = before.files.keys().chain(after.files.keys()).collect();
    let other: Vec<_> =
        files.iter().filter(|n| before.files.get(**n) != after.files.get(**n)).collect();
    println!("{} files, traces and pictures: {} differ", files.len(), other.len());
    other.iter().for_each(|name| println!("  {name}"));

    let ids: BTreeSet<&String> = before.records.keys().chain(after.records.keys()).collect();
    let mut differing = 0;
    let mut of_one = BTreeSet::new();
    for id in &ids {
        let (Some(a), Some(b)) = (before.records.get(*id), after.records.get(*id)) else {
            println!("  {id}: only one has it");
            differing += 1;
            continue;
        };
        let keys = |record: &Value| -> BTreeSet<String> {
            record.as_object().into_iter().flatten().map(|(key, _)| key.clone()).collect()
        };
        of_one.extend(keys(a).symmetric_difference(&keys(b)).cloned());
        let wrong: Vec<_> = keys(a)
            .intersection(&keys(b))
            .filter(|k| a[k.as_str()] != b[k.as_str()])
            .cloned()
            .collect();
        if !wrong.is_empty() {
            println!("  {id}: {}", wrong.join(", "));
            differing += 1;
        }
    }
    println!("{} records: {differing} differ", ids.len());
    if !of_one.is_empty() {
        println!("fields that only one has: {}", Vec::from_iter(of_one).join(", "));
    }
    other.is_empty() && differing == 0
}
