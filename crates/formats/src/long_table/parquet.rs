//! A long table as Parquet.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::record::Field;
use parquet::schema::types::Type;

use super::column::{LongColumn, LongValues};
use super::error::LongTableError;
use super::text::instant_text;
use super::wanted::RequestedColumns;
use crate::guarded::catch_panic;

/// A table that is being written as Parquet. Each part is a row group.
pub(super) struct ParquetTable<'o> {
    /// The output, until the first part gives the schema.
    output: Option<&'o mut (dyn Write + Send)>,
    file: Option<SerializedFileWriter<&'o mut (dyn Write + Send)>>,
}

impl<'o> ParquetTable<'o> {
    pub(super) fn new(output: &'o mut (dyn Write + Send)) -> Self {
        Self { output: Some(output), file: None }
    }

    pub(super) fn write(&mut self, columns: &[LongColumn<'_>]) -> io::Result<()> {
        if let Some(output) = self.output.take() {
            self.file = Some(begin(columns, output).map_err(io::Error::other)?);
        } else if columns.iter().all(|column| column.values.is_empty()) {
            return Ok(());
        }
        match &mut self.file {
            Some(file) => write_group(file, columns).map_err(io::Error::other),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    pub(super) fn finish(self) -> io::Result<()> {
        if let Some(file) = self.file {
            file.close().map_err(io::Error::other)?;
        }
        Ok(())
    }
}

fn begin<W: Write + Send>(
    columns: &[LongColumn<'_>],
    output: W,
) -> Result<SerializedFileWriter<W>, ParquetError> {
    let fields = columns.iter().map(|column| schema_field(column).map(Arc::new));
    let fields = fields.collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("didim").with_fields(fields).build()?;
    let compression = Compression::ZSTD(ZstdLevel::default());
    let properties = WriterProperties::builder().set_compression(compression).build();
    SerializedFileWriter::new(output, Arc::new(schema), Arc::new(properties))
}

fn write_group<W: Write + Send>(
    file: &mut SerializedFileWriter<W>,
    columns: &[LongColumn<'_>],
) -> Result<(), ParquetError> {
    let mut group = file.next_row_group()?;
    for column in columns {
        let missing = || ParquetError::General("the schema has fewer columns".to_owned());
        let mut column_writer = group.next_column()?.ok_or_else(missing)?;
        match &column.values {
            LongValues::Text(values) => {
                write_values::<ByteArrayType, _>(&mut column_writer, values, ByteArray::from)
            }
            LongValues::Number(values) => {
                let finite: Vec<_> =
                    values.iter().map(|value| value.filter(|value| value.is_finite())).collect();
                write_values::<DoubleType, _>(&mut column_writer, &finite, |value| value)
            }
            LongValues::Count(values) => {
                write_values::<Int64Type, _>(&mut column_writer, values, u64::cast_signed)
            }
            LongValues::Flag(values) => {
                write_values::<BoolType, _>(&mut column_writer, values, |value| value)
            }
            LongValues::Time(values) => {
                write_values::<Int64Type, _>(&mut column_writer, values, |seconds| {
                    seconds.saturating_mul(1000).cast_signed()
                })
            }
        }?;
        column_writer.close()?;
    }
    group.close()?;
    Ok(())
}

fn schema_field(column: &LongColumn<'_>) -> Result<Type, ParquetError> {
    let (physical, logical) = match column.values {
        LongValues::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        LongValues::Number(_) => (Physical::DOUBLE, None),
        LongValues::Count(_) => (Physical::INT64, None),
        LongValues::Flag(_) => (Physical::BOOLEAN, None),
        LongValues::Time(_) => {
            (Physical::INT64, Some(LogicalType::timestamp(true, TimeUnit::MILLIS)))
        }
    };
    let field = Type::primitive_type_builder(column.name, physical);
    field.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build()
}

fn write_values<T: DataType, V: Copy>(
    column: &mut SerializedColumnWriter<'_>,
    values: &[Option<V>],
    of: impl Fn(V) -> T::T,
) -> Result<usize, ParquetError> {
    let present: Vec<T::T> = values.iter().flatten().map(|value| of(*value)).collect();
    let levels: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    column.typed::<T>().write_batch(&present, Some(&levels), None)
}

/// Reads row by row.
pub(super) fn read<const N: usize>(
    path: &Path,
    wanted: &mut RequestedColumns<'_, N>,
) -> Result<(), LongTableError> {
    catch_panic(
        || {
            let damaged = |error: ParquetError| LongTableError::Damaged(error.to_string());
            let reader = SerializedFileReader::new(File::open(path)?).map_err(damaged)?;
            let schema = reader.metadata().file_metadata().schema();
            let header: Vec<&str> = schema.get_fields().iter().map(|field| field.name()).collect();
            wanted.find(&header)?;
            for row in reader.get_row_iter(None).map_err(damaged)? {
                let row = row.map_err(damaged)?;
                wanted.take_row(row.get_column_iter().map(|(_, field)| text(field)).collect());
            }
            Ok(())
        },
        LongTableError::Damaged,
    )
}

fn text(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(text) => text.clone(),
        Field::TimestampMillis(ms) => {
            instant_text(Duration::from_millis(u64::try_from(*ms).unwrap_or_default()))
        }
        Field::Double(value) => value.to_string(),
        other => other.to_string(),
    }
}
