//! A table as Apache Parquet.
//!
//! Columns have the names of the CSV, with their units, and the types of the log. Integers are written as differences,
//! which for times and counters are small; words as a dictionary; doubles as they are. Row groups are written as they
//! fill, so memory does not grow with the log.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use palpate::{Error, ErrorKind};
use palpate_cli::TableWriter;
use palpate_cli::columns::{Cell, ColumnType};
use parquet::basic::{Encoding, LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::{WriterProperties, WriterPropertiesBuilder};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type as SchemaType};

/// Rows of a row group: some megabytes in memory.
const GROUP_ROWS: usize = 1 << 17;

pub(super) struct ParquetTable<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    /// The cells of the row group in the making, by column.
    columns: Vec<Values>,
    rows: usize,
}

/// The cells of one column.
enum Values {
    I64(Vec<i64>),
    I32(Vec<i32>),
    /// The numbers there are, and for each row whether it has one.
    OptionalI32(Vec<i32>, Vec<i16>),
    F64(Vec<f64>),
    F32(Vec<f32>),
    Text(Vec<ByteArray>),
}

impl<W: Write + Send> ParquetTable<W> {
    pub(super) fn new(columns: &[(&'static str, ColumnType)], out: W) -> Result<Self, Error> {
        let fields: Result<Vec<_>, _> = columns.iter().map(|column| field(*column).map(Arc::new)).collect();
        let schema = fields.and_then(|fields| SchemaType::group_type_builder("schema").with_fields(fields).build());
        let properties = columns.iter().fold(
            WriterProperties::builder().set_created_by(concat!("palpate ", env!("CARGO_PKG_VERSION")).to_owned()),
            encoded,
        );
        let writer = schema
            .and_then(|schema| SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties.build())))
            .map_err(write_error)?;
        Ok(Self { writer, columns: columns.iter().map(|(_, kind)| Values::new(*kind)).collect(), rows: 0 })
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        if self.rows == 0 {
            return Ok(());
        }
        self.rows = 0;
        let mut group = self.writer.next_row_group()?;
        for values in &mut self.columns {
            if let Some(mut column) = group.next_column()? {
                values.write(column.untyped())?;
                column.close()?;
            }
        }
        group.close().map(|_| ())
    }
}

impl<W: Write + Send> TableWriter for ParquetTable<W> {
    fn row(&mut self, cells: &mut Vec<Cell>) -> Result<(), Error> {
        for (values, cell) in self.columns.iter_mut().zip(cells.drain(..)) {
            values.push(cell);
        }
        self.rows += 1;
        if self.rows == GROUP_ROWS { self.write_group().map_err(write_error) } else { Ok(()) }
    }

    fn finish(mut self) -> Result<(), Error> {
        self.write_group().and_then(|()| self.writer.finish().map(|_| ())).map_err(write_error)
    }
}

/// The field of a column in the file's schema.
fn field((name, kind): (&str, ColumnType)) -> Result<SchemaType, ParquetError> {
    let unsigned = |bit_width| Some(LogicalType::integer(bit_width, false));
    let (physical, logical) = match kind {
        ColumnType::U64 => (Physical::INT64, unsigned(64)),
        ColumnType::U32 | ColumnType::OptionalU32 => (Physical::INT32, unsigned(32)),
        ColumnType::F64 => (Physical::DOUBLE, None),
        ColumnType::F32 => (Physical::FLOAT, None),
        ColumnType::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let repetition = if kind == ColumnType::OptionalU32 { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    SchemaType::primitive_type_builder(name, physical).with_repetition(repetition).with_logical_type(logical).build()
}

/// How a column is encoded.
fn encoded(properties: WriterPropertiesBuilder, &(name, kind): &(&'static str, ColumnType)) -> WriterPropertiesBuilder {
    let path = ColumnPath::from(name);
    match kind {
        ColumnType::U64 | ColumnType::U32 | ColumnType::OptionalU32 => properties
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED),
        ColumnType::F64 | ColumnType::F32 => properties.set_column_dictionary_enabled(path, false),
        ColumnType::Text => properties,
    }
}

impl Values {
    fn new(kind: ColumnType) -> Self {
        match kind {
            ColumnType::U64 => Self::I64(Vec::new()),
            ColumnType::U32 => Self::I32(Vec::new()),
            ColumnType::OptionalU32 => Self::OptionalI32(Vec::new(), Vec::new()),
            ColumnType::F64 => Self::F64(Vec::new()),
            ColumnType::F32 => Self::F32(Vec::new()),
            ColumnType::Text => Self::Text(Vec::new()),
        }
    }

    /// Adds a cell of the column's type.
    fn push(&mut self, cell: Cell) {
        // Unsigned numbers are stored by their bits; the logical type says what they are.
        match (self, cell) {
            (Self::I64(values), Cell::U64(value)) => values.push(value.cast_signed()),
            (Self::I32(values), Cell::U32(value)) => values.push(value.cast_signed()),
            (Self::OptionalI32(values, levels), Cell::U32(value)) => {
                values.push(value.cast_signed());
                levels.push(1);
            }
            (Self::OptionalI32(_, levels), Cell::Missing) => levels.push(0),
            (Self::F64(values), Cell::F64(value)) => values.push(value),
            (Self::F32(values), Cell::F32(value)) => values.push(value),
            (Self::Text(values), Cell::Word(word)) => values.push(ByteArray::from(word)),
            (Self::Text(values), Cell::Text(text)) => values.push(ByteArray::from(text.into_bytes())),
            // A column that is short of a cell fails as a whole when it is written.
            (_, cell) => debug_assert!(false, "{cell:?} in a column of another type"),
        }
    }

    /// Writes the cells and forgets them.
    fn write(&mut self, column: &mut ColumnWriter<'_>) -> Result<(), ParquetError> {
        match (&*self, column) {
            (Self::I64(values), ColumnWriter::Int64ColumnWriter(to)) => to.write_batch(values, None, None),
            (Self::I32(values), ColumnWriter::Int32ColumnWriter(to)) => to.write_batch(values, None, None),
            (Self::OptionalI32(values, levels), ColumnWriter::Int32ColumnWriter(to)) => {
                to.write_batch(values, Some(levels), None)
            }
            (Self::F64(values), ColumnWriter::DoubleColumnWriter(to)) => to.write_batch(values, None, None),
            (Self::F32(values), ColumnWriter::FloatColumnWriter(to)) => to.write_batch(values, None, None),
            (Self::Text(values), ColumnWriter::ByteArrayColumnWriter(to)) => to.write_batch(values, None, None),
            _ => Err(ParquetError::General("a column is not of its type".into())),
        }?;
        match self {
            Self::I64(values) => values.clear(),
            Self::I32(values) => values.clear(),
            Self::OptionalI32(values, levels) => {
                values.clear();
                levels.clear();
            }
            Self::F64(values) => values.clear(),
            Self::F32(values) => values.clear(),
            Self::Text(values) => values.clear(),
        }
        Ok(())
    }
}

fn write_error(error: ParquetError) -> Error {
    match error {
        ParquetError::External(source) => match source.downcast::<std::io::Error>() {
            Ok(error) => Error::io(Path::new("output"), *error),
            Err(other) => Error::new(ErrorKind::Io, format!("the table cannot be written: {other}")),
        },
        other => Error::new(ErrorKind::Io, format!("the table cannot be written: {other}")),
    }
}
