//! A table as comma-separated values.
//!
//! Floats are printed in the shortest form that reads back exactly; durations and times inside `/timing` stay integer
//! nanoseconds.

use std::io::{self, Write};

use super::columns::{Cell, Column};

/// Writes the header line.
pub(super) fn header(columns: &[Column], out: &mut impl Write) -> io::Result<()> {
    for (place, (name, _)) in columns.iter().enumerate() {
        write!(out, "{}{name}", if place == 0 { "" } else { "," })?;
    }
    writeln!(out)
}

/// Writes one row.
pub(super) fn row(cells: &[Cell], out: &mut impl Write) -> io::Result<()> {
    for (place, cell) in cells.iter().enumerate() {
        if place > 0 {
            out.write_all(b",")?;
        }
        match cell {
            Cell::U64(value) => write!(out, "{value}")?,
            Cell::U32(value) => write!(out, "{value}")?,
            Cell::F64(value) => write!(out, "{value}")?,
            Cell::F32(value) => write!(out, "{value}")?,
            Cell::Word(word) => out.write_all(word.as_bytes())?,
            Cell::Text(text) => write!(out, "\"{}\"", text.replace('"', "\"\""))?,
            Cell::Missing => {}
        }
    }
    out.write_all(b"\n")
}
