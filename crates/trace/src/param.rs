//! Parameters, declared once: name, default, range and help.
//!
//! A design or a built-in scene holds a constant slice of [`Param`]s. The
//! command line, the help, the reports and the resolved values all read that
//! declaration; nothing repeats it.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

#[doc(hidden)]
pub use serde;
use serde::Serialize;

use crate::error::{Error, Result};

/// One parameter of a design or of a built-in scene. Written with its default as a value of
/// its kind, not as text.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Its name, as in `--set name=value`.
    pub name: &'static str,
    /// Its value where none is given, as it would be written.
    pub default: &'static str,
    /// What values it takes.
    pub kind: Kind,
    /// One line for the reader of a listing.
    pub help: &'static str,
}

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "kebab-case", tag = "type")]
pub enum Kind {
    /// `true` or `false`.
    Flag,
    /// One of a few names.
    Choice {
        /// The names.
        options: &'static [Choice],
    },
    /// A whole number within bounds, both included.
    Integer {
        /// The least value.
        min: i64,
        /// The greatest value.
        max: i64,
    },
    /// A number within bounds, both included.
    Real {
        /// The least value.
        min: f64,
        /// The greatest value.
        max: f64,
    },
}

/// One option of a [`Kind::Choice`].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Choice {
    /// Its name.
    pub name: &'static str,
    /// What it stands for, in a line.
    pub help: &'static str,
}

impl Param {
    /// The values it takes, for a listing: `true|false`, `a|b|c`, `1..16`.
    pub fn values(&self) -> String {
        match self.kind {
            Kind::Flag => "true|false".to_string(),
            Kind::Choice { options } => {
                options.iter().map(|c| c.name).collect::<Vec<_>>().join("|")
            }
            Kind::Integer { min, max } => format!("{min}..{max}"),
            Kind::Real { min, max } => format!("{min}..{max}"),
        }
    }

    fn parse(&self, text: &str, owner: &str) -> Result<Value> {
        let bad = || {
            Error::config(
                format_args!("{owner}: '{text}' is not a value of parameter '{}'", self.name),
                format_args!("it takes {}", self.values()),
            )
        };
        match self.kind {
            Kind::Flag => text.parse().map(Value::Flag).map_err(|_| bad()),
            Kind::Choice { options } => options
                .iter()
                .position(|c| c.name == text)
                .map(|index| Value::Choice { index, name: options[index].name })
                .ok_or_else(|| {
                    let kind = format!("value of {owner}'s parameter '{}':", self.name);
                    Error::unknown(&kind, text, options.iter().map(|c| c.name))
                }),
            Kind::Integer { min, max } => match text.parse::<i64>() {
                Ok(v) if (min..=max).contains(&v) => Ok(Value::Integer(v)),
                _ => Err(bad()),
            },
            Kind::Real { min, max } => match text.parse::<f64>() {
                Ok(v) if (min..=max).contains(&v) => Ok(Value::Real(v)),
                _ => Err(bad()),
            },
        }
    }
}

/// A parameter whose values are of the type `T`, as [`Values::get`] tells them.
#[derive(Clone, Copy, Debug)]
pub struct Typed<T> {
    /// Its declaration.
    pub param: Param,
    values: PhantomData<fn() -> T>,
}

impl<T> Typed<T> {
    const fn of(param: Param) -> Self {
        Typed { param, values: PhantomData }
    }
}

impl Typed<bool> {
    /// A `true`/`false` parameter.
    pub const fn flag(name: &'static str, default: bool, help: &'static str) -> Self {
        Typed::of(Param {
            name,
            default: if default { "true" } else { "false" },
            kind: Kind::Flag,
            help,
        })
    }
}

impl<C: Options> Typed<C> {
    /// A parameter whose options are those of the enumeration `C`.
    pub const fn choice(name: &'static str, default: &'static str, help: &'static str) -> Self {
        Typed::of(Param { name, default, kind: Kind::Choice { options: C::CHOICES }, help })
    }
}

impl Typed<i64> {
    /// A whole number in `min..=max`; `default` is written as text so that the
    /// declaration reads as the command line does.
    pub const fn integer(
        name: &'static str,
        default: &'static str,
        (min, max): (i64, i64),
        help: &'static str,
    ) -> Self {
        Typed::of(Param { name, default, kind: Kind::Integer { min, max }, help })
    }
}

impl Typed<f64> {
    /// A number in `min..=max`.
    pub const fn real(
        name: &'static str,
        default: &'static str,
        (min, max): (f64, f64),
        help: &'static str,
    ) -> Self {
        Typed::of(Param { name, default, kind: Kind::Real { min, max }, help })
    }
}

/// A type that values of parameters can have.
pub trait Read: Sized {
    /// The value, where it is of this type.
    fn read(value: Value) -> Option<Self>;
}

impl Read for bool {
    fn read(value: Value) -> Option<Self> {
        if let Value::Flag(v) = value { Some(v) } else { None }
    }
}

impl Read for i64 {
    fn read(value: Value) -> Option<Self> {
        if let Value::Integer(v) = value { Some(v) } else { None }
    }
}

impl Read for f64 {
    fn read(value: Value) -> Option<Self> {
        if let Value::Real(v) = value { Some(v) } else { None }
    }
}

impl<C: Options> Read for C {
    fn read(value: Value) -> Option<Self> {
        if let Value::Choice { index, .. } = value { C::ALL.get(index).copied() } else { None }
    }
}

/// An enumeration that can be the value of a parameter; made by
/// [`options!`](crate::options).
pub trait Options: Copy + 'static {
    /// The names and helps, in the order of [`Options::ALL`].
    const CHOICES: &'static [Choice];
    /// The values.
    const ALL: &'static [Self];

    /// The value's name.
    fn name(self) -> &'static str
    where
        Self: PartialEq,
    {
        let named = Self::ALL.iter().zip(Self::CHOICES).find(|(value, _)| **value == self);
        named.map_or("", |(_, choice)| choice.name)
    }
}

/// Declares an enumeration whose variants can be named on the command line:
/// each variant stands beside its name and its help.
#[macro_export]
macro_rules! options {
    ($(#[$meta:meta])* $vis:vis enum $name:ident {
        $($(#[$on:meta])* $variant:ident = $text:literal : $help:literal),+ $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $name { $(#[doc = $help] $(#[$on])* $variant),+ }

        impl $crate::param::Options for $name {
            const CHOICES: &'static [$crate::param::Choice] =
                &[$($crate::param::Choice { name: $text, help: $help }),+];
            const ALL: &'static [Self] = &[$($name::$variant),+];
        }

        impl $crate::param::serde::Serialize for $name {
            fn serialize<S: $crate::param::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(match self { $($name::$variant => $text),+ })
            }
        }

        impl<'de> $crate::param::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::param::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                match <String as $crate::param::serde::Deserialize>::deserialize(deserializer)?.as_str() {
                    $($text => Ok($name::$variant),)+
                    other => Err(<D::Error as $crate::param::serde::de::Error>::unknown_variant(other, &[$($text),+])),
                }
            }
        }
    };
}

impl Serialize for Param {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Shown<'a> {
            name: &'a str,
            default: Value,
            #[serde(flatten)]
            kind: &'a Kind,
            help: &'a str,
        }
        let default = self.parse(self.default, self.name).map_err(serde::ser::Error::custom)?;
        Shown { name: self.name, default, kind: &self.kind, help: self.help }.serialize(serializer)
    }
}

/// The value of a parameter. Written as what it is: a number, true or false, or a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Of a [`Kind::Flag`].
    Flag(bool),
    /// Of a [`Kind::Choice`].
    Choice {
        /// The option's place in its enumeration.
        index: usize,
        /// The option's name.
        name: &'static str,
    },
    /// Of a [`Kind::Integer`].
    Integer(i64),
    /// Of a [`Kind::Real`].
    Real(f64),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Flag(v) => v.fmt(f),
            Value::Choice { name, .. } => f.write_str(name),
            Value::Integer(v) => v.fmt(f),
            Value::Real(v) => v.fmt(f),
        }
    }
}

impl Serialize for Value {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Flag(v) => serializer.serialize_bool(*v),
            // Some choices are between numbers.
            Value::Choice { name, .. } => match name.parse::<i64>() {
                Ok(number) => serializer.serialize_i64(number),
                Err(_) => serializer.serialize_str(name),
            },
            Value::Integer(v) => serializer.serialize_i64(*v),
            Value::Real(v) => serializer.serialize_f64(*v),
        }
    }
}

/// A value for every parameter of one owner.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    owner: String,
    values: BTreeMap<&'static str, Value>,
}

impl Values {
    /// The defaults of `params` with the `given` settings over them.
    ///
    /// # Errors
    /// [`Error::Config`] for a name that is not among `params`, a value that
    /// the parameter does not take, or a name given twice.
    pub fn resolve(
        owner: &str,
        params: &'static [Param],
        given: &[(String, String)],
    ) -> Result<Self> {
        let mut values = BTreeMap::new();
        for param in params {
            values.insert(param.name, param.parse(param.default, owner)?);
        }
        for (i, (name, text)) in given.iter().enumerate() {
            let Some(param) = params.iter().find(|p| p.name == name) else {
                let kind = format!("parameter of {owner}:");
                return Err(Error::unknown(&kind, name, params.iter().map(|p| p.name)));
            };
            if given[..i].iter().any(|(earlier, _)| earlier == name) {
                return Err(Error::config(
                    format_args!("{owner}: parameter '{name}' is set twice"),
                    "set it once",
                ));
            }
            values.insert(param.name, param.parse(text, owner)?);
        }
        Ok(Values { owner: owner.to_string(), values })
    }

    /// Names and values, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, Value)> + '_ {
        self.values.iter().map(|(k, v)| (*k, *v))
    }

    /// The settings that differ from the defaults of `params`, as `a=1,b=2`;
    /// empty where none does.
    pub fn changes(&self, params: &'static [Param]) -> String {
        params
            .iter()
            .filter_map(|p| self.values.get(p.name).map(|v| (p, v.to_string())))
            .filter(|(p, v)| p.default != v)
            .map(|(p, v)| format!("{}={v}", p.name))
            .collect::<Vec<_>>()
            .join(",")
    }

    /// The value of a parameter.
    ///
    /// # Panics
    /// Where the owner does not declare it: a fault in the owner's own code.
    pub fn get<T: Read>(&self, param: Typed<T>) -> T {
        let name = param.param.name;
        let found = self.values.get(name);
        found.and_then(|value| T::read(*value)).unwrap_or_else(|| {
            panic!("{} does not declare the parameter '{name}' so (found {found:?})", self.owner)
        })
    }
}

impl Serialize for Values {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(&self.values)
    }
}

/// Splits `name:key=value,key=value` into the name and its settings.
///
/// # Errors
/// [`Error::Config`] for a setting without `=`.
pub fn parse_spec(text: &str) -> Result<(&str, Vec<(String, String)>)> {
    let Some((name, settings)) = text.split_once(':') else {
        return Ok((text, Vec::new()));
    };
    let settings = settings.split(',').filter(|s| !s.is_empty()).map(parse_setting);
    Ok((name, settings.collect::<Result<_>>()?))
}

/// Splits one `key=value`.
///
/// # Errors
/// [`Error::Config`] where there is no `=`.
pub fn parse_setting(text: &str) -> Result<(String, String)> {
    match text.split_once('=') {
        Some((key, value)) => Ok((key.trim().to_string(), value.trim().to_string())),
        None => {
            Err(Error::config(format_args!("'{text}' is not a setting"), "write it as name=value"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    options! {
        /// A colour of a test.
        enum Colour { Red = "red": "as a rose", Blue = "blue": "as the sky" }
    }

    const SORT: Typed<bool> = Typed::flag("sort", true, "whether to sort");
    const COLOUR: Typed<Colour> = Typed::choice("colour", "red", "which colour");
    const COUNT: Typed<i64> = Typed::integer("count", "3", (1, 9), "how many");
    const ALPHA: Typed<f64> = Typed::real("alpha", "0.5", (0.0, 1.0), "opacity");
    const PARAMS: &[Param] = &[SORT.param, COLOUR.param, COUNT.param, ALPHA.param];

    fn resolve(text: &str) -> Result<Values> {
        let (owner, given) = parse_spec(text)?;
        Values::resolve(owner, PARAMS, &given)
    }

    #[test]
    fn defaults_and_settings() {
        let values = resolve("it:colour=blue,count=9").unwrap();
        assert!(values.get(SORT));
        assert_eq!(values.get(COLOUR), Colour::Blue);
        assert_eq!(values.get(COUNT), 9);
        assert_eq!(values.get(ALPHA), 0.5);
        assert_eq!(values.changes(PARAMS), "colour=blue,count=9");
    }

    #[test]
    fn values_and_defaults_are_written_as_what_they_are() {
        let values = serde_json::to_value(resolve("it:count=9").unwrap()).unwrap();
        let right = serde_json::json!({ "sort": true, "colour": "red", "count": 9, "alpha": 0.5 });
        assert_eq!(values, right);
        let defaults: Vec<_> = PARAMS.iter().map(|p| serde_json::to_value(p).unwrap()).collect();
        assert_eq!(defaults[2]["default"], 3);
        let bits = Value::Choice { index: 0, name: "32" };
        assert_eq!(serde_json::to_value(bits).unwrap(), 32);
        assert_eq!((&defaults[2]["type"], &defaults[2]["max"]), (&"integer".into(), &9.into()));
        assert_eq!((&defaults[0]["default"], &defaults[3]["default"]), (&true.into(), &0.5.into()));
    }

    #[test]
    fn bad_settings_say_what_would_be_good() {
        let message = |text: &str| resolve(text).unwrap_err().to_string();
        assert_eq!(
            message("it:sorted=true"),
            "unknown parameter of it: 'sorted'; did you mean 'sort'?"
        );
        assert_eq!(
            message("it:count=10"),
            "it: '10' is not a value of parameter 'count'; it takes 1..9"
        );
        assert_eq!(
            message("it:alpha=NaN"),
            "it: 'NaN' is not a value of parameter 'alpha'; it takes 0..1"
        );
        assert_eq!(
            message("it:colour=bleu"),
            "unknown value of it's parameter 'colour': 'bleu'; did you mean 'blue'?"
        );
        assert!(message("it:Sort=true").ends_with("did you mean 'sort'?"));
        assert!(message("it:colour=BLUE").ends_with("did you mean 'blue'?"));
        assert_eq!(message("it:count"), "'count' is not a setting; write it as name=value");
        assert_eq!(
            message("it:count=1,count=2"),
            "it: parameter 'count' is set twice; set it once"
        );
    }
}
