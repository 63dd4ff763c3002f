//! What the report says, as a model: sections of typed blocks whose words are parsed once, when
//! they are written. Markdown and the page are both made of it, and it serialises.
//!
//! ```
//! use screendoor_report::document::Section;
//!
//! let mut section = Section::new("Hashes");
//! section.paragraph("RMSE of `lk` by *hash*, in 8-bit units:");
//! section.table(["hash", "RMSE"], [["`white`", "6.20 ± 0.02"]]);
//! let markdown = section.to_markdown(2, "figures");
//! assert!(markdown.starts_with("## Hashes\n\nRMSE of `lk` by *hash*,"));
//! assert!(markdown.ends_with("|---|---:|\n| `white` | 6.20 ± 0.02 |\n\n"));
//! ```

mod against;
mod markdown;
#[cfg(test)]
mod tests;
mod text;

use serde::{Deserialize, Serialize};

pub use against::{Against, Agreement};
pub use text::{Span, Text, code};

/// A heading and what stands under it. A whole document is one, too.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Section {
    /// Its heading.
    pub title: Text,
    /// What it says before its parts.
    pub blocks: Vec<Block>,
    /// Sections within it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Section>,
}

/// What stands for itself between two others.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Block {
    /// A paragraph.
    Paragraph(Text),
    /// Items with bullets or numbers.
    List(List),
    /// A table.
    Table(Table),
    /// A picture or chart with its caption.
    Figure(Figure),
    /// What a publication prints beside what is measured.
    Against(Against),
}

/// Items with bullets or numbers.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct List {
    /// The first item's number; bullets where there is none.
    pub first: Option<usize>,
    /// The items.
    pub items: Vec<Text>,
}

/// A table; columns of numbers stand to the right.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Table {
    /// The columns' names.
    pub header: Vec<Text>,
    /// The cells, row by row; what a row lacks is empty.
    pub rows: Vec<Vec<Text>>,
}

/// A picture or chart with its caption.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Figure {
    /// Its file's name, without a folder.
    pub file: String,
    /// What stands for it where it cannot be seen.
    pub alt: String,
    /// Its caption.
    pub caption: Text,
}

impl Table {
    /// Whether a column stands to the right: all that it holds are numbers.
    pub fn is_right(&self, column: usize) -> bool {
        self.rows.iter().all(|row| row.get(column).is_none_or(Text::is_number))
    }
}

impl Section {
    /// A section that says nothing yet.
    pub fn new(title: impl Into<Text>) -> Self {
        Section { title: title.into(), blocks: Vec::new(), parts: Vec::new() }
    }

    /// A section on one thing that a publication prints, which stands first in it.
    pub fn answering(against: Against) -> Self {
        let mut section = Section::new(&*against.section);
        section.blocks.push(Block::Against(against));
        section
    }

    /// What it sets against publications.
    pub fn against(&self) -> impl Iterator<Item = &Against> {
        self.blocks.iter().filter_map(|block| match block {
            Block::Against(against) => Some(against),
            _ => None,
        })
    }

    /// Says something.
    pub fn paragraph(&mut self, text: impl Into<Text>) {
        self.blocks.push(Block::Paragraph(text.into()));
    }

    /// Lists something with bullets.
    pub fn list(&mut self, items: impl IntoIterator<Item: Into<Text>>) {
        let items = items.into_iter().map(Into::into).collect();
        self.blocks.push(Block::List(List { first: None, items }));
    }

    /// Lists something with numbers, from `first` on.
    pub fn numbered(&mut self, first: usize, items: impl IntoIterator<Item: Into<Text>>) {
        let items = items.into_iter().map(Into::into).collect();
        self.blocks.push(Block::List(List { first: Some(first), items }));
    }

    /// Shows a table.
    pub fn table(
        &mut self,
        header: impl IntoIterator<Item: Into<Text>>,
        rows: impl IntoIterator<Item: IntoIterator<Item: Into<Text>>>,
    ) {
        let header = header.into_iter().map(Into::into).collect();
        let rows = rows.into_iter().map(|row| row.into_iter().map(Into::into).collect());
        self.blocks.push(Block::Table(Table { header, rows: rows.collect() }));
    }

    /// Shows a picture or chart.
    pub fn figure(&mut self, file: String, alt: impl Into<String>, caption: impl Into<Text>) {
        self.blocks.push(Block::Figure(Figure { file, alt: alt.into(), caption: caption.into() }));
    }

    /// Where what is said next stands: within the last part, if there is one.
    pub fn end(&mut self) -> &mut Section {
        match self.parts.len() {
            0 => self,
            parts => &mut self.parts[parts - 1],
        }
    }
}
