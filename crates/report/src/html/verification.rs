//! What publications print beside what is measured, as sections of the page: a table of
//! all of it, and the documents' own sections.

use maud::{Markup, html};

use crate::document::{self, Against, Agreement};
use crate::html::document::{Figure, body, text};
use crate::html::page::{Place, Section};

/// The anchor of the table of all that publications print.
const SUMMARY: &str = "publications";

/// The anchor of a section by its heading.
pub(crate) fn anchor(heading: &str) -> String {
    let words: Vec<String> = heading
        .replace(['\'', '\u{2019}'], "")
        .split(|c: char| !c.is_alphanumeric())
        .filter(|w| !w.is_empty())
        .map(str::to_lowercase)
        .collect();
    if words.is_empty() { "section".to_string() } else { words.join("-") }
}

/// A table of all that publications print or say, each linked to its section.
pub(crate) fn summary(list: &[Against]) -> Section {
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
            td data-label="printed" { (text(&a.printed.as_str().into())) }
            td data-label="measured here" { (text(&a.measured.as_str().into())) }
            td data-label="verdict" { b class=(class) { (a.agreement.word()) } }
        }
    }
}

/// A document's sections. `figure` gives the bytes of a picture or chart by its file's name.
pub(crate) fn sections(document: &[document::Section], figure: &Figure<'_>) -> Vec<Section> {
    let mut list: Vec<Section> = Vec::new();
    for section in document {
        let title = section.title.words();
        let base = anchor(&title);
        let taken = |name: &String| list.iter().any(|s| s.anchor == *name);
        let mut names = std::iter::once(base.clone()).chain((2..).map(|i| format!("{base}-{i}")));
        let anchor = names.find(|name| !taken(name)).unwrap_or(base);
        let body = html! { div class="document" { (body(section, figure)) } };
        list.push(Section { title, anchor, place: Place::Verification, body });
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{Text, code};
    use screendoor_trace::picture::{Picture, write_png};
    use screendoor_trace::tile::TileGrid;

    /// Two sections of one name, and one whose words would be HTML.
    fn page_sections() -> Vec<Section> {
        let picture = Picture::new(TileGrid::new(3, 2), [0.5; 3]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("there.png");
        write_png(&path, &picture).unwrap();
        let png = std::fs::read(path).unwrap();
        let mut first = document::Section::new("LK table 1");
        first.paragraph("RMSE of `lk`, see [it](https://example.org).");
        first.table(
            ["samples", "lk", "ratio", "what"],
            [["4", "1.25 ± 0.01", "0.9 [0.8, 1.0]", "plain"]],
        );
        first.figure("there.png".into(), "The ramps", "*Above*: the ramps.");
        first.paragraph("After.");
        first.figure("elsewhere/gone.png".into(), "Lost", "None.");
        let mut second = document::Section::new("Enderton's examples");
        let mut deeper = document::Section::new("Deeper");
        deeper.paragraph("<script>alert(1)</script>");
        deeper.paragraph("A <b onclick=\"x()\">bold</b> [link](javascript:alert(2)).");
        deeper.figure("there.png".into(), "\"><script>alert(3)</script>", code("<script>`|"));
        deeper.table(["<script>", "`a|b`"], [[Text::plain("<b x>|`"), Text::plain("*a*")]]);
        second.parts.push(deeper);
        let list = [first, second, document::Section::new("LK table 1")];
        sections(&list, &|name| (name == "there.png").then(|| png.clone()))
    }

    #[test]
    fn every_section_has_an_anchor_of_its_own() {
        let list = page_sections();
        let names: Vec<_> = list.iter().map(|s| (s.anchor.as_str(), s.title.as_str())).collect();
        let expected = [
            ("lk-table-1", "LK table 1"),
            ("endertons-examples", "Enderton's examples"),
            ("lk-table-1-2", "LK table 1"),
        ];
        assert_eq!(names, expected);
        assert!(list.iter().all(|s| s.place == Place::Verification));
        assert!(list[1].body.0.contains("<h3>Deeper</h3>"), "{}", list[1].body.0);
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
        assert!(after.starts_with("<p>After.</p>"), "{after}");
        assert!(after.contains("Missing picture: gone.png"), "{after}");
        // What is no PNG is none.
        let mut gif = document::Section::new("A");
        gif.figure("a.png".into(), "a", "");
        let list = sections(&[gif], &|_| Some(b"GIF89a".to_vec()));
        assert!(list[0].body.0.contains("Missing picture: a.png"));
    }

    #[test]
    fn many_parts_are_folded_and_few_are_not() {
        let parts = |n: usize| {
            let mut section = document::Section::new("A");
            section.paragraph("Before.");
            for i in 0..n {
                let mut part = document::Section::new(format!("Part `{i}`"));
                part.paragraph(format!("Text {i}."));
                section.parts.push(part);
            }
            sections(&[section], &|_| None)[0].body.0.clone()
        };
        assert!(!parts(3).contains("<details>"), "{}", parts(3));
        let folded = "<p>Before.</p><details><summary>Part 0</summary><p>Text 0.</p></details>";
        let body = parts(4);
        assert!(body.contains(folded) && body.matches("</details>").count() == 4, "{body}");
    }

    #[test]
    fn html_within_a_document_is_shown_and_not_taken() {
        let body = &page_sections()[1].body.0;
        for tag in ["<script", "<b ", "javascript:", "href"] {
            assert!(!body.contains(tag), "{tag} is in {body}");
        }
        for shown in [
            "<p>&lt;script&gt;alert(1)&lt;/script&gt;</p>",
            "&lt;b onclick",
            "<a>link</a>",
            "<figcaption><code>&lt;script&gt;`|</code></figcaption>",
            "<th scope=\"col\">&lt;script&gt;</th><th scope=\"col\"><code>a|b</code></th>",
            "<td>&lt;b x&gt;|`</td><td>*a*</td>",
        ] {
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
