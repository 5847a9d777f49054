//! The legacy format, up to version 5.1, ASCII and binary.

use super::cells::{Piece, joined};
use crate::error::{MeshError, quoted};
use crate::files::VolumeFile;
use crate::files::number::Number;
use crate::files::source::{Encoding, Source};

/// The volume mesh in `bytes`.
pub fn read(bytes: &[u8]) -> Result<VolumeFile, MeshError> {
    let mut source = Source::new(bytes);
    // The version is told by what follows, the title is for people.
    source.line();
    source.line();
    let encoding = match source.need("ASCII or BINARY")? {
        "ASCII" => Encoding::Text,
        "BINARY" => Encoding::BigEndian,
        other => return Err(source.error(format_args!("{} stands where ASCII or BINARY is needed", quoted(other)))),
    };
    let dataset = source.need("DATASET")?;
    let kind = source.need("the kind of data set")?;
    if (dataset, kind) != ("DATASET", "UNSTRUCTURED_GRID") {
        let message = format!("{} is no unstructured grid: a volume mesh is one", quoted(kind));
        return Err(source.error(message));
    }
    let mut reading = Reading { source, encoding, piece: Piece::default(), owner: None };
    reading.sections()?;
    joined([reading.piece])
}

struct Reading<'a> {
    source: Source<'a>,
    encoding: Encoding,
    piece: Piece,
    /// Whether the data that follow are of cells, and of how many cells or points.
    owner: Option<(bool, usize)>,
}

impl Reading<'_> {
    fn sections(&mut self) -> Result<(), MeshError> {
        while let Some(section) = self.source.word() {
            match section {
                "POINTS" => {
                    let count = self.count("number of points")?;
                    let kind = self.kind()?;
                    self.begin();
                    let points = self.source.floats(kind, count.saturating_mul(3), "a coordinate");
                    self.end();
                    self.piece.points = points?;
                }
                "CELLS" => self.cells()?,
                "CELL_TYPES" => {
                    let count = self.count("number of cell types")?;
                    self.piece.types = self.integers(Number::Int32, count, "the type of a cell")?;
                }
                "CELL_DATA" | "POINT_DATA" => {
                    let rows = self.count("number of cells or points")?;
                    self.owner = Some((section == "CELL_DATA", rows));
                }
                _ => {
                    // Where data cannot be read for groups, the mesh still is what it is.
                    if !self.data(section)? {
                        break;
                    }
                }
            }
        }
        Ok(())
    }

    /// Since version 5 offsets and connectivity apart, before a list in which each cell begins with the number of its points.
    fn cells(&mut self) -> Result<(), MeshError> {
        let first = self.count("number of cells")?;
        let second = self.count("size of the list of cells")?;
        if self.source.peek() == Some("OFFSETS") {
            self.source.word();
            let kind = self.kind()?;
            let ends = self.integers(kind, first, "the offset of a cell")?;
            self.piece.ends = ends.into_iter().skip(1).collect();
            let word = self.source.need("CONNECTIVITY")?;
            if word != "CONNECTIVITY" {
                return Err(self.source.error(format_args!("{} stands where CONNECTIVITY is needed", quoted(word))));
            }
            let kind = self.kind()?;
            self.piece.connectivity = self.integers(kind, second, "a point of a cell")?;
            return Ok(());
        }
        let list = self.integers(Number::Int32, second, "a point of a cell")?;
        let mut rest = &list[..];
        while let [count, after @ ..] = rest {
            let Some(points) = usize::try_from(*count).ok().and_then(|count| after.get(..count)) else {
                return Err(self.source.error(format_args!("cell {} has {count} points", self.piece.ends.len())));
            };
            self.piece.connectivity.extend(points);
            self.piece.ends.push(self.piece.connectivity.len() as i64);
            rest = &after[points.len()..];
        }
        Ok(())
    }

    /// Reads what `section` brings; false if it is not known how long it is.
    fn data(&mut self, section: &str) -> Result<bool, MeshError> {
        let rows = self.owner.map_or(0, |(_, rows)| rows);
        match section {
            "METADATA" => {
                self.source.line();
                // It ends with an empty line.
                while self.source.line().is_some_and(|line| !line.is_empty()) {}
                Ok(true)
            }
            "FIELD" => self.field(),
            "LOOKUP_TABLE" => {
                self.source.need("the name of a table")?;
                let colours = self.count("number of colours")?;
                self.array("", 4, colours, "unsigned_char")
            }
            "SCALARS" => {
                let (name, kind) = self.name_and_kind()?;
                let columns = self.source.line().unwrap_or_default().parse().unwrap_or(1);
                if self.source.peek() == Some("LOOKUP_TABLE") {
                    self.source.word();
                    self.source.need("the name of a table")?;
                }
                self.array(name, columns, rows, kind)
            }
            "GLOBAL_IDS" | "PEDIGREE_IDS" | "VECTORS" | "NORMALS" | "TENSORS" => {
                let (name, kind) = self.name_and_kind()?;
                let columns = match section {
                    "VECTORS" | "NORMALS" => 3,
                    "TENSORS" => 9,
                    _ => 1,
                };
                self.array(name, columns, rows, kind)
            }
            _ => Ok(false),
        }
    }

    /// Several arrays, each with its name, size and kind.
    fn field(&mut self) -> Result<bool, MeshError> {
        self.source.need("the name of a field")?;
        let mut arrays = self.count("number of arrays")?;
        while arrays > 0 {
            if self.source.peek() == Some("METADATA") {
                self.source.word();
                self.data("METADATA")?;
                continue;
            }
            let name = self.source.need("the name of an array")?;
            let columns = self.count("number of columns")?;
            let rows = self.count("number of rows")?;
            let kind = self.source.need("the kind of numbers")?;
            if !self.array(name, columns, rows, kind)? {
                return Ok(false);
            }
            arrays -= 1;
        }
        Ok(true)
    }

    fn name_and_kind<'b>(&mut self) -> Result<(&'b str, &'b str), MeshError>
    where
        Self: 'b,
    {
        Ok((self.source.need("the name of an array")?, self.source.need("the kind of numbers")?))
    }

    /// Reads an array, and keeps it if it is one whole number for each cell; false if it is not known how long it is.
    fn array(&mut self, name: &str, columns: usize, rows: usize, kind: &str) -> Result<bool, MeshError> {
        let count = columns.saturating_mul(rows);
        if kind == "string" {
            return self.skip_strings(count).map(|()| true);
        }
        let Some(kind) = number(kind) else { return Ok(false) };
        self.begin();
        let is_of_cells = self.owner == Some((true, rows));
        let read = if kind.is_integer() && columns == 1 && is_of_cells {
            let values = self.source.integers(kind, count, "a number of an array");
            values.map(|values| self.piece.keep_array(&decoded(name), values))
        } else {
            self.source.floats(kind, count, "a number of an array").map(|_| ())
        };
        self.end();
        read.map(|()| true)
    }

    /// Strings: each on a line, or behind its length, whose first two bits say how wide that is.
    fn skip_strings(&mut self, count: usize) -> Result<(), MeshError> {
        self.source.line();
        for _ in 0..count {
            if self.encoding == Encoding::Text {
                self.source.line().ok_or_else(|| self.source.error("the file ends where a string is needed"))?;
                continue;
            }
            self.source.encoding = self.encoding;
            let first = self.source.count(Number::UInt8, "length of a string")?;
            let mut length = first & 63;
            for _ in 0..[7, 3, 1, 0][first >> 6] {
                length = length << 8 | self.source.count(Number::UInt8, "length of a string")?;
            }
            let read = self.source.integers(Number::UInt8, length, "a character");
            self.end();
            read?;
        }
        Ok(())
    }

    fn count(&mut self, what: &str) -> Result<usize, MeshError> {
        self.source.parse(&format!("the {what}"))
    }

    fn kind(&mut self) -> Result<Number, MeshError> {
        let word = self.source.need("the kind of numbers")?;
        number(word).ok_or_else(|| self.source.error(format_args!("{} is no kind of numbers", quoted(word))))
    }

    fn integers(&mut self, kind: Number, count: usize, what: &str) -> Result<Vec<i64>, MeshError> {
        self.begin();
        let values = self.source.integers(kind, count, what);
        self.end();
        values
    }

    /// In a binary file numbers follow the end of the line.
    fn begin(&mut self) {
        if self.encoding != Encoding::Text {
            self.source.line();
            self.source.encoding = self.encoding;
        }
    }

    fn end(&mut self) {
        self.source.encoding = Encoding::Text;
    }
}

/// The kind of numbers by its name in C.
fn number(name: &str) -> Option<Number> {
    Some(match name {
        "char" | "signed_char" | "vtktypeint8" => Number::Int8,
        "unsigned_char" | "vtktypeuint8" => Number::UInt8,
        "short" | "vtktypeint16" => Number::Int16,
        "unsigned_short" | "vtktypeuint16" => Number::UInt16,
        "int" | "vtktypeint32" => Number::Int32,
        "unsigned_int" | "vtktypeuint32" => Number::UInt32,
        "vtkIdType" => Number::Int32,
        "long" | "vtktypeint64" => Number::Int64,
        "unsigned_long" | "vtktypeuint64" => Number::UInt64,
        "float" => Number::Float32,
        "double" => Number::Float64,
        _ => return None,
    })
}

/// A name in which what is no letter may stand as % and its number in hexadecimal.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let [first, after @ ..] = rest {
        let code = after.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        match code.and_then(|digits| u8::from_str_radix(digits, 16).ok()).filter(|_| *first == b'%') {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_decoded() {
        assert_eq!(decoded("gmsh%3aphysical"), "gmsh:physical");
        assert_eq!(decoded("100%25%zz%4"), "100%%zz%4");
    }
}
