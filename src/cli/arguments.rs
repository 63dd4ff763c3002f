//! Arguments that several commands share, and how they are read.

use std::ffi::OsStr;
use std::fmt::Display;
use std::marker::PhantomData;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::builder::{PossibleValue, Resettable, StringValueParser, TypedValueParser};
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};

use crate::cli::console::Console;
use crate::cli::files::open_trace;
use crate::design::{Configured, configure};
use crate::error::{Error, Result};
use crate::param::{Choice, Options, parse_setting};
use crate::scene;
use crate::study::engine::EngineName;
use crate::trace::{SamplePattern, Trace};

/// A parser for names of a list, of which a wrong one is told the nearest.
#[derive(Clone)]
struct Named<T>(Vec<(Choice, T)>);

impl<T: Copy + Send + Sync + 'static> TypedValueParser for Named<T> {
    type Value = T;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &OsStr,
    ) -> Result<T, clap::Error> {
        let list = self.0.clone();
        let find = move |name: String| {
            let found = list.iter().find(|(choice, _)| choice.name == name);
            let known = list.iter().map(|(choice, _)| choice.name);
            found.map(|(_, value)| *value).ok_or_else(|| {
                let error = Error::unknown("name", &name, known.clone());
                format!("{error} [possible values: {}]", known.collect::<Vec<_>>().join(", "))
            })
        };
        StringValueParser::new().try_map(find).parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(self.0.iter().map(|(c, _)| PossibleValue::new(c.name).help(c.help))))
    }
}

/// A parser for an enumeration of [`Options`]: the names and helps are its own.
pub(super) fn option<C: Options + Send + Sync>() -> impl TypedValueParser<Value = C> {
    Named(C::CHOICES.iter().copied().zip(C::ALL.iter().copied()).collect())
}

/// A parser for an engine's name.
pub(super) fn engine_name() -> impl TypedValueParser<Value = EngineName> {
    Named(EngineName::all().map(|(name, choice)| (choice, name)).collect())
}

/// The designs of a list such as `lk,slab:layers=4,bits=8,enderton`: what is a setting and
/// names no design belongs to the one before.
pub(super) fn design_list(text: &str) -> Result<Vec<Configured>> {
    let mut specs: Vec<String> = Vec::new();
    for part in text.split(',') {
        match specs.last_mut() {
            Some(spec) if part.contains('=') && !part.contains(':') => {
                spec.push(if spec.contains(':') { ',' } else { ':' });
                spec.push_str(part);
            }
            _ => specs.push(part.to_string()),
        }
    }
    specs.iter().map(|spec| configure(spec, &[])).collect()
}

/// Reads `WIDTHxHEIGHT`.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let bad = || format!("'{text}' is no size; write it as 800x600, each side 1 to 65536");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(bad)?;
    let side = |text: &str| {
        text.parse().ok().filter(|s| (1..=crate::trace::MAX_SIDE).contains(s)).ok_or_else(bad)
    };
    Ok((side(width)?, side(height)?))
}

/// Reads a sample count.
pub(super) fn samples(text: &str) -> Result<u32, String> {
    let count = text.parse().ok().filter(|n| SamplePattern::is_count(*n));
    count.ok_or_else(|| format!("'{text}' is no sample count; it is 1, 2, 4, 8, 16, 32 or 64"))
}

/// Reads `N` numbers separated by commas.
pub(super) fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|t| t.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| format!("'{text}' is not {N} numbers separated by commas"))
}

/// Reads `A-B`, both included, or `A` alone.
pub(super) fn range<T: FromStr + PartialOrd + Clone + Display>(
    text: &str,
) -> Result<RangeInclusive<T>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let number = |text: &str| text.trim().parse::<T>().ok();
    let ends = number(first).zip(number(last)).filter(|(first, last)| first <= last);
    let (first, last) =
        ends.ok_or_else(|| format!("'{text}' is no range of numbers; write it as 10-19"))?;
    Ok(first..=last)
}

/// `count` seeds from `first` on.
///
/// # Errors
/// [`Error::Config`] where there are not so many left.
pub(super) fn seeds(first: u32, count: u32) -> Result<RangeInclusive<u32>> {
    match first.checked_add(count.saturating_sub(1)) {
        Some(last) => Ok(first..=last),
        None => Err(Error::config(
            format_args!("there are no {count} seeds from {first} on: the last is {}", u32::MAX),
            "give fewer seeds or a lower one",
        )),
    }
}

/// Reads a linear colour that a trace can hold.
pub(super) fn colour(text: &str) -> Result<[f64; 3], String> {
    let colour = numbers::<3>(text)?;
    let holds = colour.iter().all(|c| (0.0..=65504.0).contains(c));
    holds.then_some(colour).ok_or_else(|| {
        format!("'{text}' is no colour; each channel is 0 to 65504, the range of half precision")
    })
}

/// The name of a scene as text, and its path where it is a file.
pub(super) fn scene(name: &OsStr) -> Result<(&str, Option<&Path>)> {
    let Some(text) = name.to_str() else {
        return Err(Error::config(
            format_args!("the scene's name {} is not UTF-8", name.display()),
            "rename the file or its folder",
        ));
    };
    Ok((text, scene::path_of(text)))
}

/// Arguments of which each is changed in the same way.
#[derive(Debug)]
pub(super) struct Each<A, C> {
    /// What was given.
    pub given: A,
    change: PhantomData<C>,
}

/// How arguments are changed.
pub(super) trait Change {
    /// The argument, changed.
    fn change(argument: Arg) -> Arg;
}

impl<A: FromArgMatches, C> FromArgMatches for Each<A, C> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Each { given: A::from_arg_matches(matches)?, change: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.given.update_from_arg_matches(matches)
    }
}

impl<A: Args, C: Change> Args for Each<A, C> {
    fn augment_args(command: Command) -> Command {
        let own = A::augment_args(Command::new("own"));
        own.get_arguments().fold(command, |command, arg| {
            // In the order in which they are added here.
            command.arg(C::change(arg.clone()).display_order(Resettable::Reset))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

/// What a command may take for what grows with a trace. What that is there, each command says as
/// the argument's help.
#[derive(Debug, Args)]
pub(super) struct MemoryArgument {
    #[arg(long, default_value_t = 512, value_name = "MIB", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    memory: u64,
}

impl MemoryArgument {
    /// In bytes.
    pub fn bytes(&self) -> u64 {
        self.memory << 20
    }
}

fn setting(text: &str) -> Result<(String, String), String> {
    parse_setting(text).map_err(|e| e.to_string())
}

/// Which design, with which parameters.
#[derive(Debug, Args)]
struct DesignArguments {
    /// The design: NAME, or NAME:parameter=value,… ('screendoor designs' lists them)
    #[arg(long, short, default_value = "lk", value_name = "DESIGN")]
    design: String,
    /// Sets one of the design's parameters; can be given several times
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
}

impl DesignArguments {
    fn configure(&self) -> Result<Configured> {
        configure(&self.design, &self.set)
    }
}

/// What is replayed: a trace, a design, a sample count, a seed.
#[derive(Debug, Args)]
pub(super) struct RunArguments {
    /// The trace
    trace: PathBuf,
    #[command(flatten)]
    design: DesignArguments,
    /// Samples per pixel; the trace's own count where not given
    #[arg(long, value_name = "N", value_parser = samples, allow_negative_numbers = true)]
    samples: Option<u32>,
    /// The run's seed: one seed names one picture
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true)]
    pub seed: u32,
}

impl RunArguments {
    /// The trace's path.
    pub fn path(&self) -> &Path {
        &self.trace
    }

    /// The design, the open trace, and the sample count, each checked.
    pub fn open(&self, console: &Console) -> Result<(Configured, Trace, u32)> {
        // Before the trace is opened, which may take a while.
        self.design.configure()?;
        let trace = open_trace(&self.trace, console)?;
        let (design, samples) = self.of(&trace)?;
        Ok((design, trace, samples))
    }

    /// The design and the sample count on an open trace, each checked.
    pub fn of(&self, trace: &Trace) -> Result<(Configured, u32)> {
        let pattern = &trace.header().pattern;
        let samples = self.samples.unwrap_or(pattern.samples());
        pattern.prefix(samples)?;
        Ok((self.design.configure()?, samples))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_belong_to_the_design_before() {
        let list = design_list("lk,slab:layers=4,bits=8,enderton:mask=naive").unwrap();
        let labels: Vec<String> = list.iter().map(Configured::label).collect();
        assert_eq!(labels, ["lk", "slab:layers=4,bits=8", "enderton:mask=naive"]);
        assert!(design_list("lk,nothing").is_err());
    }

    #[test]
    fn ranges() {
        assert_eq!(range::<u32>("10-19"), Ok(10..=19));
        assert_eq!(range::<u64>("7"), Ok(7..=7));
        for bad in ["", "-", "9-8", "-1", "1-", "a-b", "0-4294967296"] {
            assert!(range::<u32>(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_and_numbers() {
        assert_eq!(size("800x600"), Ok((800, 600)));
        for bad in ["", "800", "0x5", "70000x1", "axb", "-1x5", "1e3x5"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(numbers::<2>("30, -20.5"), Ok([30.0, -20.5]));
        assert!(numbers::<2>("30").is_err() && numbers::<2>("nan,1").is_err());
        assert!(colour("0,1,65504").is_ok());
        assert!(colour("1e38,0,0").is_err() && colour("-1,0,0").is_err());
        assert_eq!(samples("64"), Ok(64));
        assert!(samples("0").is_err() && samples("128").is_err());
    }
}
