//! What a file says and is not drawn: each kind once, with how many triangles it concerns.

use std::collections::{BTreeSet, HashMap};

use super::document::shortened;
use super::extensions::{Treatment, treatment};
use screendoor_trace::error::Error;

/// Collects what is to be told.
#[derive(Default)]
pub(super) struct Warnings {
    /// The file.
    place: String,
    numbers: HashMap<String, Matter>,
    /// What, how many it concerns, and of what.
    entries: Vec<(String, u64, &'static str)>,
}

/// One of the things that are told, by its number.
pub(super) type Matter = usize;

impl Warnings {
    /// Nothing yet of the file at `place`.
    pub(super) fn new(place: &str) -> Self {
        Warnings { place: place.to_string(), ..Warnings::default() }
    }

    /// The matter of the file that is told as `what`, which concerns no triangle yet.
    pub(super) fn matter(&mut self, what: impl std::fmt::Display) -> Matter {
        self.matter_of("triangle", what)
    }

    /// The same of what is counted in other units: points, lines.
    pub(super) fn matter_of(&mut self, unit: &'static str, what: impl std::fmt::Display) -> Matter {
        self.whole(unit, format!("{}: {what}", self.place))
    }

    /// The same, where `error` names the file.
    pub(super) fn error(&mut self, error: &Error) -> Matter {
        self.whole("triangle", error.to_string())
    }

    fn whole(&mut self, unit: &'static str, text: String) -> Matter {
        if let Some(number) = self.numbers.get(&text) {
            return *number;
        }
        self.numbers.insert(text.clone(), self.entries.len());
        self.entries.push((text, 0, unit));
        self.entries.len() - 1
    }

    /// The matters of extensions by these names: of those that are not read.
    pub(super) fn extensions<'n>(
        &mut self,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Vec<Matter> {
        self.extensions_of("triangle", names)
    }

    /// The same of what is counted in other units.
    pub(super) fn extensions_of<'n>(
        &mut self,
        unit: &'static str,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Vec<Matter> {
        let told = names.into_iter().filter_map(|name| match treatment(name) {
            // What is packed is told where its bytes are missed.
            Treatment::Read | Treatment::Passed | Treatment::Packed(_) => None,
            Treatment::Warned(why) | Treatment::Unknown(why) => {
                let what = format_args!("{} is not read: {why}", shortened(name));
                Some(self.matter_of(unit, what))
            }
        });
        told.collect()
    }

    /// Tells that so many triangles are drawn, or left out, to which these matters apply.
    pub(super) fn concerns(&mut self, matters: impl IntoIterator<Item = Matter>, items: usize) {
        for matter in matters.into_iter().collect::<BTreeSet<_>>() {
            let count = &mut self.entries[matter].1;
            *count = count.saturating_add(items as u64);
        }
    }

    /// The warnings, in the order in which their matters were found.
    pub(super) fn warnings(self) -> impl Iterator<Item = String> {
        self.entries.into_iter().map(|(text, count, unit)| {
            let s = if count == 1 { "" } else { "s" };
            format!("{text} ({count} {unit}{s})")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matter_is_told_once_with_all_of_its_triangles() {
        let mut warnings = Warnings::new("a.gltf");
        let names = ["KHR_materials_ior", "KHR_materials_unlit", "ACME_glow", "KHR_xmp"];
        let matters = warnings.extensions(names);
        assert_eq!(matters, warnings.extensions(names));
        warnings.concerns(matters.iter().chain(&matters).copied(), 3);
        warnings.concerns([matters[0]], 4);
        warnings.matter("its 2 animations are not played");
        let warnings: Vec<String> = warnings.warnings().collect();
        assert_eq!(
            warnings,
            [
                "a.gltf: KHR_materials_ior is not read: light is not refracted (7 triangles)",
                "a.gltf: ACME_glow is not read: it is not known here (3 triangles)",
                "a.gltf: its 2 animations are not played (0 triangles)",
            ]
        );
    }
}
