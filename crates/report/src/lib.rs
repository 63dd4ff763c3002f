//! Measured records as documents and pictures. Knows nothing of how runs are made.

#![warn(missing_docs)]

pub mod chart;
pub mod export;
mod folder;
pub mod html;
mod montage;
mod results;
mod stability;

pub use folder::{About, PAGE, write_report};
pub use montage::{Panel, montage};
pub use results::{
    Against, Agreement, Document, FIGURES, Figure, PARTS, check_marks, document, in_short, results,
};
pub use stability::stability;

/// A Markdown table; columns of numbers stand to the right.
pub fn markdown_table(header: &[&str], rows: &[Vec<String>]) -> String {
    let number = |text: &String| {
        text.is_empty() || text.starts_with(|c: char| c.is_ascii_digit() || "+-−—".contains(c))
    };
    let mut text = format!("| {} |\n|", header.join(" | "));
    for column in 0..header.len() {
        let right = rows.iter().all(|row| row.get(column).is_none_or(number));
        text.push_str(if right { "---:|" } else { "---|" });
    }
    text.push('\n');
    for row in rows {
        text.push_str(&format!("| {} |\n", row.join(" | ")));
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_table_has_its_rule() {
        let table = super::markdown_table(&["a", "b"], &[vec!["x1".into(), "2".into()]]);
        assert_eq!(table, "| a | b |\n|---|---:|\n| x1 | 2 |\n");
    }
}
