//! Which promises are kept on all scenes of a study.

use crate::study::record::{Kept, Record};
use crate::study::results::Results;

/// What a design keeps in all of its runs; `None` where it has none. A promise that asks for
/// distinct depths is kept where no scene has equal ones.
pub fn kept(results: &Results, series: &str) -> Option<Kept> {
    let own = results.records.iter().filter(|r| r.series == series);
    own.map(Record::kept).reduce(Kept::and)
}
