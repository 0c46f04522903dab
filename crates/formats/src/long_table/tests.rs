use std::path::Path;

use super::*;

fn columns() -> Vec<LongColumn<'static>> {
    // date -u -d 2026-11-22T07:17:29Z +%s
    let time = Some(1_795_331_849);
    let column = |name, values| LongColumn { name, values };
    vec![
        column("name", LongValues::Text(vec![Some("fc3"), Some("a \"b\", c"), None])),
        column("unit", LongValues::Text(vec![Some("N·m"), None, Some("kg")])),
        column("value", LongValues::Number(vec![Some(0.1 + 0.2), Some(f64::NAN), None])),
        column("result", LongValues::Count(vec![Some(7), None, Some(0)])),
        column("good", LongValues::Flag(vec![Some(true), None, Some(false)])),
        column("time", LongValues::Time(vec![time, None, Some(0)])),
    ]
}

fn write(format: LongFormat, parts: &[&[LongColumn<'_>]], output: &mut Vec<u8>) {
    let mut table = format.table(output).unwrap();
    parts.iter().for_each(|part| table.write(part).unwrap());
    table.finish().unwrap();
}

#[test]
fn a_table_in_parts_has_the_rows_of_all() {
    let folder = tempfile::tempdir().unwrap();
    let mut formats = vec![(LongFormat::Csv, "long.csv")];
    if cfg!(feature = "parquet") {
        formats.push((LongFormat::Parquet, "long.parquet"));
    }
    let part = columns();
    let empty: Vec<_> = vec![LongColumn { name: "name", values: LongValues::Text(Vec::new()) }];
    for (format, name) in formats {
        let path = folder.path().join(name);
        for (parts, rows) in [(vec![&part[..]; 3], 9), (vec![&part[..1], &empty[..]], 3)] {
            let mut bytes = Vec::new();
            write(format, &parts, &mut bytes);
            std::fs::write(&path, &bytes).unwrap();
            let mut read = Vec::new();
            read_long_table(&path, ["name"], |row| read.push(row)).unwrap();
            assert_eq!(read.len(), rows, "{name}");
            assert_eq!(read[rows - 3][0], "fc3");
        }
    }
}

#[test]
fn every_kind_of_value_is_written_as_text() {
    let mut bytes = Vec::new();
    write(LongFormat::Csv, &[&columns()], &mut bytes);
    let expected = "\
name,unit,value,result,good,time
fc3,N·m,0.30000000000000004,7,true,2026-11-22T07:17:29Z
\"a \"\"b\"\", c\",,,,,
,kg,,0,false,1970-01-01T00:00:00Z
";
    assert_eq!(String::from_utf8(bytes).unwrap(), expected);
}

#[test]
fn the_ending_says_the_format() {
    assert_eq!(LongFormat::from_path(Path::new("a.CSV")).unwrap(), LongFormat::Csv);
    let refused = |name: &str| LongFormat::from_path(Path::new(name)).unwrap_err().to_string();
    assert!(refused("a").contains(".parquet") && refused("a.xlsx").contains(".csv"));
    match LongFormat::from_path(Path::new("a.parquet")) {
        Ok(format) => assert_eq!((format, cfg!(feature = "parquet")), (LongFormat::Parquet, true)),
        Err(error) => assert!(error.to_string().contains("--features parquet"), "{error}"),
    }
}

#[test]
fn what_is_written_is_read_back_whatever_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let mut formats = vec![(LongFormat::Csv, "long.csv")];
    if cfg!(feature = "parquet") {
        formats.push((LongFormat::Parquet, "long.parquet"));
    }
    for (format, name) in formats {
        let path = folder.path().join(name);
        let mut bytes = Vec::new();
        write(format, &[&columns()], &mut bytes);
        std::fs::write(&path, &bytes).unwrap();
        let mut rows = Vec::new();
        let names = ["time", "value", "name", "good", "result"];
        read_long_table(&path, names, |row| rows.push(row)).unwrap();
        let expected = [
            ["2026-11-22T07:17:29Z", "0.30000000000000004", "fc3", "true", "7"],
            ["", "", "a \"b\", c", "", ""],
            ["1970-01-01T00:00:00Z", "", "", "false", "0"],
        ];
        assert_eq!(rows, expected, "{name}");
        let said = read_long_table(&path, ["mass"], drop).unwrap_err().to_string();
        assert!(said.contains("no column `mass`"), "{said}");
        std::fs::write(&path, &bytes[..bytes.len() - 30]).unwrap();
        assert!(read_long_table(&path, ["name", "time"], drop).is_err(), "{name} is cut off");
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(read_long_table(&path, ["name"], drop), Err(LongTableError::Io(_))));
    }
}

#[cfg(feature = "parquet")]
#[test]
fn what_is_written_as_parquet_is_read_back_with_its_types() {
    use ::parquet::file::reader::{FileReader as _, SerializedFileReader};
    use ::parquet::schema::printer::print_schema;

    let mut bytes = Vec::new();
    write(LongFormat::Parquet, &[&columns()], &mut bytes);
    let mut again = Vec::new();
    write(LongFormat::Parquet, &[&columns()], &mut again);
    assert!(bytes == again, "the same table, the same bytes");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.parquet");
    std::fs::write(&path, bytes).unwrap();
    let reader = SerializedFileReader::try_from(path.as_path()).unwrap();
    let mut schema = Vec::new();
    print_schema(&mut schema, reader.metadata().file_metadata().schema());
    let schema = String::from_utf8(schema).unwrap();
    for field in [
        "OPTIONAL BYTE_ARRAY name (STRING)",
        "OPTIONAL DOUBLE value",
        "OPTIONAL INT64 result",
        "OPTIONAL BOOLEAN good",
        "OPTIONAL INT64 time (TIMESTAMP(MILLIS,true))",
    ] {
        assert!(schema.contains(field), "{schema}");
    }
    let rows = reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string());
    let expected = [
        "{name: \"fc3\", unit: \"N·m\", value: 0.30000000000000004, result: 7, good: true, time: \
        2026-11-22 07:17:29.000 +00:00}",
        "{name: \"a \"b\", c\", unit: null, value: null, result: null, good: null, time: null}",
        "{name: null, unit: \"kg\", value: null, result: 0, good: false, time: 1970-01-01 \
        00:00:00.000 +00:00}",
    ];
    assert_eq!(rows.collect::<Vec<_>>(), expected);
}
