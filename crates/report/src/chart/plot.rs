//! Points and lines between two axes.

use maud::{Markup, html};

use crate::chart::labels::{Wanted, column, place};
use crate::chart::{Kind, Scale, Style, px};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::record::Kept;
use screendoor_study::study::throughput::Spread;

/// An axis.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Axis {
    /// What it shows, with its unit.
    pub title: String,
    /// How.
    pub kind: Kind,
}

/// A point with its exact numbers.
#[derive(Clone, PartialEq, Debug)]
pub struct Mark {
    /// The record's name, where the point is one record's.
    pub id: Option<String>,
    /// Samples per pixel; `None` on a curve that has none.
    pub samples: Option<u32>,
    /// Where it lies along.
    pub cost: Spread,
    /// How high, with its interval.
    pub error: Estimate,
    /// What is said of it, line by line.
    pub says: String,
    /// Whether it lies on the Pareto front.
    pub front: bool,
    /// Whether it is marked: on a curve of many points few are.
    pub marked: bool,
}

/// The points of a design.
#[derive(Clone, PartialEq, Debug)]
pub struct Curve {
    /// The design as the study has it.
    pub series: String,
    /// How it looks.
    pub style: Style,
    /// What readers may filter by: the promises that it keeps, and the most passes.
    pub facts: Option<(Kept, u32)>,
    /// Its points, in the order in which they are joined.
    pub marks: Vec<Mark>,
}

/// A chart.
#[derive(Clone, PartialEq, Debug)]
pub struct Plot {
    /// What it shows, for those who do not see it.
    pub title: String,
    /// Along.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// Width and height.
    pub size: [f64; 2],
    /// The designs.
    pub curves: Vec<Curve>,
    /// Whether the Pareto front is drawn.
    pub front: bool,
    /// Where designs are named.
    pub names: Names,
    /// A value that is marked by a line across.
    pub line: Option<f64>,
}

/// Where designs are named in a chart. The legend names them all.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Names {
    /// Nowhere.
    None,
    /// By their points at a sample count, where there is room.
    At(u32),
    /// In a column beside their last points.
    Beside,
}

/// Space beside the plot: left, top, right, bottom.
const MARGIN: [f64; 4] = [66.0, 14.0, 14.0, 50.0];
/// Width of the column of names, and how many letters fit in it.
const COLUMN: f64 = 216.0;
const LETTERS: usize = 31;

impl Plot {
    /// The chart; `None` without any point.
    pub fn draw(&self) -> Option<Markup> {
        let marks: Vec<&Mark> = self.curves.iter().flat_map(|c| &c.marks).collect();
        if marks.is_empty() {
            return None;
        }
        let [width, height] = self.size;
        let beside = if self.names == Names::Beside { COLUMN } else { 0.0 };
        let frame = [MARGIN[0], MARGIN[1], width - MARGIN[2] - beside, height - MARGIN[3]];
        let along = marks.iter().flat_map(|m| [m.cost.low, m.cost.median, m.cost.high]);
        let x = Scale::new(self.x.kind, along, [frame[0], frame[2]]);
        // An interval that reaches 0 must not draw the axis down to it.
        let up = marks.iter().flat_map(|m| {
            let whole = m.error.low > m.error.value / 20.0;
            [m.error.value, m.error.high, if whole { m.error.low } else { m.error.value }]
        });
        let y = Scale::new(self.y.kind, up.chain(self.line), [frame[3], frame[1]]);
        let view = format!("0 0 {} {}", px(width), px(height));
        Some(html! {
            svg class=(if beside > 0.0 { "plot lines" } else { "plot" }) viewBox=(view) role="group" tabindex="0" aria-label=(self.title) {
                (self.axes(&x, &y, frame))
                @if let Some(line) = self.line {
                    line class="mean" x1=(px(frame[0])) x2=(px(frame[2])) y1=(px(y.at(line)))
                        y2=(px(y.at(line))) {}
                }
                @if self.front { (self.front_line(&x, &y, frame)) }
                @for curve in &self.curves { (self.curve(curve, &x, &y)) }
                @match self.names {
                    Names::None => {},
                    Names::At(count) => { (self.names_at(count, &x, &y, frame)) },
                    Names::Beside => { (self.names_beside(&x, &y, frame)) },
                }
            }
        })
    }

    fn axes(&self, x: &Scale, y: &Scale, [left, top, right, bottom]: [f64; 4]) -> Markup {
        html! {
            g class="axes" {
                @for tick in x.ticks() {
                    @let at = px(x.at(tick.value));
                    line class=(if tick.label.is_empty() { "grid small" } else { "grid" })
                        x1=(at) x2=(at) y1=(px(top)) y2=(px(bottom)) {}
                    @if !tick.label.is_empty() {
                        text class="tick" x=(at) y=(px(bottom + 17.0)) text-anchor="middle" { (tick.label) }
                    }
                }
                @for tick in y.ticks() {
                    @let at = px(y.at(tick.value));
                    line class=(if tick.label.is_empty() { "grid small" } else { "grid" })
                        x1=(px(left)) x2=(px(right)) y1=(at) y2=(at) {}
                    @if !tick.label.is_empty() {
                        text class="tick" x=(px(left - 7.0)) y=(at) dy="0.32em" text-anchor="end" { (tick.label) }
                    }
                }
                @if let Some(at) = x.zero() {
                    line class="grid zero" x1=(px(at)) x2=(px(at)) y1=(px(top)) y2=(px(bottom)) {}
                    text class="tick" x=(px(at)) y=(px(bottom + 17.0)) text-anchor="middle" { "0" }
                }
                @if let Some(at) = y.zero() {
                    line class="grid zero" x1=(px(left)) x2=(px(right)) y1=(px(at)) y2=(px(at)) {}
                    text class="tick" x=(px(left - 7.0)) y=(px(at)) dy="0.32em" text-anchor="end" { "0" }
                }
                path class="frame" d=(format!("M{},{}V{}H{}", px(left), px(top), px(bottom), px(right))) {}
                text class="axis" x=(px((left + right) / 2.0)) y=(px(bottom + 40.0)) text-anchor="middle" {
                    (self.x.title)
                }
                text class="axis" text-anchor="middle"
                    transform=(format!("translate(14,{}) rotate(-90)", px((top + bottom) / 2.0))) {
                    (self.y.title)
                }
            }
        }
    }

    /// The step line of what is not dominated. The script draws it anew after filtering,
    /// so it carries the frame.
    fn front_line(&self, x: &Scale, y: &Scale, frame: [f64; 4]) -> Markup {
        let on = self.curves.iter().flat_map(|c| &c.marks).filter(|m| m.front);
        let mut points: Vec<(f64, f64)> =
            on.map(|m| (x.at(m.cost.median), y.at(m.error.value))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
        let mut path = String::new();
        for (i, (x, y)) in points.iter().enumerate() {
            let step = if i == 0 {
                format!("M{},{}V{}", px(*x), px(frame[1]), px(*y))
            } else {
                format!("H{}V{}", px(*x), px(*y))
            };
            path.push_str(&step);
        }
        path.push_str(&format!("H{}", px(frame[2])));
        html! {
            path class="front-line" data-top=(px(frame[1])) data-right=(px(frame[2])) d=(path) {}
        }
    }

    fn curve(&self, curve: &Curve, x: &Scale, y: &Scale) -> Markup {
        let place = |m: &Mark| format!("{},{}", px(x.at(m.cost.median)), px(y.at(m.error.value)));
        let line: Vec<String> = curve.marks.iter().map(place).collect();
        let yes = |holds: bool| holds.then_some("");
        let kept = curve.facts.map(|(kept, _)| kept);
        html! {
            g class=(format!("curve {}", curve.style.class)) data-series=(curve.series)
                data-unbiased=[kept.and_then(|k| yes(k.unbiased))]
                data-same-expectation=[kept.and_then(|k| yes(k.same_expectation))]
                data-same-picture=[kept.and_then(|k| yes(k.same_picture))]
                data-one-pass=[curve.facts.and_then(|(_, passes)| yes(passes <= 1))] {
                @if line.len() > 1 {
                    polyline class="join" data-id=[self.whole(curve)] points=(line.join(" ")) {}
                }
                @for m in curve.marks.iter().filter(|m| m.marked) { (mark(m, curve, x, y)) }
            }
        }
    }

    /// The record of a curve that is all of one.
    fn whole<'a>(&self, curve: &'a Curve) -> Option<&'a str> {
        let first = curve.marks.first()?;
        let one = curve.marks.iter().all(|m| m.id == first.id);
        first.id.as_deref().filter(|_| one && curve.marks.len() > 1)
    }

    fn names_beside(&self, x: &Scale, y: &Scale, frame: [f64; 4]) -> Markup {
        let ends: Vec<(&Curve, [f64; 2])> = self
            .curves
            .iter()
            .filter_map(|c| c.marks.last().map(|m| (c, [x.at(m.cost.median), y.at(m.error.value)])))
            .collect();
        let heights: Vec<f64> = ends.iter().map(|(_, at)| at[1]).collect();
        let heights = column(&heights, frame[1] + 4.0, frame[3]);
        html! {
            g class="names" aria-hidden="true" {
                @for ((curve, at), height) in ends.iter().zip(heights) {
                    path class="leader" d=(format!("M{},{}L{},{}", px(at[0] + 7.0), px(at[1]), px(frame[2] + 18.0), px(height))) {}
                    text class=(format!("name {}", curve.style.class)) data-series=(curve.series)
                        x=(px(frame[2] + 22.0)) y=(px(height)) dy="0.32em" { (short(&curve.series)) }
                }
            }
        }
    }

    fn names_at(&self, count: u32, x: &Scale, y: &Scale, frame: [f64; 4]) -> Markup {
        let at = |m: &Mark| [x.at(m.cost.median), y.at(m.error.value)];
        let marks: Vec<[f64; 2]> = self.curves.iter().flat_map(|c| &c.marks).map(at).collect();
        // Names by points of the front first: they are what readers look for.
        let mut curves: Vec<&Curve> = self.curves.iter().filter(|c| !c.marks.is_empty()).collect();
        curves.sort_by_key(|c| !c.marks.iter().any(|m| m.front));
        let wanted: Vec<Wanted> = curves
            .iter()
            .filter_map(|c| {
                let own = c.marks.iter().find(|m| m.samples == Some(count));
                let mark = own.or(c.marks.last())?;
                Some(Wanted { at: at(mark), text: c.series.clone() })
            })
            .collect();
        let placed = place(&wanted, &marks, frame);
        html! {
            g class="names" aria-hidden="true" {
                @for ((curve, label), spot) in curves.iter().zip(&wanted).zip(placed) {
                    @if let Some(spot) = spot {
                        @if spot.leader {
                            @let width = 6.0 * label.text.chars().count() as f64;
                            @let near = label.at[0].clamp(spot.x, spot.x + width);
                            line class="leader" x1=(px(label.at[0])) y1=(px(label.at[1]))
                                x2=(px(near)) y2=(px(spot.y - 4.0)) {}
                        }
                        text class=(format!("name {}", curve.style.class)) data-series=(curve.series)
                            x=(px(spot.x)) y=(px(spot.y)) { (label.text) }
                    }
                }
            }
        }
    }
}

/// A name that fits its column.
fn short(name: &str) -> String {
    if name.chars().count() <= LETTERS {
        return name.to_string();
    }
    name.chars().take(LETTERS - 1).chain(['…']).collect()
}

/// A point with its intervals and its numbers.
fn mark(m: &Mark, curve: &Curve, x: &Scale, y: &Scale) -> Markup {
    let (at_x, at_y) = (x.at(m.cost.median), y.at(m.error.value));
    let exact = |v: f64| v.to_string();
    let spread = m.cost.low != m.cost.high;
    html! {
        g class=(if m.front { "pt front" } else { "pt" })
            transform=(format!("translate({},{})", px(at_x), px(at_y)))
            data-id=[m.id.as_deref()] data-samples=[m.samples]
            data-cost=(exact(m.cost.median))
            data-cost-low=[spread.then(|| exact(m.cost.low))]
            data-cost-high=[spread.then(|| exact(m.cost.high))]
            data-error=(exact(m.error.value)) data-low=(exact(m.error.low))
            data-high=(exact(m.error.high)) {
            title { (m.says) }
            @if m.error.low != m.error.high {
                path class="bar" d=(format!("M0,{}V{}", px(y.at(m.error.low) - at_y), px(y.at(m.error.high) - at_y))) {}
            }
            @if spread {
                path class="bar" d=(format!("M{},0H{}", px(x.at(m.cost.low) - at_x), px(x.at(m.cost.high) - at_x))) {}
            }
            path class="mk" d=(curve.style.marker) {}
        }
    }
}
