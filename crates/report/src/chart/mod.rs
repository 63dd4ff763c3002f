//! Charts as SVG that belongs to the page: colours are CSS classes, so that one chart serves
//! light, dark and print, and every mark carries its exact numbers. (`plotters`, the one
//! library that writes SVG, bakes colours in.)

mod alone;
mod labels;
mod plot;
mod rows;
mod scale;
mod style;

pub use alone::alone;
pub use plot::{Axis, Curve, Mark, Names, Plot};
pub use rows::{Bar, Row, Rows, Segment};
pub use scale::{Kind, Scale, Tick};
pub(crate) use style::swatch;
pub use style::{Style, Styles, key};

/// A position in a chart, to a twentieth of a unit: no screen shows more.
fn px(v: f64) -> String {
    let rounded = (v * 20.0).round() / 20.0;
    // No "-0".
    format!("{}", rounded + 0.0)
}
