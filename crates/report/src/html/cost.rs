//! Speed and cost.

use maud::{Markup, html};

use crate::chart::{Bar, Kind, Row, Rows, swatch};
use crate::html::parts::{Cell, Content, command, figure, nothing, table};
use crate::html::words::{figures, grouped, quoted};
use screendoor_study::study::record::Record;

pub(super) fn section(content: &Content<'_>) -> Markup {
    let count = content.count;
    let engines = content.results.engines();
    html! {
        h3 { "Fragments per second at " (count) " samples" }
        @if content.results.records.iter().all(|r| r.speed.values().all(|s| s.seconds.is_none())) {
            (nothing("Nothing was timed."))
        } @else { (figure("speed", &content.by_scene(|scene| speed(content, scene, &engines)), &html! {
            "Fragments of the trace per second, from the file, or from its fragments sorted by tile as another replay left them, to the picture: medians, bars from quartile \
             to quartile. "
            @for (engine, class) in engines.iter().zip(CLASSES) {
                (swatch(class)) " " code { (engine) } " "
            }
            (threads(content)) " This is how fast this program replays on this machine. It says \
             nothing of a ROP in hardware."
        }, &throughput(content, &engines))) }
        h3 { "What a ROP does for each fragment, at " (count) " samples" }
        (figure("counts", &content.by_scene(|scene| counts(content, scene)), &html! {
            "Events of the first seed for each fragment of the trace, over all passes. Comparators are \
             depth tests and those of the sorting networks; surfaces are those that surface tracking \
             started."
        }, &content.replay_one()))
        h3 { "State and passes" }
        (figure("state", &state(content), &html! {
            "Bits of state per pixel as hardware would hold them, over the scenes at most: the \
             multisample buffer and what the design keeps beside it."
        }, &content.replay_one()))
    }
}

const CLASSES: [&str; 3] = ["a", "b", "c"];

/// The threads that each replay had which was timed, where they had as many.
fn threads_of_each(content: &Content<'_>) -> Option<u32> {
    let records = content.results.records.iter();
    let mut timed = records.flat_map(|r| r.speed.values()).filter(|s| s.seconds.is_some());
    let first = timed.next()?.threads?;
    timed.all(|s| s.threads == Some(first)).then_some(first)
}

/// What the replays had of the machine.
fn threads(content: &Content<'_>) -> String {
    match threads_of_each(content) {
        Some(1) => {
            "A replay had one thread: other runs kept the machine's other cores busy, where \
                    it has more."
                .to_string()
        }
        Some(threads) => format!("A replay had {threads} threads."),
        None => String::new(),
    }
}

/// The command that times all designs on the first scene.
fn throughput(content: &Content<'_>, engines: &[String]) -> Markup {
    let study = &content.results.study;
    let Some(scene) = content.results.scenes.first() else { return html! {} };
    let on = |series: &String| content.at_count(&scene.name, series).map(|r| r.design.clone());
    let designs: Vec<String> = study.designs.iter().filter_map(on).collect();
    if designs.is_empty() || engines.is_empty() || study.timing == 0 {
        return content.study_command();
    }
    let threads =
        threads_of_each(content).filter(|n| *n as usize != content.results.machine.threads);
    let threads = threads.map(|n| format!(" --threads {n}")).unwrap_or_default();
    command(&format!(
        "screendoor{threads} throughput {} --designs {} --samples {} --engines {} --runs {}",
        quoted(&scene.trace),
        quoted(&designs.join(",")),
        content.count,
        engines.join(","),
        study.timing.min(1000)
    ))
}

fn speed(content: &Content<'_>, scene: &str, engines: &[String]) -> Markup {
    let row = |series: &String| {
        let record = content.at_count(scene, series);
        let mut bars = Vec::new();
        let mut missing = Vec::new();
        for (engine, class) in engines.iter().zip(CLASSES) {
            let Some(r) = record else { continue };
            let timed = r.speed.get(engine);
            match timed.and_then(|s| s.seconds).filter(|s| s.low > 0.0 && r.fragments > 0) {
                Some(s) => {
                    let rate = |seconds: f64| r.fragments as f64 / seconds;
                    let value = [rate(s.median), rate(s.high), rate(s.low)];
                    let says = format!(
                        "{} on {engine}\n{} million fragments a second\n({} to {})",
                        r.design,
                        figures(value[0] / 1e6),
                        figures(value[1] / 1e6),
                        figures(value[2] / 1e6)
                    );
                    let measure = format!("fragments-per-second-{engine}");
                    bars.push(Bar::Dot { value, measure, class, says });
                }
                None => {
                    let why = timed.and_then(|s| s.missing.clone());
                    missing.push(format!("{engine}: {}", why.unwrap_or("not timed".into())));
                }
            }
        }
        Row {
            id: record.map_or(String::new(), |r| r.id.clone()),
            series: series.clone(),
            style: content.styles.of(series),
            note: if record.is_none() { "no result".into() } else { missing.join("; ") },
            bars,
        }
    };
    let chart = Rows {
        title: format!("Fragments per second on {scene}"),
        axis: "fragments per second".into(),
        kind: Kind::Linear,
        together: true,
        rows: content.designs().iter().map(row).collect(),
    };
    chart.draw().unwrap_or_else(|| nothing("Nothing was timed here."))
}

fn counts(content: &Content<'_>, scene: &str) -> Markup {
    let header = [
        "design",
        "tested",
        "passed",
        "written",
        "hashes",
        "comparators",
        "products",
        "sorts",
        "surfaces",
        "bytes read",
        "bytes written",
    ];
    let row = |series: &String| -> Vec<Cell> {
        let mut cells = vec![Cell::Text(content.named(series))];
        let counted = |r: &&Record| r.events.fragments > 0 && r.fragments > 0;
        let Some(r) = content.at_count(scene, series).filter(counted) else {
            cells.extend((1..header.len()).map(|_| Cell::Missing("no events were counted".into())));
            return cells;
        };
        let e = &r.events;
        let per = |n: u64| Cell::number(n as f64 / r.fragments as f64);
        let bytes = |bits: u64| Cell::number(bits as f64 / 8.0 / r.fragments as f64);
        cells.extend([
            per(e.samples_tested),
            per(e.samples_passed),
            per(e.samples_written),
            per(e.hashes),
            per(e.comparators()),
            e.multiplications.map_or_else(|| Cell::Missing("the design does not say".into()), per),
            per(e.sorts()),
            per(e.surfaces),
            bytes(e.state_bits_read),
            bytes(e.state_bits_written),
        ]);
        cells
    };
    table(&header, &content.designs().iter().map(row).collect::<Vec<_>>())
}

fn state(content: &Content<'_>) -> Markup {
    let study = &content.results.study;
    let heads: Vec<String> = study.samples.iter().map(|n| format!("bits at {n}")).collect();
    let beside = format!("of these beside the samples, at {}", content.count);
    let mut header = vec!["design"];
    header.extend(heads.iter().map(String::as_str));
    let made_up = format!("bits at {}, made up of", content.count);
    header.extend([beside.as_str(), "passes", made_up.as_str()]);
    let row = |series: &String| {
        let own = |n: u32| {
            content.results.records.iter().filter(move |r| r.series == *series && r.samples == n)
        };
        let mut cells = vec![Cell::Text(content.named(series))];
        for n in &study.samples {
            cells.push(match own(*n).max_by_key(|r| r.state_bits.total()) {
                None => Cell::Missing("no result".into()),
                Some(_) if own(*n).any(|r| r.state_bits.unbounded) => Cell::text("grows"),
                Some(r) => between(own(*n).map(|r| r.state_bits.total()), r.state_bits.total()),
            });
        }
        let extra = own(content.count).map(|r| r.state_bits.extra).max();
        cells.push(extra.map_or(Cell::Missing("no result".into()), whole));
        let passes = || own(content.count).map(|r| r.passes);
        let most = passes().max();
        cells.push(most.map_or(Cell::Missing("no result".into()), |n| between(passes(), n)));
        let largest = own(content.count).max_by_key(|r| r.state_bits.total());
        cells.push(largest.map_or(Cell::Missing("no result".into()), |r| {
            Cell::Text(html! { span class="layout" { (r.layout) } })
        }));
        cells
    };
    table(&header, &content.designs().iter().map(row).collect::<Vec<_>>())
}

/// What differs between scenes, from the least to `most`: opaque fragments take more.
fn between(values: impl Iterator<Item = u32>, most: u32) -> Cell {
    match values.min() {
        Some(least) if least < most => {
            let [a, b] = [least, most].map(|n| grouped(u64::from(n)));
            Cell::Number(f64::from(most), format!("{a} to {b}"))
        }
        _ => whole(most),
    }
}

fn whole(n: u32) -> Cell {
    Cell::Number(f64::from(n), grouped(u64::from(n)))
}
