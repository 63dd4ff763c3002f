//! What publications print beside what is measured, as sections of the page: a table of
//! all of it, and documents that were written as Markdown.

use maud::{Markup, html};
use pulldown_cmark::{Event, HeadingLevel, Options, Parser, Tag, TagEnd, TextMergeStream};

use crate::html::markdown::{Figure, inline, plain_text, rendered};
use crate::html::page::{Place, Section};
use crate::results::{Against, Agreement};

/// The anchor of the table of all that publications print.
const SUMMARY: &str = "publications";

/// The anchor of a section by its heading.
fn anchor(heading: &str) -> String {
    let words: Vec<String> = heading
        .replace(['\'', '\u{2019}'], "")
        .split(|c: char| !c.is_alphanumeric())
        .filter(|w| !w.is_empty())
        .map(str::to_lowercase)
        .collect();
    if words.is_empty() { "section".to_string() } else { words.join("-") }
}

/// A table of all that publications print or say, each linked to its section.
pub fn summary(list: &[Against]) -> Section {
    let count = |agreement| list.iter().filter(|a| a.agreement == agreement).count();
    let body = html! {
        p class="prose" {
            "What publications print or say, beside what is measured here, on other scenes than \
             theirs. Of " (list.len()) ", "
            (count(Agreement::Confirmed)) " confirmed, "
            (count(Agreement::InPart)) " in part, "
            (count(Agreement::Differs)) " not."
        }
        div class="scroll" tabindex="0" role="region" aria-label="Against the publications" {
            table class="against" {
                thead { tr {
                    @for name in ["", "printed", "measured here", "verdict"] { th scope="col" { (name) } }
                } }
                tbody { @for a in list { (row(a)) } }
            }
        }
    };
    Section {
        title: "Against the publications".to_string(),
        anchor: SUMMARY.to_string(),
        place: Place::Verification,
        body,
    }
}

fn row(a: &Against) -> Markup {
    let class = match a.agreement {
        Agreement::Confirmed => "verdict good",
        Agreement::InPart => "verdict",
        Agreement::Differs => "verdict bad",
    };
    html! {
        tr {
            th scope="row" {
                a href=(format!("#{}", anchor(&a.section))) { (a.section) }
                span class="small" { (a.source) }
            }
            td data-label="printed" { (inline(&a.printed)) }
            td data-label="measured here" { (inline(&a.measured)) }
            td data-label="verdict" { b class=(class) { (a.agreement.word()) } }
        }
    }
}

/// The sections of a Markdown document, split at its `##` headings; what stands before the
/// first is left out. `figure` gives the bytes of a PNG by its file's name.
pub fn sections(markdown: &str, figure: &Figure<'_>) -> Vec<Section> {
    // Merged, so that a number and its interval in brackets are one text.
    let parser = TextMergeStream::new(Parser::new_ext(markdown, Options::ENABLE_TABLES));
    let events: Vec<Event<'_>> = parser.collect();
    let second =
        |e: &Event<'_>| matches!(e, Event::Start(Tag::Heading { level: HeadingLevel::H2, .. }));
    let starts: Vec<usize> = (0..events.len()).filter(|i| second(&events[*i])).collect();
    let ends = starts.iter().skip(1).copied().chain([events.len()]);
    let mut list: Vec<Section> = Vec::new();
    for (start, end) in starts.iter().copied().zip(ends) {
        let part = &events[start..end];
        let after = part.iter().position(|e| matches!(e, Event::End(TagEnd::Heading(_))));
        let (heading, content) = part.split_at(after.map_or(part.len(), |i| i + 1));
        let title = plain_text(heading);
        let base = anchor(&title);
        let taken = |name: &String| list.iter().any(|s| s.anchor == *name);
        let mut names = std::iter::once(base.clone()).chain((2..).map(|i| format!("{base}-{i}")));
        let anchor = names.find(|name| !taken(name)).unwrap_or(base);
        let body = html! { div class="document" { (folded(content, figure)) } };
        list.push(Section { title, anchor, place: Place::Verification, body });
    }
    list
}

/// Parts under `###` of which a section may have so many before they are folded.
const MOST_PARTS: usize = 3;

/// A section's content; where it has many parts, each opens at a click.
fn folded(content: &[Event<'_>], figure: &Figure<'_>) -> Markup {
    let third =
        |e: &Event<'_>| matches!(e, Event::Start(Tag::Heading { level: HeadingLevel::H3, .. }));
    let starts: Vec<usize> = (0..content.len()).filter(|i| third(&content[*i])).collect();
    if starts.len() <= MOST_PARTS {
        return rendered(content, figure);
    }
    let ends = starts.iter().skip(1).copied().chain([content.len()]);
    html! {
        (rendered(&content[..starts[0]], figure))
        @for (start, end) in starts.iter().copied().zip(ends) {
            @let part = &content[start..end];
            @let after = part.iter().position(|e| matches!(e, Event::End(TagEnd::Heading(_))));
            @let (heading, rest) = part.split_at(after.map_or(part.len(), |i| i + 1));
            details { summary { (plain_text(heading)) } (rendered(rest, figure)) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::picture::{Picture, write_png};
    use screendoor_trace::tile::TileGrid;

    const DOCUMENT: &str = "lost\n\n## LK table 1\n\nRMSE of `lk`, see [it](https://example.org).\n\n\
        | samples | lk | ratio | what |\n|---:|---:|---:|---|\n\
        | 4 | 1.25 ± 0.01 | 0.9 [0.8, 1.0] | plain |\n\n\
        ![The ramps](verification/there.png)\n\n*Above*: the ramps.\n\nAfter.\n\n\
        ![Lost](gone.png)\n\n\
        ## Enderton's examples\n\n### Deeper\n\n\
        <script>alert(1)</script>\n\nA <b onclick=\"x()\">bold</b> [link](javascript:alert(2)) and\n\
        ![\"><script>alert(3)</script>](there.png).\n\n## LK table 1\n";

    fn page_sections() -> Vec<Section> {
        let picture = Picture::new(TileGrid::new(3, 2), [0.5; 3]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("there.png");
        write_png(&path, &picture).unwrap();
        let png = std::fs::read(path).unwrap();
        sections(DOCUMENT, &|name| (name == "there.png").then(|| png.clone()))
    }

    #[test]
    fn a_document_is_split_at_its_headings() {
        let list = page_sections();
        let names: Vec<_> = list.iter().map(|s| (s.anchor.as_str(), s.title.as_str())).collect();
        let expected = [
            ("lk-table-1", "LK table 1"),
            ("endertons-examples", "Enderton's examples"),
            ("lk-table-1-2", "LK table 1"),
        ];
        assert_eq!(names, expected);
        assert!(list.iter().all(|s| s.place == Place::Verification && !s.body.0.contains("lost")));
        assert!(list[1].body.0.contains("<h3>Deeper</h3>"), "{}", list[1].body.0);
        assert!(sections("no heading", &|_| None).is_empty());
    }

    #[test]
    fn tables_scroll_in_their_own_box_and_numbers_stand_to_the_right() {
        let body = &page_sections()[0].body.0;
        for part in [
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table\"><table>\
             <thead><tr><th scope=\"col\" class=\"n\">samples</th>",
            "<td class=\"n\">1.25<span class=\"pm\"> ± 0.01</span></td>\
             <td class=\"n\">0.9<span class=\"pm\"> [0.8, 1.0]</span></td>\
             <td>plain</td></tr></tbody></table></div>",
            "<a href=\"https://example.org\">it</a>",
        ] {
            assert!(body.contains(part), "{part} is not in {body}");
        }
    }

    #[test]
    fn pictures_are_within_the_page_and_missing_ones_are_said() {
        let body = &page_sections()[0].body.0;
        let (_, figure) = body.split_once("<figure>").unwrap();
        let (figure, after) = figure.split_once("</figure>").unwrap();
        assert!(figure.starts_with("<img src=\"data:image/png;base64,iVBORw0KGgo"), "{figure}");
        assert!(figure.contains("alt=\"The ramps\" width=\"3\" height=\"2\">"), "{figure}");
        assert!(figure.ends_with("<figcaption><em>Above</em>: the ramps.</figcaption>"));
        assert!(after.contains("<p>After.</p>"), "{after}");
        assert!(after.contains("Missing picture: gone.png"), "{after}");
        // What is no PNG is none.
        let list = sections("## A\n\n![a](a.png)", &|_| Some(b"GIF89a".to_vec()));
        assert!(list[0].body.0.contains("Missing picture: a.png"));
    }

    #[test]
    fn many_parts_are_folded_and_few_are_not() {
        let parts = |n: usize| {
            let list: String = (0..n).map(|i| format!("### Part {i}\n\nText {i}.\n\n")).collect();
            sections(&format!("## A\n\nBefore.\n\n{list}"), &|_| None)[0].body.0.clone()
        };
        assert!(!parts(3).contains("<details>"), "{}", parts(3));
        let folded = "<p>Before.</p><details><summary>Part 0</summary><p>Text 0.</p></details>";
        let body = parts(4).replace('\n', "");
        assert!(body.contains(folded) && body.matches("</details>").count() == 4, "{body}");
    }

    #[test]
    fn html_within_a_document_is_shown_and_not_taken() {
        let body = &page_sections()[1].body.0;
        for tag in ["<script", "<b ", "javascript:", "href"] {
            assert!(!body.contains(tag), "{tag} is in {body}");
        }
        for shown in ["&lt;script&gt;alert(1)&lt;/script&gt;", "&lt;b onclick", "<a>link</a>"] {
            assert!(body.contains(shown), "{shown} is not in {body}");
        }
    }

    #[test]
    fn the_summary_has_a_row_for_each_and_leads_to_its_section() {
        let of = |section: &str, agreement| Against {
            section: section.to_string(),
            source: "A 2011, figure 1".to_string(),
            printed: "`lk` <i>".to_string(),
            measured: "1.5".to_string(),
            agreement,
            remark: String::new(),
        };
        let list =
            [of("LK table 1", Agreement::Confirmed), of("Wyman's claim", Agreement::Differs)];
        let body = summary(&list).body.0;
        assert_eq!(body.matches("<tr>").count(), 3);
        for part in [
            "Of 2, 1 confirmed, 0 in part, 1 not.",
            "<a href=\"#lk-table-1\">LK table 1</a>",
            "<a href=\"#wymans-claim\">",
            "<code>lk</code> &lt;i&gt;",
            "<b class=\"verdict bad\">differs</b>",
        ] {
            assert!(body.contains(part), "{part} is not in {body}");
        }
        let stored = serde_json::to_string(&list).unwrap();
        assert!(stored.contains("\"agreement\":\"confirmed\""), "{stored}");
        assert_eq!(serde_json::from_str::<Vec<Against>>(&stored).unwrap(), list);
    }
}
