//! `screendoor scenes`.

use clap::Args;

use crate::capture::{
    LIGHTS, Model, OPACITY_MODELS, RULE_SETS, RuleSet, SCREEN_DOORS, SPLAT_PARAMS,
};
use crate::cli::console::Console;
use crate::cli::designs::print_params;
use crate::cli::files::{JsonArgument, report};
use crate::error::Result;
use crate::param::Param;
use crate::scene::builtin::{BUILTINS, Builtin};

/// List the built-in scenes and their parameters, the rules by which splats are drawn, lights, models of opacity and screen doors
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(serde::Serialize)]
struct List<'a> {
    scenes: &'a [Document],
    splat_rules: &'a [Rules],
    splat_parameters: &'a [Param],
    lights: &'a [Document],
    opacity_models: &'a [Document],
    screen_doors: &'a [Document],
}

#[derive(serde::Serialize)]
struct Rules {
    name: &'static str,
    help: &'static str,
    settings: std::collections::BTreeMap<&'static str, &'static str>,
}

#[derive(serde::Serialize)]
struct Document {
    name: &'static str,
    summary: &'static str,
    params: &'static [Param],
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let json = arguments.json.open()?;
    let document = |s: &Builtin| Document { name: s.name, summary: s.summary, params: s.params };
    let documents: Vec<Document> = BUILTINS.iter().map(document).collect();
    let rules = RULE_SETS.map(|set| Rules {
        name: set.name,
        help: set.help,
        settings: set.settings.iter().copied().collect(),
    });
    let document = |m: Model| Document { name: m.name, summary: m.help, params: m.params };
    let (lights, models) = (LIGHTS.map(document), OPACITY_MODELS.map(document));
    let doors = SCREEN_DOORS.map(document);
    let list = List {
        scenes: &documents,
        splat_rules: &rules,
        splat_parameters: &SPLAT_PARAMS,
        lights: &lights,
        opacity_models: &models,
        screen_doors: &doors,
    };
    report(json, "screendoor.scenes", &list, console, || {
        for scene in BUILTINS {
            console.print(format_args!("builtin:{}\n  {}", scene.name, scene.summary))?;
            print_params(scene.params, console)?;
        }
        console.print(format_args!("capture --splat-rules NAME"))?;
        for RuleSet { name, help, settings } in RULE_SETS {
            let set: Vec<String> = settings.iter().map(|(k, v)| format!("{k}={v}")).collect();
            let set = if set.is_empty() { String::new() } else { format!(" ({})", set.join(", ")) };
            console.print(format_args!("  {name}: {help}{set}"))?;
        }
        print_params(&SPLAT_PARAMS, console)?;
        let options =
            [("light", &LIGHTS[..]), ("opacity", &OPACITY_MODELS), ("screen-door", &SCREEN_DOORS)];
        for (option, models) in options {
            console.print(format_args!("capture --{option} NAME"))?;
            for Model { name, help, params } in models {
                console.print(format_args!("  {name}: {help}"))?;
                print_params(params, console)?;
            }
        }
        Ok(())
    })
}
