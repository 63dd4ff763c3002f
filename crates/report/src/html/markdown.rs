//! Markdown as a part of the page.
//!
//! It is CommonMark with tables. An image that stands alone in its paragraph takes the
//! paragraph after it as its caption. HTML within it is shown as it is written, never taken
//! as such; links lead to other pages and to places of this one.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use pulldown_cmark::html::push_html;
use pulldown_cmark::{Alignment, CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd};

/// Gives the bytes of a PNG by its file's name.
pub type Figure<'a> = dyn Fn(&str) -> Option<Vec<u8>> + 'a;

/// A line of Markdown.
pub(super) fn inline(markdown: &str) -> Markup {
    let paragraph =
        |e: &Event<'_>| matches!(e, Event::Start(Tag::Paragraph) | Event::End(TagEnd::Paragraph));
    let parser = Parser::new_ext(markdown, Options::empty());
    let events: Vec<_> = parser.filter(|e| !paragraph(e)).collect();
    rendered(&events, &|_| None)
}

/// The words of events.
pub(super) fn plain_text(events: &[Event<'_>]) -> String {
    let words = events.iter().filter_map(|e| match e {
        Event::Text(t) | Event::Code(t) | Event::InlineHtml(t) => Some(t.as_ref()),
        Event::SoftBreak | Event::HardBreak => Some(" "),
        _ => None,
    });
    words.collect()
}

/// Events as a part of the page.
pub(super) fn rendered(events: &[Event<'_>], figure: &Figure<'_>) -> Markup {
    let (events_out, right) = (Vec::new(), Vec::new());
    let mut out = Renderer { figure, events: events_out, right, column: 0, cell: Cell::Outside };
    let mut rest = events;
    while let Some(first) = rest.first() {
        let taken = out.image(rest);
        if taken == 0 {
            out.event(first);
        }
        rest = &rest[taken.max(1)..];
    }
    let mut text = String::new();
    push_html(&mut text, out.events.into_iter());
    PreEscaped(text)
}

/// Where in a table an event is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cell {
    Outside,
    Head,
    Body,
}

/// Turns a document's events into those of the page.
struct Renderer<'a, 'e> {
    figure: &'a Figure<'a>,
    events: Vec<Event<'e>>,
    /// Which columns of the table stand to the right.
    right: Vec<bool>,
    /// The column within a table's row.
    column: usize,
    cell: Cell,
}

impl<'e> Renderer<'_, 'e> {
    fn html(&mut self, text: impl Into<String>) {
        self.events.push(Event::Html(CowStr::from(text.into())));
    }

    /// Draws the image that `events` begin with: how many events it took.
    fn image(&mut self, events: &[Event<'e>]) -> usize {
        let (alone, tag) = match events {
            [Event::Start(Tag::Paragraph), tag, ..] => (true, tag),
            [tag, ..] => (false, tag),
            [] => return 0,
        };
        let Event::Start(Tag::Image { dest_url, .. }) = tag else { return 0 };
        let ends = events.iter().position(|e| matches!(e, Event::End(TagEnd::Image)));
        let end = ends.map_or(events.len(), |i| i + 1);
        let name = dest_url.rsplit('/').next().unwrap_or(dest_url);
        let picture = image(name, &plain_text(&events[..end]), (self.figure)(name));
        if !alone {
            self.html(picture.into_string());
            return end;
        }
        if !matches!(events.get(end), Some(Event::End(TagEnd::Paragraph))) {
            return 0;
        }
        let after = &events[end + 1..];
        let caption = match after {
            [Event::Start(Tag::Paragraph), next, ..]
                if !matches!(next, Event::Start(Tag::Image { .. })) =>
            {
                let closes = |e: &Event<'_>| matches!(e, Event::End(TagEnd::Paragraph));
                &after[1..after.iter().position(closes).unwrap_or(after.len())]
            }
            _ => &[],
        };
        let words = rendered(caption, self.figure);
        let block = html! {
            figure { (picture) @if !caption.is_empty() { figcaption { (words) } } }
        };
        self.html(block.into_string());
        let captioned = if caption.is_empty() { 0 } else { caption.len() + 2 };
        (end + 1 + captioned).min(events.len())
    }

    fn event(&mut self, event: &Event<'e>) {
        match event {
            Event::Html(text) | Event::InlineHtml(text) => {
                self.events.push(Event::Text(text.clone()));
            }
            Event::Start(Tag::HtmlBlock) => self.events.push(Event::Start(Tag::Paragraph)),
            Event::End(TagEnd::HtmlBlock) => self.events.push(Event::End(TagEnd::Paragraph)),
            Event::Start(Tag::Heading { level, .. }) => self.html(format!("<{}>", name(*level))),
            Event::End(TagEnd::Heading(level)) => self.html(format!("</{}>\n", name(*level))),
            Event::Start(Tag::Link { dest_url, .. }) => {
                let link = if safe(dest_url) {
                    html! { a href=(dest_url) {} }
                } else {
                    html! { a {} }
                };
                self.html(link.into_string().trim_end_matches("</a>"));
            }
            Event::End(TagEnd::Link) => self.html("</a>"),
            Event::Text(text) if self.cell == Cell::Body && self.stands_right() => {
                self.html(number(text).into_string())
            }
            _ if self.table(event) => {}
            other => self.events.push(other.clone()),
        }
    }

    fn stands_right(&self) -> bool {
        self.right.get(self.column) == Some(&true)
    }

    /// Draws what tables are made of; whether `event` is that.
    fn table(&mut self, event: &Event<'e>) -> bool {
        match event {
            Event::Start(Tag::Table(alignments)) => {
                self.right = alignments.iter().map(|a| *a == Alignment::Right).collect();
                self.html(
                    "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table\"><table>",
                );
            }
            Event::End(TagEnd::Table) => self.html("</tbody></table></div>\n"),
            Event::Start(Tag::TableHead) => {
                (self.cell, self.column) = (Cell::Head, 0);
                self.html("<thead><tr>");
            }
            Event::End(TagEnd::TableHead) => {
                self.cell = Cell::Outside;
                self.html("</tr></thead><tbody>");
            }
            Event::Start(Tag::TableRow) => {
                (self.cell, self.column) = (Cell::Body, 0);
                self.html("<tr>");
            }
            Event::End(TagEnd::TableRow) => {
                self.cell = Cell::Outside;
                self.html("</tr>");
            }
            Event::Start(Tag::TableCell) => {
                let cell = if self.cell == Cell::Head { "th scope=\"col\"" } else { "td" };
                let class = if self.stands_right() { " class=\"n\"" } else { "" };
                self.html(format!("<{cell}{class}>"));
            }
            Event::End(TagEnd::TableCell) => {
                self.html(if self.cell == Cell::Head { "</th>" } else { "</td>" });
                self.column += 1;
            }
            _ => return false,
        }
        true
    }
}

/// The page's sections are headed by `h2`; what stands within one is deeper.
fn name(level: HeadingLevel) -> &'static str {
    if level <= HeadingLevel::H3 { "h3" } else { "h4" }
}

/// Whether a link leads to a page or to a place of this one.
fn safe(link: &str) -> bool {
    ["https://", "http://", "#"].iter().any(|start| link.starts_with(start))
}

/// A number, its interval muted: `1.2 ± 0.1` and `1.2 [1.1, 1.3]`.
fn number(text: &str) -> Markup {
    let (value, interval) = match (text.find(" ± "), text.find(" [")) {
        (Some(i), _) | (None, Some(i)) => text.split_at(i),
        (None, None) => (text, ""),
    };
    html! { (value) @if !interval.is_empty() { span class="pm" { (interval) } } }
}

/// The signature that PNG files begin with.
const PNG: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
/// Of a chart that stands alone.
const SVG: &[u8] = b"<svg xmlns=";

/// A picture within the page, or what says that there is none.
fn image(name: &str, alt: &str, bytes: Option<Vec<u8>>) -> Markup {
    if let Some(svg) = bytes.as_deref().filter(|b| b.starts_with(SVG)) {
        // As an image nothing in it runs, whoever wrote the file.
        let source = format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg));
        return html! { img class="chart" src=(source) alt=(alt); };
    }
    let Some(bytes) = bytes.filter(|b| b.starts_with(&PNG)) else {
        return html! { span class="nothing" { "Missing picture: " (name) } };
    };
    // The header follows: its length and name, then width and height.
    let side = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|b| <[u8; 4]>::try_from(b).ok());
        word.map(u32::from_be_bytes)
    };
    let source = format!("data:image/png;base64,{}", STANDARD.encode(&bytes));
    html! { img src=(source) alt=(alt) width=[side(16)] height=[side(20)]; }
}
