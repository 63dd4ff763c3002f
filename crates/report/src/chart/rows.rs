//! A row for each design: dots with intervals, boxes, and stacked bars from 0.

use maud::{Markup, html};

use crate::chart::style::QUANTITIES;
use crate::chart::{Kind, Scale, Style, px};

/// What a row shows of one quantity.
#[derive(Clone, PartialEq, Debug)]
pub enum Bar {
    /// A value with its interval.
    Dot {
        /// The exact numbers: value, low, high.
        value: [f64; 3],
        /// What it is, as the attribute `data-measure` has it.
        measure: String,
        /// Which of several quantities in a row: `a`, `b` or `c`.
        class: &'static str,
        /// What is said of it.
        says: String,
    },
    /// Quartiles.
    Box {
        /// First quartile, median, third quartile.
        quartiles: [f64; 3],
        /// Which of several quantities in a row.
        class: &'static str,
    },
    /// Parts that add up.
    Stack(Vec<Segment>),
}

/// A part of a stacked bar.
#[derive(Clone, PartialEq, Debug)]
pub struct Segment {
    /// The exact number; what is below 0 is drawn as nothing.
    pub value: f64,
    /// What it is, as the attribute `data-measure` has it.
    pub measure: String,
    /// CSS class.
    pub class: &'static str,
    /// What is said of it.
    pub says: String,
}

/// A design's row.
#[derive(Clone, PartialEq, Debug)]
pub struct Row {
    /// The record's name.
    pub id: String,
    /// The design as the study has it.
    pub series: String,
    /// How it looks.
    pub style: Style,
    /// What it shows.
    pub bars: Vec<Bar>,
    /// Said in place of bars that are missing.
    pub note: String,
}

/// Rows over a common axis.
#[derive(Clone, PartialEq, Debug)]
pub struct Rows {
    /// What it shows, for those who do not see it.
    pub title: String,
    /// The axis, with its unit.
    pub axis: String,
    /// How values lie on it.
    pub kind: Kind,
    /// Whether a row's quantities lie on one line, not below each other.
    pub together: bool,
    /// The rows, from the top.
    pub rows: Vec<Row>,
}

const WIDTH: f64 = 720.0;
/// Height of what a row shows of one quantity, and of what is between rows.
const LANE: f64 = 13.0;
const GAP: f64 = 9.0;
const TOP: f64 = 8.0;

impl Rows {
    /// The chart; `None` where no row shows anything.
    pub fn draw(&self) -> Option<Markup> {
        let bars = || self.rows.iter().flat_map(|r| &r.bars);
        bars().next()?;
        let values = bars().flat_map(|bar| match bar {
            Bar::Dot { value, .. } => value.to_vec(),
            Bar::Box { quartiles, .. } => quartiles.to_vec(),
            Bar::Stack(parts) => vec![0.0, parts.iter().map(|p| p.value.max(0.0)).sum::<f64>()],
        });
        let longest = self.rows.iter().map(|r| r.series.chars().count()).max().unwrap_or(0);
        let left = (longest as f64 * 6.4 + 34.0).clamp(90.0, 300.0);
        let x = Scale::new(self.kind, values, [left, WIDTH - 20.0]);
        let tall = |row: &Row| LANE * self.lanes(row) as f64 + GAP;
        let bottom = TOP + self.rows.iter().map(tall).sum::<f64>();
        let view = format!("0 0 {} {}", px(WIDTH), px(bottom + 46.0));
        let mut top = TOP;
        let places: Vec<f64> = self
            .rows
            .iter()
            .map(|row| {
                let at = top;
                top += tall(row);
                at
            })
            .collect();
        Some(html! {
            svg class="plot rows" viewBox=(view) role="group" tabindex="0" aria-label=(self.title) {
                g class="axes" {
                    @for tick in x.ticks() {
                        @let at = px(x.at(tick.value));
                        line class=(if tick.label.is_empty() { "grid small" } else { "grid" })
                            x1=(at) x2=(at) y1=(px(TOP)) y2=(px(bottom)) {}
                        text class="tick" x=(at) y=(px(bottom + 16.0)) text-anchor="middle" { (tick.label) }
                    }
                    text class="axis" x=(px((left + WIDTH - 20.0) / 2.0)) y=(px(bottom + 38.0))
                        text-anchor="middle" { (self.axis) }
                }
                @for (row, top) in self.rows.iter().zip(places) { (self.drawn(row, top, left, &x)) }
            }
        })
    }

    /// A box lies under the dot of the same class; all else has a lane of its own.
    fn lanes(&self, row: &Row) -> usize {
        let boxes = row.bars.iter().filter(|b| matches!(b, Bar::Box { .. })).count();
        if self.together { 1 } else { (row.bars.len() - boxes).max(1) }
    }

    fn drawn(&self, row: &Row, top: f64, left: f64, x: &Scale) -> Markup {
        let middle = top + (LANE * self.lanes(row) as f64 + GAP) / 2.0;
        let mut lane = 0;
        let mut under = 0;
        let mut place = |bar: &Bar| {
            // Boxes and dots come in the same order.
            let number = match bar {
                Bar::Box { .. } => &mut under,
                _ => &mut lane,
            };
            let at = top + GAP / 2.0 + LANE * (f64::from(*number) + 0.5);
            if !self.together {
                *number += 1;
            }
            at
        };
        html! {
            g class=(format!("curve {}", row.style.class)) data-series=(row.series) {
                g class="row-key" transform=(format!("translate({},{})", px(left - 12.0), px(middle))) {
                    path class="mk" d=(row.style.marker) {}
                }
                text class="row-name" x=(px(left - 24.0)) y=(px(middle)) dy="0.32em" text-anchor="end" {
                    (row.series)
                }
                @for bar in &row.bars { (shape(bar, row, place(bar), x)) }
                @if !row.note.is_empty() {
                    @let beyond = if row.bars.is_empty() { left + 8.0 } else { WIDTH - 24.0 };
                    text class="note" x=(px(beyond)) y=(px(middle)) dy="0.32em"
                        text-anchor=(if row.bars.is_empty() { "start" } else { "end" }) { (row.note) }
                }
            }
        }
    }
}

fn shape(bar: &Bar, row: &Row, y: f64, x: &Scale) -> Markup {
    match bar {
        Bar::Dot { value: [value, low, high], measure, class, says } => html! {
            g class=(format!("pt dot q-{class}")) transform=(format!("translate({},{})", px(x.at(*value)), px(y)))
                data-id=(row.id) data-measure=(measure) data-value=(value) data-low=(low) data-high=(high) {
                title { (says) }
                @if low != high {
                    path class="bar" d=(format!("M{},0H{}", px(x.at(*low) - x.at(*value)), px(x.at(*high) - x.at(*value)))) {}
                }
                path class="mk" d=(QUANTITIES.iter().find(|(c, _)| c == class).map_or("", |(_, m)| m)) {}
            }
        },
        Bar::Box { quartiles: [first, median, third], class } => html! {
            g class=(format!("box q-{class}")) data-id=(row.id) data-first=(first) data-median=(median)
                data-third=(third) {
                rect x=(px(x.at(*first))) width=(px((x.at(*third) - x.at(*first)).max(0.5)))
                    y=(px(y - 4.5)) height="9" {}
                path d=(format!("M{},{}v9", px(x.at(*median)), px(y - 4.5))) {}
            }
        },
        Bar::Stack(parts) => {
            let mut sum = 0.0;
            let from: Vec<f64> = parts
                .iter()
                .map(|p| {
                    let before = sum;
                    sum += p.value.max(0.0);
                    before
                })
                .collect();
            html! {
                @for (part, from) in parts.iter().zip(from) {
                    g class=(format!("pt part q-{}", part.class)) transform=(format!("translate({},{})", px(x.at(from)), px(y)))
                        data-id=(row.id) data-measure=(part.measure) data-value=(part.value) {
                        title { (part.says) }
                        rect y="-5" height="10" width=(px((x.at(from + part.value.max(0.0)) - x.at(from)).max(0.0))) {}
                    }
                }
            }
        }
    }
}
