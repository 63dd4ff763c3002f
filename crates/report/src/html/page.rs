//! The page's frame and order.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::html::parts::Content;
use crate::html::words::counted;
use crate::html::{
    about, choice, convergence, cost, error, filters, perception, reproduce, visibility,
};
use screendoor_study::study::results::Results;

const CSS: &str = include_str!("report.css");
const JS: &str = include_str!("report.js");

/// Where a section from elsewhere stands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// After the summary: the pictures.
    Pictures,
    /// Within perception: what moves, say.
    Perception,
    /// Within the designs.
    Designs,
    /// After the designs: against the publications.
    Verification,
}

/// A section from elsewhere.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its title.
    pub title: String,
    /// Its id on the page.
    pub anchor: String,
    /// Where it stands.
    pub place: Place,
    /// What it shows.
    pub body: Markup,
}

/// What is said of a design.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DesignText {
    /// The design as the study has it.
    pub series: String,
    /// What it does, in a line.
    pub summary: String,
    /// Where it was published.
    pub citation: String,
    /// What it promises.
    pub promises: Vec<String>,
}

/// What the results do not hold.
#[derive(Clone, Debug)]
pub struct Extras {
    /// Sections from elsewhere.
    pub sections: Vec<Section>,
    /// What is said of the designs.
    pub designs: Vec<DesignText>,
    /// When the study was run.
    pub when: Option<String>,
    /// The command that measures the study.
    pub command: String,
    /// Style sheets of the sections.
    pub css: Vec<String>,
    /// Scripts of the sections.
    pub js: Vec<String>,
}

impl Default for Extras {
    fn default() -> Self {
        Extras {
            sections: Vec::new(),
            designs: Vec::new(),
            when: None,
            command: "screendoor study study.toml -o results".to_string(),
            css: Vec::new(),
            js: Vec::new(),
        }
    }
}

/// A section of the page: anchor, title, content.
pub(super) type Part = (String, String, Markup);

/// The whole page: one HTML file.
pub fn page(results: &Results, extras: &Extras) -> String {
    let content = Content::new(results, extras);
    let own = |anchor: &str, title: &str, body: Markup| (anchor.into(), title.into(), body);
    let mut parts: Vec<Part> =
        vec![own("choice", "Which design to build", choice::section(&content))];
    parts.extend(given(extras, Place::Pictures));
    parts.push(own("error", "Error", error::section(&content)));
    parts.push(own("perception", "Perception", perception::section(&content)));
    parts.push(own("convergence", "Convergence", convergence::section(&content)));
    parts.extend(
        visibility::section(&content).map(|body| own("shadows", "Visibility in shadows", body)),
    );
    parts.extend(filters::section(&content).map(|body| own("post-filters", "Filters", body)));
    parts.push(own("cost", "Speed and cost", cost::section(&content)));
    parts.push(own("designs", "Designs", about::designs(&content)));
    let again =
        |(anchor, title, body): Part| (anchor, title, html! { (body) (content.study_command()) });
    parts.extend(given(extras, Place::Verification).map(again));
    parts.push(own("scenes", "Scenes", about::scenes(&content)));
    parts.push(own("method", "How it was measured", about::method(&content)));
    parts.push(own("reproduce", "Machine and study", reproduce::section(&content)));
    parts.push(own("missing", "Missing results", reproduce::missing(&content)));
    frame(&content, &parts).into_string()
}

/// The sections from elsewhere that stand at a place.
fn given(extras: &Extras, place: Place) -> impl Iterator<Item = Part> {
    let here = extras.sections.iter().filter(move |s| s.place == place);
    here.map(|s| (s.anchor.clone(), s.title.clone(), s.body.clone()))
}

/// The same within another section.
pub(super) fn given_within(extras: &Extras, place: Place) -> Markup {
    html! {
        @for (anchor, title, body) in given(extras, place) { h3 id=(anchor) { (title) } (body) }
    }
}

fn frame(content: &Content<'_>, parts: &[Part]) -> Markup {
    let study = &content.results.study;
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="generator" content=(format!("screendoor {}", content.results.machine.screendoor));
                title { (study.name) " · screendoor" }
                style { (PreEscaped(CSS)) @for css in &content.extras.css { (PreEscaped(css)) } }
                // Before anything is drawn, so that nothing flickers.
                script { (PreEscaped(
                    "document.documentElement.classList.add('js');\
                     try{const t=localStorage.getItem('screendoor-theme');\
                     if(t==='light'||t==='dark')document.documentElement.dataset.theme=t;}catch(e){}"
                )) }
            }
            body {
                a class="skip" href="#main" { "To the results" }
                (header(content))
                (contents(parts))
                main id="main" {
                    @for (anchor, title, body) in parts {
                        section id=(anchor) { h2 { (title) } (body) }
                    }
                }
                footer { "Made by screendoor " (content.results.machine.screendoor) "." }
                script { (PreEscaped(JS)) }
                @for js in &content.extras.js { script { (PreEscaped(js)) } }
            }
        }
    }
}

fn header(content: &Content<'_>) -> Markup {
    let results = content.results;
    let study = &results.study;
    let machine = &results.machine;
    let designs = counted(study.designs.len(), "design");
    let counts: Vec<String> = study.samples.iter().map(u32::to_string).collect();
    let seeds = counted(study.seeds as usize, "seed");
    let scenes = counted(study.scenes.len(), "scene");
    html! {
        header {
            p class="eyebrow" { "screendoor study" }
            h1 { (study.name) }
            @if !study.description.is_empty() { p class="lead" { (study.description) } }
            p class="facts" {
                (designs) " at " (counts.join(", ")) " samples per pixel on " (scenes) ", " (seeds)
                @if let Some(when) = &content.extras.when { " · " (when) }
                @if !machine.processor.is_empty() { " · " (machine.processor) }
                @if let Some(gpu) = &machine.gpu { " · " (gpu) }
                @if !results.missing.is_empty() {
                    " · " a href="#missing" {
                        (counted(results.missing.len(), "result")) " missing"
                    }
                }
            }
        }
    }
}

fn contents(parts: &[Part]) -> Markup {
    html! {
        nav class="contents" aria-label="Contents" {
            details open {
                summary { "Contents" }
                ol { @for (anchor, title, _) in parts { li { a href=(format!("#{anchor}")) { (title) } } } }
            }
        }
    }
}
