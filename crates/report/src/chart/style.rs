//! How designs are told apart: a colour for each family, a marker and a dash for each
//! design in it. Colour is never the only cue.

use maud::{Markup, html};

/// How a design looks in every chart of a page.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Style {
    /// CSS classes: the family's colour, filled or hollow.
    pub class: String,
    /// The marker's outline about the origin.
    pub marker: &'static str,
}

/// The styles of a study's designs.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Styles {
    list: Vec<(String, Style)>,
}

/// Outlines of about the same area, clearest first.
const MARKERS: [&str; 9] = [
    "M-4.5,0a4.5,4.5 0 1,0 9,0a4.5,4.5 0 1,0 -9,0z",
    "M-4,-4h8v8h-8z",
    "M0,-5.4L5.2,4.2H-5.2z",
    "M0,-5.8L5.4,0L0,5.8L-5.4,0z",
    "M0,5.4L5.2,-4.2H-5.2z",
    "M-1.7,-5.2h3.4v3.5h3.5v3.4h-3.5v3.5h-3.4v-3.5h-3.5v-3.4h3.5z",
    "M0,-5.6L1.6,-1.8L5.5,-1.7L2.4,0.8L3.5,4.6L0,2.4L-3.5,4.6L-2.4,0.8L-5.5,-1.7L-1.6,-1.8z",
    "M-4.9,-2.5L-2.5,-4.9L0,-2.4L2.5,-4.9L4.9,-2.5L2.4,0L4.9,2.5L2.5,4.9L0,2.4L-2.5,4.9L-4.9,2.5L-2.4,0z",
    "M-5.2,0L-2.6,-4.5H2.6L5.2,0L2.6,4.5H-2.6z",
];

impl Styles {
    /// Of designs with their families: markers are given out within each family, first
    /// filled, then hollow.
    pub fn new<'a>(designs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let mut list: Vec<(String, Style)> = Vec::new();
        let mut taken: Vec<(&str, usize)> = Vec::new();
        for (series, family) in designs {
            let place = taken.iter().position(|(f, _)| *f == family).unwrap_or_else(|| {
                taken.push((family, 0));
                taken.len() - 1
            });
            let number = taken[place].1;
            taken[place].1 += 1;
            let hollow = number / MARKERS.len() % 2 == 1;
            let known = matches!(family, "reference" | "stochastic" | "layered" | "blended");
            let colour = if known { family } else { "other" };
            let class =
                format!("f-{colour} d{}{}", number % 4, if hollow { " hollow" } else { "" });
            list.push((
                series.to_string(),
                Style { class, marker: MARKERS[number % MARKERS.len()] },
            ));
        }
        Styles { list }
    }

    /// A design's style.
    pub fn of(&self, series: &str) -> Style {
        let own = self.list.iter().find(|(s, _)| s == series).map(|(_, style)| style.clone());
        own.unwrap_or(Style { class: "f-other d0".into(), marker: MARKERS[0] })
    }

    /// All designs, in the order in which they were given.
    pub fn series(&self) -> impl Iterator<Item = &str> {
        self.list.iter().map(|(series, _)| series.as_str())
    }
}

/// A design's marker beside text.
pub fn key(style: &Style) -> Markup {
    html! {
        svg class="key" viewBox="-8 -8 16 16" width="14" height="14" aria-hidden="true" {
            g class=(style.class) { path class="mk" d=(style.marker) {} }
        }
    }
}

/// Outline and CSS class of the first, second and third quantity within a row.
pub(super) const QUANTITIES: [(&str, &str); 3] =
    [("a", MARKERS[0]), ("b", MARKERS[1]), ("c", MARKERS[3])];

/// The mark of a quantity beside text.
pub(crate) fn swatch(class: &str) -> Markup {
    let marker = QUANTITIES.iter().find(|(c, _)| *c == class).map_or(MARKERS[1], |(_, m)| m);
    html! {
        svg class="key" viewBox="-7 -7 14 14" width="11" height="11" aria-hidden="true" {
            g class=(format!("q-{class}")) { path class="mk" d=(marker) {} }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_designs_look_alike() {
        let names: Vec<String> = (0..25).map(|i| format!("d{i}")).collect();
        let family = |i: usize| ["stochastic", "layered", "blended"][i % 3];
        let styles = Styles::new(names.iter().enumerate().map(|(i, n)| (n.as_str(), family(i))));
        for (i, a) in names.iter().enumerate() {
            for b in &names[..i] {
                assert_ne!(styles.of(a), styles.of(b), "{a} and {b}");
            }
        }
    }
}
