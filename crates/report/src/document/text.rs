//! A line of words, with what of it is code, emphasised or a link.

use pulldown_cmark::{Event, Parser, Tag};
use serde::{Deserialize, Serialize};

/// A line of words.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Text(pub Vec<Span>);

/// A part of a [`Text`].
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Span {
    /// Words, none of which is markup.
    Plain(String),
    /// Code.
    Code(String),
    /// What is emphasised.
    Emphasis(Vec<Span>),
    /// What is emphasised strongly.
    Strong(Vec<Span>),
    /// A link.
    Link {
        /// Where it leads.
        to: String,
        /// Its words.
        words: Vec<Span>,
    },
}

/// Emphasis and links within each other to this depth; what is deeper is plain.
const DEEPEST: usize = 8;

impl Text {
    /// Parses a line of CommonMark. HTML in it is words like any other.
    pub fn of(markdown: &str) -> Self {
        // Within a heading nothing is taken for a list, a number or a block of code.
        let heading = format!("# {} #", markdown.replace(['\n', '\r'], " "));
        let mut open: Vec<(Option<Tag<'_>>, Vec<Span>)> = vec![(None, Vec::new())];
        for event in Parser::new(&heading) {
            let found = match event {
                Event::Start(tag) => {
                    open.push((Some(tag), Vec::new()));
                    continue;
                }
                Event::End(_) => {
                    let Some((tag, words)) = open.pop() else { break };
                    match tag {
                        Some(Tag::Emphasis) if open.len() < DEEPEST => vec![Span::Emphasis(words)],
                        Some(Tag::Strong) if open.len() < DEEPEST => vec![Span::Strong(words)],
                        Some(Tag::Link { dest_url, .. }) if open.len() < DEEPEST => {
                            vec![Span::Link { to: dest_url.into_string(), words }]
                        }
                        _ => words,
                    }
                }
                Event::Code(code) => vec![Span::Code(code.into_string())],
                Event::Text(words) | Event::InlineHtml(words) => {
                    vec![Span::Plain(words.into_string())]
                }
                _ => continue,
            };
            if let Some((_, spans)) = open.last_mut() {
                found.into_iter().for_each(|span| append(spans, span));
            }
        }
        Text(open.pop().map_or(Vec::new(), |(_, spans)| spans))
    }

    /// Words of which none is markup.
    pub fn plain(words: impl Into<String>) -> Self {
        Text(vec![Span::Plain(words.into())])
    }

    /// The words alone.
    pub fn words(&self) -> String {
        let mut words = String::new();
        collect(&self.0, &mut words);
        words
    }

    /// Whether it is a number, or nothing at all.
    pub(super) fn is_number(&self) -> bool {
        match self.0.first() {
            None => true,
            Some(Span::Plain(text)) => {
                text.is_empty()
                    || text.starts_with(|c: char| c.is_ascii_digit() || "+-−—".contains(c))
            }
            Some(_) => false,
        }
    }
}

/// Puts a span after others: plain words become one, so that a number and its interval in
/// brackets are.
fn append(spans: &mut Vec<Span>, span: Span) {
    match (spans.last_mut(), span) {
        (Some(Span::Plain(before)), Span::Plain(words)) => before.push_str(&words),
        (_, span) => spans.push(span),
    }
}

fn collect(spans: &[Span], words: &mut String) {
    for span in spans {
        match span {
            Span::Plain(text) | Span::Code(text) => words.push_str(text),
            Span::Emphasis(list) | Span::Strong(list) | Span::Link { words: list, .. } => {
                collect(list, words);
            }
        }
    }
}

impl From<&str> for Text {
    fn from(markdown: &str) -> Self {
        Text::of(markdown)
    }
}

impl From<String> for Text {
    fn from(markdown: String) -> Self {
        Text::of(&markdown)
    }
}

/// Any text as code within a line of CommonMark: names that come from files.
pub fn code(text: &str) -> String {
    let text = text.replace(['\n', '\r'], " ");
    let longest = text.split(|c| c != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(longest + 1);
    // A space on either side is taken away again.
    let padded = text.starts_with(['`', ' ']) || text.ends_with(['`', ' ']);
    let pad = if padded && !text.trim().is_empty() { " " } else { "" };
    format!("{fence}{pad}{text}{pad}{fence}")
}
