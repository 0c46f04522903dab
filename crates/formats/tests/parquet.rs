//! Parquet files of other writers (golden/parquet.py), held against the same motion as text.

use std::fs;
use std::path::{Path, PathBuf};

use didim_formats::{
    AxisColumns, Columns, Side, Table, TableError, TimeColumns, list_table, read_rows, read_table,
};

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

fn file(name: &str) -> PathBuf {
    golden(&format!("parquet_{name}.parquet"))
}

fn columns(second: f64) -> Columns {
    let columns_of = |name: &str, scale: f64| AxisColumns {
        names: vec![name.to_owned()],
        scales: vec![scale, -2.0 * scale],
        zeros: Vec::new(),
        wraps: Vec::new(),
    };
    Columns {
        side: Side::Joint,
        axes: 2,
        time: Some(TimeColumns::Numbers { column: "t_ms".into(), second }),
        position: columns_of("q_{axis}", 0.5),
        torque: columns_of("tau_{index}", 3.0),
        reference: None,
    }
}

fn rows(path: &Path, columns: &Columns) -> Result<Table, TableError> {
    read_rows(path, Some(columns))
}

fn text() -> Table {
    rows(&golden("parquet.csv"), &columns(1e-3)).unwrap()
}

#[test]
fn a_table_is_the_same_in_text_and_in_parquet_whichever_program_wrote_it() {
    let record = |path: &Path| read_table(path, None, 250.0, Some(&columns(1e-3))).unwrap();
    let text = record(&golden("parquet.csv"));
    for name in ["none", "snappy", "gzip", "zstd", "lz4", "plain", "split", "polars"] {
        assert_eq!(record(&file(name)), text, "{name}");
    }
    let measurement = text.into_whole().unwrap();
    assert_eq!((measurement.samples(), measurement.signals.sample_rate_hz.round()), (120, 250.0));
    // didim's own columns are known by their names.
    let names = list_table(&file("own")).unwrap();
    assert_eq!(
        (names.own_format, names.seconds_per_unit),
        (Some((Side::Joint, true)), vec![None; 3])
    );
    let own_measurement =
        read_table(&file("own"), None, 250.0, None).unwrap().into_whole().unwrap();
    assert_eq!(
        own_measurement.signals.position_rad[0],
        measurement.signals.position_rad[0].iter().map(|q| q / 0.5).collect::<Vec<_>>()
    );
}

#[test]
fn types_show_units_of_times_and_how_numbers_are_stored() {
    let text = text();
    fn near(a: &[f64], b: &[f64], most: f64) {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most), "{a:?} {b:?}");
    }
    for (name, second) in [("stamps_ms", 1e-3), ("stamps_us", 1e-6), ("stamps_ns", 1e-9)] {
        assert_eq!(list_table(&file(name)).unwrap().seconds_per_unit[0], Some(second));
        let table = rows(&file(name), &columns(second)).unwrap();
        near(table.time.as_ref().unwrap(), text.time.as_ref().unwrap(), 1e-15);
        for (quantity, most) in [(0, 6e-8), (1, 4e-7)] {
            for axis in 0..2 {
                let (own, other) = (&table.signals[quantity][axis], &text.signals[quantity][axis]);
                near(own, other, most);
            }
        }
        let record = read_table(&file(name), None, 250.0, Some(&columns(second))).unwrap();
        assert_eq!(record.into_whole().unwrap().samples(), 120, "{name}");
        let wrong = if second < 1e-3 { 1e-3 } else { 1.0 };
        let said = rows(&file(name), &columns(wrong)).unwrap_err().to_string();
        let unit = &name["stamps_".len()..];
        assert!(said.contains(&format!("seconds ({unit}) by its type, and ")), "{said}");
    }
    for (name, offset) in [("unsigned", 2f64.powi(32) - 5.0), ("unsigned_64", 2f64.powi(63))] {
        let table = rows(&file(name), &columns(1e-3)).unwrap();
        assert_eq!(table.time, text.time);
        let expected: Vec<f64> =
            text.signals[1][0].iter().map(|tau| 3.0 * (tau / 3.0 + offset)).collect();
        assert_eq!(table.signals[1][0], expected, "{name}");
    }
}

#[test]
fn what_has_no_numbers_is_refused_with_the_reason_and_passed_over_where_nobody_asks() {
    let said = |torque: &str| {
        let mut columns = columns(1e-3);
        columns.torque.names = vec!["tau_x".into(), torque.into()];
        columns.position.names = vec!["q_1".into(), "q_2".into()];
        columns.torque.names[0] = if torque == "t_ms" { "q_1" } else { "t_ms" }.into();
        columns.time = None;
        rows(&file("other"), &columns).unwrap_err().to_string()
    };
    for (column, why) in [
        ("mode", "column `mode` holds text or bytes, and numbers are wanted"),
        ("flag", "`flag` holds what is true or false"),
        ("day", "`day` holds dates"),
        ("pair", "`pair` holds nested values"),
        ("half", "`half` holds numbers of half precision"),
        ("money", "`money` holds decimals of a fixed scale"),
        ("tau_2", "column `tau_2` is missing; the header has t_ms q_1 q_2"),
    ] {
        let said = said(column);
        assert!(said.contains(why) && said.contains("parquet_other.parquet: "), "{said}");
    }
    let said = rows(&file("int96"), &columns(1e-9)).unwrap_err().to_string();
    assert!(said.contains("`t_ms` holds times of the outdated type INT96"), "{said}");
    let said = read_table(&file("other"), None, 250.0, None).unwrap_err().to_string();
    assert!(said.contains("column `t_ms` is not known"), "{said}");
}

#[test]
fn an_element_of_a_list_is_a_column() {
    let mut columns = columns(1e-3);
    columns.torque.names = vec!["pose[0]".into(), "pose[1]".into()];
    columns.position.names = vec!["q_1".into(), "q_2".into()];
    columns.time = None;
    let [_, torque, _] = rows(&file("other"), &columns).unwrap().signals;
    let rows = (0u32..).zip(&torque[0]);
    assert!(rows.clone().all(|(row, value)| (value - 3.0 * f64::from(row)).abs() < 1e-12));
    assert_eq!(torque[1], vec![0.0; torque[0].len()]);
}

/// Null and NaN, empty fields and NaN: the same rows are no samples.
#[test]
fn rows_that_lack_a_value_are_left_out_alike_in_text_and_in_parquet() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.csv");
    let table = fs::read_to_string(golden("parquet.csv")).unwrap();
    fs::write(
        &path,
        table
            .lines()
            .enumerate()
            .map(|(row, line): (usize, &str)| {
                let mut fields: Vec<&str> = line.split(',').collect();
                match row {
                    78 => fields[3] = "",
                    100 => fields[4] = "nan",
                    _ => {}
                }
                fields.join(",") + "\n"
            })
            .collect::<String>(),
    )
    .unwrap();
    let [text, parquet] = [path, file("other")]
        .map(|path| read_table(&path, Some(250.0), 250.0, Some(&columns(1e-3))).unwrap());
    assert_eq!((&parquet.segments, parquet.resampled), (&text.segments, text.resampled));
    let said = [&text, &parquet].map(|record| record.missing_values.as_ref().unwrap().to_string());
    assert_eq!(
        said,
        ["line 79", "row 78"].map(|place| format!(
            "2 of 120 rows lack a value, the first in {place}, column `tau_0`; they are no samples"
        ))
    );
    // Each is missing alone.
    assert_eq!((parquet.segments.len(), parquet.resampled.interpolated_rows), (1, 2));
}

/// Cut off or damaged anywhere, compressed or not: read or refused in words, and never more than it
/// says.
#[test]
fn a_damaged_file_is_an_error_and_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let spoiled = folder.path().join("spoiled.parquet");
    let (mut refused, mut read) = (0, 0);
    for name in ["plain", "snappy", "gzip", "zstd", "lz4", "split", "polars", "stamps_ns"] {
        let contents = fs::read(file(name)).unwrap();
        let footer = contents.len()
            - 8
            - u32::from_le_bytes(
                contents[contents.len() - 8..contents.len() - 4].try_into().unwrap(),
            ) as usize;
        // The footer says how all else is read.
        let places = (4..footer).step_by(101).chain((footer..contents.len()).step_by(13));
        for at in places {
            let mut damaged = [contents.clone(), contents.clone(), contents[..at].to_vec()];
            damaged[0][at] ^= 0x55;
            damaged[1][at] = 0xff;
            for bytes in damaged {
                fs::write(&spoiled, bytes).unwrap();
                match rows(&spoiled, &columns(if name == "stamps_ns" { 1e-9 } else { 1e-3 })) {
                    Ok(table) => {
                        read += 1;
                        assert!(table.time.unwrap().len() <= 120);
                    }
                    Err(error) => {
                        refused += 1;
                        assert!(error.to_string().contains("spoiled.parquet: "), "{error}");
                    }
                }
            }
        }
    }
    assert!(refused > 1000 && read > 300, "{refused} refused, {read} read");
}
