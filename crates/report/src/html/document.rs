//! A document's sections as a part of the page.
//!
//! All words are shown as they are, never taken as HTML; links lead to other pages and to
//! places of this one.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use crate::document::{Block, Section, Span, Table, Text};

/// Gives the bytes of a picture or chart by its file's name.
pub type Figure<'a> = dyn Fn(&str) -> Option<Vec<u8>> + 'a;

/// Parts of which a section may have so many before each opens at a click.
const MOST_PARTS: usize = 3;

/// What a section of the page holds, without its heading.
pub(super) fn body(section: &Section, figure: &Figure<'_>) -> Markup {
    let folded = section.parts.len() > MOST_PARTS;
    html! {
        @for block in &section.blocks { (self::block(block, figure)) }
        @for part in &section.parts {
            @if folded {
                details { summary { (part.title.words()) } (body(part, figure)) }
            } @else {
                h3 { (text(&part.title)) }
                (body(part, figure))
            }
        }
    }
}

/// A line of words.
pub(super) fn text(text: &Text) -> Markup {
    spans(&text.0, &|words| html! { (words) })
}

fn spans(list: &[Span], plain: &dyn Fn(&str) -> Markup) -> Markup {
    html! {
        @for span in list {
            @match span {
                Span::Plain(words) => (plain(words)),
                Span::Code(words) => code { (words) },
                Span::Emphasis(words) => em { (spans(words, plain)) },
                Span::Strong(words) => strong { (spans(words, plain)) },
                Span::Link { to, words } => a href=[leads_out(to).then_some(to)] { (spans(words, plain)) },
            }
        }
    }
}

/// Whether a link leads to a page or to a place of this one.
fn leads_out(link: &str) -> bool {
    ["https://", "http://", "#"].iter().any(|start| link.starts_with(start))
}

fn block(block: &Block, figure: &Figure<'_>) -> Markup {
    let items = |items: &[Text]| html! { @for item in items { li { (text(item)) } } };
    html! {
        @match block {
            Block::Paragraph(words) => p { (text(words)) },
            Block::List(list) => @match list.first {
                Some(first) => ol start=[(first != 1).then_some(first)] { (items(&list.items)) },
                None => ul { (items(&list.items)) },
            },
            Block::Table(table) => (self::table(table)),
            Block::Figure(own) => figure {
                (image(&own.file, &own.alt, figure))
                figcaption { (text(&own.caption)) }
            },
            Block::Against(against) => @for words in against.paragraphs() { p { (text(&words)) } },
        }
    }
}

/// A table of such words.
pub(super) fn rows<R: AsRef<[Text]>>(header: &[Text], rows: &[R]) -> Markup {
    let rows = rows.iter().map(|row| row.as_ref().to_vec()).collect();
    table(&Table { header: header.to_vec(), rows })
}

fn table(table: &Table) -> Markup {
    let class = |column| table.is_right(column).then_some("n");
    let columns: Vec<_> = table.header.iter().enumerate().map(|(i, t)| (i, t, class(i))).collect();
    let cell = |cell: &Text, right: bool| if right { spans(&cell.0, &number) } else { text(cell) };
    html! {
        div class="scroll" tabindex="0" role="region" aria-label="Table" {
            table {
                thead { tr {
                    @for (_, name, class) in &columns { th scope="col" class=[class] { (text(name)) } }
                } }
                tbody {
                    @for row in &table.rows {
                        tr {
                            @for (column, _, class) in &columns {
                                td class=[class] {
                                    @if let Some(words) = row.get(*column) { (cell(words, class.is_some())) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
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
fn image(file: &str, alt: &str, figure: &Figure<'_>) -> Markup {
    // Without folders, whoever wrote the document: what is read lies beside it.
    let name = file.rsplit('/').next().unwrap_or(file);
    let bytes = figure(name);
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
