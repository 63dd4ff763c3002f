//! Measured records as documents and pictures. Knows nothing of how runs are made.

mod montage;
mod results;

pub use montage::{Panel, montage};
pub use results::{FIGURES, Figure, figures, results};

/// A Markdown table; the first column to the left, the others to the right.
pub fn markdown_table(header: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("| {} |\n|---", header.join(" | "));
    text.push_str(&"|---:".repeat(header.len().saturating_sub(1)));
    text.push_str("|\n");
    for row in rows {
        text.push_str(&format!("| {} |\n", row.join(" | ")));
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_table_has_its_rule() {
        let table = super::markdown_table(&["a", "b"], &[vec!["1".into(), "2".into()]]);
        assert_eq!(table, "| a | b |\n|---|---:|\n| 1 | 2 |\n");
    }
}
