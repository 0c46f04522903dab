//! A long table as Parquet.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

use super::{LongColumn, LongValues};

pub(super) fn write(columns: &[LongColumn<'_>], output: &mut dyn Write) -> io::Result<()> {
    output.write_all(&bytes(columns).map_err(io::Error::other)?)
}

/// The file. Its library wants to own what it writes to; compressed it is a small part of the columns.
fn bytes(columns: &[LongColumn<'_>]) -> Result<Vec<u8>, ParquetError> {
    let fields = columns.iter().map(|column| field(column).map(Arc::new));
    let fields = fields.collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("didim").with_fields(fields).build()?;
    let compression = Compression::ZSTD(ZstdLevel::default());
    let properties = WriterProperties::builder().set_compression(compression).build();
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for column in columns {
        let missing = || ParquetError::General("the schema has fewer columns".to_owned());
        let mut open = group.next_column()?.ok_or_else(missing)?;
        match &column.values {
            LongValues::Text(values) => put::<ByteArrayType, _>(&mut open, values, ByteArray::from),
            LongValues::Number(values) => {
                let finite: Vec<_> =
                    values.iter().map(|value| value.filter(|value| value.is_finite())).collect();
                put::<DoubleType, _>(&mut open, &finite, |value| value)
            }
            LongValues::Count(values) => put::<Int64Type, _>(&mut open, values, u64::cast_signed),
            LongValues::Flag(values) => put::<BoolType, _>(&mut open, values, |value| value),
            LongValues::Time(values) => put::<Int64Type, _>(&mut open, values, |seconds| {
                seconds.saturating_mul(1000).cast_signed()
            }),
        }?;
        open.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

fn field(column: &LongColumn<'_>) -> Result<Type, ParquetError> {
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

fn put<T: DataType, V: Copy>(
    column: &mut SerializedColumnWriter<'_>,
    values: &[Option<V>],
    of: impl Fn(V) -> T::T,
) -> Result<usize, ParquetError> {
    let there: Vec<T::T> = values.iter().flatten().map(|value| of(*value)).collect();
    let levels: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    column.typed::<T>().write_batch(&there, Some(&levels), None)
}
