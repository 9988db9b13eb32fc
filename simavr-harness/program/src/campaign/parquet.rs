//! Writes a table as Parquet, whose columns have types.

use std::error::Error;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};
use serde_json::Value;

use super::results::{Row, cell};

/// The type of a column: the first kind that fits all its values. A column without values has numbers, except
/// [`CORE`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Truth,
    Whole,
    /// Whole numbers from 0 to 2^64 - 1, such as seeds.
    Unsigned,
    Number,
    Text,
}

/// The one column of words that has no value in the campaigns of the native engine.
const CORE: &str = "core";

/// `rows` as Parquet. A missing value is null.
///
/// # Errors
/// None: writing to memory does not fail.
pub fn parquet(columns: &[String], rows: &[Row]) -> Result<Vec<u8>, Box<dyn Error>> {
    let kinds: Vec<Kind> = columns.iter().map(|column| kind(rows, column)).collect();
    let fields = columns.iter().zip(&kinds).map(|(column, kind)| field(column, *kind));
    let fields = fields.collect::<Result<Vec<TypePtr>, _>>()?;
    let schema = Type::group_type_builder("runs").with_fields(fields).build()?;
    let properties = Arc::new(WriterProperties::default());
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), properties)?;
    let mut group = writer.next_row_group()?;
    for (column, kind) in columns.iter().zip(kinds) {
        let mut to = group.next_column()?.ok_or("a column is missing")?;
        let values = || rows.iter().map(|row| row.get(column).filter(|value| !value.is_null()));
        match kind {
            Kind::Truth => put::<BoolType>(&mut to, values().map(|value| value?.as_bool()))?,
            Kind::Whole => put::<Int64Type>(&mut to, values().map(|value| value?.as_i64()))?,
            // The same 64 bits; the column's logical type makes them unsigned.
            Kind::Unsigned => put::<Int64Type>(&mut to, values().map(|value| Some(value?.as_u64()? as i64)))?,
            Kind::Number => put::<DoubleType>(&mut to, values().map(|value| value?.as_f64()))?,
            Kind::Text => {
                let text = |value: &Value| ByteArray::from(cell(Some(value)).into_bytes());
                put::<ByteArrayType>(&mut to, values().map(|value| value.map(text)))?;
            }
        }
        to.close()?;
    }
    group.close()?;
    Ok(writer.into_inner()?)
}

fn kind(rows: &[Row], column: &str) -> Kind {
    let values = || rows.iter().filter_map(|row| row.get(column)).filter(|value| !value.is_null());
    if values().next().is_none() {
        // The type of the column in other campaigns, so that the tables of several campaigns fit together.
        if column == CORE { Kind::Text } else { Kind::Number }
    } else if values().all(Value::is_boolean) {
        Kind::Truth
    } else if values().all(Value::is_i64) {
        Kind::Whole
    } else if values().all(Value::is_u64) {
        Kind::Unsigned
    } else if values().all(Value::is_number) {
        Kind::Number
    } else {
        Kind::Text
    }
}

fn field(name: &str, kind: Kind) -> Result<TypePtr, Box<dyn Error>> {
    let (physical, logical) = match kind {
        Kind::Truth => (Physical::BOOLEAN, None),
        Kind::Whole => (Physical::INT64, None),
        Kind::Unsigned => (Physical::INT64, Some(LogicalType::integer(64, false))),
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    Ok(Arc::new(builder.with_logical_type(logical).build()?))
}

/// Writes a column. `None` is a missing value.
fn put<T: DataType>(
    to: &mut SerializedColumnWriter<'_>,
    values: impl Iterator<Item = Option<T::T>>,
) -> Result<(), Box<dyn Error>> {
    let values: Vec<Option<T::T>> = values.collect();
    let levels: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    to.typed::<T>().write_batch(&values, Some(&levels), None)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;
    use serde_json::json;

    #[test]
    fn a_column_without_a_value_is_of_numbers() {
        let rows = [json!({ "null": null }).as_object().expect("an object").clone()];
        assert_eq!(["null", "missing"].map(|column| kind(&rows, column)), [Kind::Number; 2]);
    }

    #[test]
    fn what_executes_images_is_told_in_words_also_where_there_are_none() {
        let rows = [json!({ "core": null }), json!({ "core": "decoded" })];
        let rows = rows.map(|row| row.as_object().expect("an object").clone());
        assert_eq!([&rows[..1], &rows[1..]].map(|rows| kind(rows, "core")), [Kind::Text; 2]);
    }

    #[test]
    fn what_is_written_is_read_again_with_its_types() {
        let row = |value: Value| value.as_object().expect("an object").clone();
        let rows = [
            row(json!({ "run": "a", "right": true, "seed": 1, "hop": 2, "mixed": 1, "far": u64::MAX })),
            row(json!({ "run": "b", "right": null, "seed": 2, "hop": 2.5, "mixed": "one", "far": 3 })),
        ];
        let columns = ["run", "right", "seed", "hop", "mixed", "far"].map(String::from);
        let file = parquet(&columns, &rows).expect("it can be written");
        let reader = SerializedFileReader::new(bytes::Bytes::from(file)).expect("it is Parquet");
        let read = reader.get_row_iter(None).expect("it has rows").map(|row| row.expect("a row"));
        let read: Vec<Vec<(String, Field)>> = read.map(|row| row.into_columns()).collect();
        let text = |text: &str| Field::Str(text.into());
        let expected = [
            [
                text("a"),
                Field::Bool(true),
                Field::Long(1),
                Field::Double(2.0),
                text("1"),
                Field::ULong(u64::MAX),
            ],
            [text("b"), Field::Null, Field::Long(2), Field::Double(2.5), text("one"), Field::ULong(3)],
        ];
        let expected = expected.map(|row| columns.clone().into_iter().zip(row).collect::<Vec<_>>());
        assert_eq!(read, expected);
    }
}
