//! Shadows of lights, by the designs that drew the lights' views.

use maud::{Markup, html};

use crate::html::document;
use crate::html::parts::{Content, figure, nothing, tabs};
use crate::visibility::{self, INTRODUCTION, LitView};

/// The section; `None` where no scene has shadows.
pub(super) fn section(content: &Content<'_>) -> Option<Markup> {
    let views = visibility::views(content.results);
    if views.is_empty() {
        return None;
    }
    let panels = |panel: &dyn Fn(&LitView<'_>) -> Markup| {
        let panels: Vec<_> = views.iter().map(|v| (v.title.clone(), panel(v))).collect();
        tabs("Light", &panels)
    };
    let again = content.study_command();
    let chart = |view: &LitView<'_>| match visibility::chart(view).draw() {
        Some(svg) => svg,
        None => nothing("No design has a state that is bounded, or none has an error."),
    };
    let all = |view: &LitView<'_>| {
        html! {
            p { (visibility::asked(view)) }
            (document::rows(&visibility::HEADER.map(Into::into), &visibility::rows(view)))
        }
    };
    let depths = |view: &LitView<'_>| {
        let (header, rows) = visibility::by_depth(view);
        document::rows(&header, &rows)
    };
    Some(html! {
        p { (INTRODUCTION) }
        h3 { "Error against state" }
        (figure("visibility-by-state", &panels(&chart), &html! {
            "RMSE of visibility against the state of a pixel of the light's map, both logarithmic: a \
             curve for each design and number of taps, its points by samples. Designs whose state grows \
             with the fragments, and errors of 0, have no place here."
        }, &again))
        h3 { "All that was tried" }
        (figure("visibility", &panels(&all), &html! {
            "Errors of visibility over all fragments that ask. Taps are the places of the map with which \
             a fragment is compared (percentage-closer filtering)."
        }, &again))
        h3 { "By depth" }
        (figure("visibility-by-depth", &panels(&depths), &html! {
            "RMSE of visibility by the fragments' depth, as shares of the light's depth range, from near \
             to far."
        }, &again))
    })
}
