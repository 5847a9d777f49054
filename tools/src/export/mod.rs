//! A log in the formats of other programs: one file per format, and each reads the log once, a chunk at a time.

pub mod columns;
mod hgrm;
mod table;
mod trace;

use std::fmt::{self, Display, Formatter};
use std::io::Read;
use std::path::Path;

pub(crate) use hgrm::{TickDuration, export_percentiles};
pub use table::TableWriter;
pub(crate) use table::export_table;
pub use table::{export_rows, is_turned};
pub(crate) use trace::export_trace;

use palpate::log::LogReader;
use palpate::{Error, ErrorKind};

/// Nanoseconds as microseconds, to the last digit.
struct Micros(u64);

impl Display for Micros {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:03}", self.0 / 1000, self.0 % 1000)
    }
}

/// The output could not be written.
fn output_error(error: std::io::Error) -> Error {
    Error::io(Path::new("output"), error)
}

/// The log has nothing of the name `name`; `known` is what it has of that sort.
fn unknown<R: Read>(reader: &LogReader<R>, sort: &str, name: &str, known: &[&str]) -> Error {
    let known = if known.is_empty() { "it has none".to_owned() } else { format!("it has {}", known.join(", ")) };
    Error::new(ErrorKind::Log, format!("the log has no {sort} {name:?}; {known}")).at(reader.place())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn microseconds_keep_every_nanosecond() {
        assert_eq!(
            [0, 7, 1_001, 3_600_000_000_001].map(|ns| Micros(ns).to_string()),
            ["0.000", "0.007", "1.001", "3600000000.001"]
        );
    }
}
