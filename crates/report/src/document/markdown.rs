//! The model as Markdown: CommonMark with GitHub's tables.

use crate::document::{Block, List, Section, Span, Table, Text};

impl Section {
    /// As Markdown, its heading of this level, an empty line after every block. `folder` is
    /// where the figures' files lie, as seen from the document.
    pub fn to_markdown(&self, level: usize, folder: &str) -> String {
        let mut out = format!("{} {}\n\n", "#".repeat(level), inline(&self.title));
        for block in &self.blocks {
            out += &block.to_markdown(folder);
            out.push('\n');
        }
        for part in &self.parts {
            out += &part.to_markdown(level + 1, folder);
        }
        out
    }
}

impl Block {
    fn to_markdown(&self, folder: &str) -> String {
        match self {
            Block::Paragraph(text) => line(text) + "\n",
            Block::List(list) => list.to_markdown(),
            Block::Table(table) => table.to_markdown(),
            Block::Figure(figure) => {
                let alt = inline(&Text::plain(&*figure.alt));
                format!("![{alt}]({folder}/{})\n\n{}\n", figure.file, line(&figure.caption))
            }
            Block::Against(against) => {
                against.paragraphs().map(|text| line(&text) + "\n").join("\n")
            }
        }
    }
}

impl List {
    /// As Markdown, a line for each item.
    pub fn to_markdown(&self) -> String {
        let line = |(i, item): (usize, &Text)| match self.first {
            Some(first) => format!("{}. {}\n", first + i, line(item)),
            None => format!("- {}\n", line(item)),
        };
        self.items.iter().enumerate().map(line).collect()
    }
}

impl Table {
    fn to_markdown(&self) -> String {
        let row = |cells: &[Text]| {
            let cells: Vec<String> = cells.iter().map(cell).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = |column| if self.is_right(column) { "---:|" } else { "---|" };
        let rule: String = (0..self.header.len()).map(rule).collect();
        let rows: String = self.rows.iter().map(|cells| row(cells)).collect();
        format!("{}|{rule}\n{rows}", row(&self.header))
    }
}

/// Tables are cut at bars before anything else is read, code or not.
fn cell(text: &Text) -> String {
    inline(text).replace('|', "\\|")
}

/// A text that begins a line, where a list, a heading or a quotation could begin.
fn line(text: &Text) -> String {
    let line = inline(text);
    let line = line.trim();
    let plain = matches!(text.0.first(), Some(Span::Plain(_)));
    let digits = line.bytes().take_while(u8::is_ascii_digit).count();
    let ends = |rest: &str| rest.is_empty() || rest.starts_with([' ', '\t']);
    let numbered = digits > 0 && line[digits..].strip_prefix(['.', ')']).is_some_and(ends);
    let at = if numbered { digits } else { 0 };
    match line[at..].chars().next() {
        Some(c) if numbered || plain && "#+-=:>[".contains(c) => {
            format!("{}{}{}", &line[..at], entity(c), &line[at + c.len_utf8()..])
        }
        _ => line.to_string(),
    }
}

/// A text within a line.
fn inline(text: &Text) -> String {
    let mut out = String::new();
    text.0.iter().for_each(|span| write(&mut out, span));
    out
}

fn write(out: &mut String, span: &Span) {
    let all = |out: &mut String, list: &[Span]| list.iter().for_each(|span| write(out, span));
    let mut within = |mark: &str, list: &[Span]| {
        out.push_str(mark);
        all(out, list);
        out.push_str(mark);
    };
    match span {
        Span::Plain(text) => escape(out, text),
        Span::Code(text) => out.push_str(&super::code(text)),
        Span::Emphasis(list) => within("*", list),
        Span::Strong(list) => within("**", list),
        Span::Link { to, words } => {
            // After it a link would be a picture.
            if out.ends_with('!') {
                out.pop();
                out.push_str(&entity('!'));
            }
            out.push('[');
            all(out, words);
            let to = to.replace(['<', '>', '\n', '\r', ' '], "");
            let place = if to.contains(['(', ')']) { format!("<{to}>") } else { to };
            out.push_str(&format!("]({place})"));
        }
    }
}

/// Writes words so that no character of them is markup; those that are none where they stand
/// are left as they are.
fn escape(out: &mut String, words: &str) {
    let mut before = ' ';
    let mut rest = words.chars().peekable();
    while let Some(c) = rest.next() {
        let after = rest.peek().copied().unwrap_or(' ');
        let markup = match c {
            '\\' | '`' | '*' | '<' | '&' | '~' | '$' => true,
            // Within a word it emphasises nothing.
            '_' => !(before.is_alphanumeric() && after.is_alphanumeric()),
            ']' => after == '(',
            '^' => before == '[',
            _ => false,
        };
        match c {
            _ if markup => out.push_str(&entity(c)),
            '\n' | '\r' => out.push(' '),
            _ => out.push(c),
        }
        before = c;
    }
}

/// A character that is one to every reader, in tables, too.
fn entity(c: char) -> String {
    format!("&#{};", u32::from(c))
}
