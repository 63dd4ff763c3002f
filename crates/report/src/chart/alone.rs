//! A chart as a file of its own, for documents that are no page of ours.

use maud::Markup;

/// The page's style sheet: of it the colours and what charts look like are taken.
const SHEET: &str = include_str!("../html/report.css");
/// The headings of its parts that a chart needs: colours, which it begins with, and charts.
const CHARTS: &str = "/* Charts */";
const PAGE: &str = "/* Page */";

/// An SVG file of a chart: with its colours, light or dark as the reader's system is.
pub fn alone(chart: &Markup) -> String {
    let svg = chart.0.as_str();
    let Some((open, rest)) = svg.split_once('>') else { return String::new() };
    let open = open.replacen("<svg ", "<svg xmlns=\"http://www.w3.org/2000/svg\" ", 1);
    let colours = SHEET.split(PAGE).next().unwrap_or_default();
    let charts = SHEET.split(CHARTS).nth(1).unwrap_or_default();
    let charts = charts.split("/* ").next().unwrap_or_default();
    format!(
        "{open}><style>{colours}{charts}svg {{ background: var(--bg); font-family: system-ui, \
         sans-serif; }}</style>{rest}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_alone_has_its_colours_and_its_shapes() {
        let svg = alone(&maud::html! { svg viewBox="0 0 9 9" { path class="mk" {} } });
        assert!(
            svg.starts_with(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"><style>"
            )
        );
        for rule in ["--stochastic: #", ".mk { fill", ".front-line {", "prefers-color-scheme: dark"]
        {
            assert!(svg.contains(rule), "{rule}");
        }
        for foreign in [".legend", "body {", ".against"] {
            assert!(!svg.contains(foreign), "{foreign}");
        }
        assert!(svg.ends_with("<path class=\"mk\"></path></svg>\n"));
    }
}
