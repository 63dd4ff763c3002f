//! From a trace and a plan to measured records: what every report is made of.

pub mod analysis;
pub mod comparison;
pub mod engine;
pub mod explained;
pub mod file;
pub mod machine;
pub mod measure;
pub mod publications;
pub mod record;
pub mod results;
pub mod run;
pub mod shadows;
pub mod stress;
mod subject;
pub mod throughput;
