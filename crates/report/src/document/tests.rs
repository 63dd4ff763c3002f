//! The model, its Markdown and its JSON.

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use super::*;

/// A section with one of everything.
fn everything() -> Section {
    let mut section = Section::answering(Against {
        section: "LK table 1".to_string(),
        source: "A 2011, table 1".to_string(),
        printed: "`lk` is *better*.".to_string(),
        measured: "1.5 [1.4, 1.6].".to_string(),
        agreement: Agreement::InPart,
        remark: "On 1 of 2 scenes.".to_string(),
    });
    section.paragraph("See [**it**](https://example.org), 2^-23 of `a|b`.");
    section.list(["**one**: 1", "two"]);
    section.numbered(3, ["three", "four"]);
    let mut part = Section::new("`oak`, beside MOTOR");
    part.table(["scene", "`lk|x`", ""], [vec!["oak", "1.0 [0.9, 1.1]"], vec!["`a|b`", "—", "−2"]]);
    part.figure("ramps.png".to_string(), "The ramps", "Upper row: `lk`.");
    section.parts.push(part);
    section.end().paragraph("Below it.");
    section
}

#[test]
fn markdown_has_an_empty_line_after_every_block() {
    let expected = "## LK table 1\n\n\
        **Printed** (A 2011, table 1): `lk` is *better*.\n\n\
        **Measured**: 1.5 [1.4, 1.6].\n\n\
        **Verdict**: confirmed in part. On 1 of 2 scenes.\n\n\
        See [**it**](https://example.org), 2^-23 of `a|b`.\n\n\
        - **one**: 1\n- two\n\n\
        3. three\n4. four\n\n\
        ### `oak`, beside MOTOR\n\n\
        | scene | `lk\\|x` |  |\n|---|---:|---:|\n\
        | oak | 1.0 [0.9, 1.1] |\n| `a\\|b` | — | −2 |\n\n\
        ![The ramps](figures/ramps.png)\n\nUpper row: `lk`.\n\n\
        Below it.\n\n";
    assert_eq!(everything().to_markdown(2, "figures"), expected);
}

#[test]
fn json_gives_the_model_back() {
    let section = everything();
    let json = serde_json::to_string(&section).unwrap();
    assert_eq!(serde_json::from_str::<Section>(&json).unwrap(), section);
    for part in [
        r#"{"against":{"section":"LK table 1","#,
        r#""agreement":"in-part""#,
        r#"{"link":{"to":"https://example.org","words":[{"strong":[{"plain":"it"}]}]}}"#,
        r#"{"list":{"first":3,"items":[[{"plain":"three"}],"#,
        r#"{"figure":{"file":"ramps.png","alt":"The ramps","caption":[{"plain":"Upper row: "},"#,
    ] {
        assert!(json.contains(part), "{part} is not in {json}");
    }
}

/// What CommonMark and all its extensions make of a paragraph, if it is plain words; what makes
/// other characters of dashes and quotes is left out.
fn shown(markdown: &str) -> Option<String> {
    let parser = Parser::new_ext(markdown, Options::all() - Options::ENABLE_SMART_PUNCTUATION);
    let word = |event| match event {
        Event::Start(Tag::Paragraph) | Event::End(TagEnd::Paragraph) => Some(String::new()),
        Event::Text(text) => Some(text.into_string()),
        _ => None,
    };
    parser.map(word).collect()
}

/// Words that would be markup.
const NASTY: [&str; 18] = [
    "Plain words, of a state-of-the-art study (8 bits).",
    "# Not a heading",
    "- no item",
    "+ none",
    "1. none",
    "22) none",
    "=== no underline",
    "--- no rule",
    "---",
    "![picture](http://nowhere/a.png) and [link](x) and [^note]",
    "[a]: http://nowhere",
    "a | b\\| | c",
    "*a* _b_ __c__ ~~d~~ `e` $f$ \\g per_pixel",
    "<script>x</script> &amp;",
    "> a",
    "`` ` ``",
    "0.9 [0.8, 1.0] [?]",
    "***",
];

#[test]
fn plain_words_are_no_markup() {
    for words in NASTY {
        let mut section = Section::new("A");
        section.paragraph(Text::plain(words));
        let markdown = section.to_markdown(1, ".");
        let paragraph = markdown.strip_prefix("# A\n\n").unwrap();
        assert_eq!(shown(paragraph).as_deref(), Some(words), "{markdown}");
        assert_eq!(Text::of(paragraph.trim_end()), Text::plain(words), "{markdown}");
        // Within a table, beside the same as code.
        let mut table = Section::new("A");
        table.table(["a", "b"], [[Text::plain(words), "b".into()]]);
        let markdown = table.to_markdown(1, ".");
        let parser = Parser::new_ext(&markdown, Options::all() - Options::ENABLE_SMART_PUNCTUATION);
        let inside = parser.skip_while(|e| !matches!(e, Event::Start(Tag::TableRow)));
        let mut cells = vec![String::new()];
        for event in inside {
            match event {
                Event::Text(text) => cells.last_mut().unwrap().push_str(&text),
                Event::End(TagEnd::TableCell) => cells.push(String::new()),
                Event::Start(Tag::TableRow | Tag::TableCell) | Event::End(_) => (),
                other => panic!("{other:?} in {markdown}"),
            }
        }
        assert_eq!(cells, [words, "b", ""], "{markdown}");
    }
    let mut section = Section::new(Text::plain("a\n# b"));
    section.paragraph(Text::plain("one\n\n# two\r\n- three"));
    assert_eq!(section.to_markdown(1, "."), "# a # b\n\none  # two  - three\n\n");
}

#[test]
fn any_name_can_be_code_in_a_line() {
    for name in ["lk", "<script>", "a|b", "`", "a``b`", " a ", "*a*", "&amp;", "\\"] {
        let text = Text::of(&format!("On {}, twice.", code(name)));
        let plain = |words: &str| Span::Plain(words.to_string());
        let expected = [plain("On "), Span::Code(name.to_string()), plain(", twice.")];
        assert_eq!(text.0, expected);
        assert_eq!(text.words(), format!("On {name}, twice."));
    }
}

#[test]
fn what_lies_too_deep_is_plain() {
    let text = Text::of(&format!("{}b{}", "*a **a ".repeat(50), "** a*".repeat(50)));
    assert!(matches!(text.0.first(), Some(Span::Emphasis(_))), "{text:?}");
    assert_eq!(text.words().matches(['a', '*']).count(), 150);
    // What reads JSON goes no deeper than 128 brackets.
    let json = serde_json::to_string(&text).unwrap();
    assert_eq!(serde_json::from_str::<Text>(&json).unwrap(), text);
}

#[test]
fn a_line_is_parsed_as_a_line() {
    for words in ["- a", "1. a", "# a", "a #", "= ", "+1.5 ± 0.1", "> a", "* a", "    a"] {
        assert_eq!(Text::of(words), Text::plain(words.trim()), "{words}");
    }
    assert_eq!(Text::of(""), Text::default());
    assert_eq!(Text::of("a\nb <i>c</i> &lt;"), Text::plain("a b <i>c</i> <"));
}

#[test]
fn columns_of_numbers_stand_to_the_right() {
    let right = |cells: &[&str]| {
        let rows = cells.iter().map(|cell| vec![Text::of(cell)]).collect();
        Table { header: vec!["a".into()], rows }.is_right(0)
    };
    assert!(right(&["1", "-2", "−3 ± 1", "—", "", "+4"]) && right(&[]));
    assert!(!right(&["1", "`2`"]) && !right(&["**3**"]) && !right(&["± 1"]));
}

/// Where a block goes: into the section that was opened last.
fn deepest(section: &mut Section) -> &mut Section {
    if section.parts.is_empty() { section } else { deepest(section.end()) }
}

/// Reads as much Markdown as the documents of this tree have. Its first heading is of `level`.
fn read(markdown: &str, level: usize) -> Vec<Section> {
    let cells = |line: &str| -> Vec<Text> {
        let line = line.strip_prefix("| ").unwrap().strip_suffix(" |").unwrap();
        line.split(" | ").map(Text::of).collect()
    };
    let mut root = Section::new("");
    for block in markdown.split("\n\n").filter(|block| !block.is_empty()) {
        let lines: Vec<&str> = block.lines().collect();
        let section = deepest(&mut root);
        let items = |prefix: &str| -> Option<Vec<&str>> {
            lines.iter().map(|line| line.strip_prefix(prefix)).collect()
        };
        if let Some(heading) = lines[0].strip_prefix('#') {
            let title = heading.trim_start_matches('#');
            let mut at = &mut root;
            for _ in level..1 + heading.len() - title.len() {
                at = at.end();
            }
            at.parts.push(Section::new(title.trim()));
        } else if lines[0].starts_with("| ") {
            section.table(cells(lines[0]), lines[2..].iter().map(|line| cells(line)));
        } else if let Some(items) = items("- ") {
            section.list(items);
        } else if let Some(figure) = lines[0].strip_prefix("![") {
            let (alt, file) = figure.split_once("](figures/").unwrap();
            let file = file.strip_suffix(')').unwrap().to_string();
            section.figure(file, alt, "");
        } else if let Some((number, _)) = lines[0].split_once(". ")
            && let Ok(first) = number.parse()
        {
            section.numbered(first, lines.iter().map(|line| line.split_once(". ").unwrap().1));
        } else if let Some(Block::Figure(figure)) = section.blocks.last_mut()
            && figure.caption == Text::default()
        {
            figure.caption = block.into();
        } else {
            section.paragraph(block);
        }
    }
    root.parts
}

#[test]
fn the_documents_of_the_tree_come_out_as_they_are() {
    let results = include_str!("../../../../docs/RESULTS.md");
    let stability = include_str!("../../../../docs/STABILITY.md");
    let mut tables = 0;
    // RESULTS.md is put together of several, between comments.
    for part in results.split("-->\n").chain([stability]) {
        let part = part.split("<!--").next().unwrap();
        let level = part.bytes().take_while(|b| *b == b'#').count();
        if level == 0 {
            let items = part.lines().map(|line| Text::of(line.strip_prefix("- ").unwrap()));
            assert_eq!(List { first: None, items: items.collect() }.to_markdown(), part);
            continue;
        }
        let sections = read(part, level);
        let written: String = sections.iter().map(|s| s.to_markdown(level, "figures")).collect();
        for (own, expected) in written.lines().zip(part.lines()) {
            assert_eq!(own, expected);
        }
        assert_eq!(written.len(), part.len());
        tables += written.matches("\n|---").count();
    }
    assert!(tables > 40, "{tables} tables");
}

#[test]
fn statements_agree_wholly_in_part_or_not() {
    assert_eq!(Agreement::of(&[true, true]), Agreement::Confirmed);
    assert_eq!(Agreement::of(&[true, false]), Agreement::InPart);
    assert_eq!(Agreement::of(&[false, false]), Agreement::Differs);
}
