//! docs/evidence/reliability.md: what the files of faults say, for people.

use super::file::{Expected, FaultFile, Tested, root};
use crate::table::{Column, Table};

fn check(name: &'static str, titles: &[&'static str], rows: Vec<Vec<String>>) {
    let columns = titles.iter().map(|title| Column::exact(title)).collect();
    Table { document: "reliability.md", name, columns, rows }.check();
}

#[test]
fn the_document_says_what_the_files_say() {
    let mut files = FaultFile::read_all();
    files.sort_by(|one, other| (&one.family, &one.name).cmp(&(&other.family, &other.name)));
    check(
        "faults",
        &[
            "of",
            "fault",
            "detected by",
            "within",
            "counted as",
            "result and verdict",
            "file or test",
        ],
        files
            .iter()
            .map(|file: &FaultFile| {
                let [by, within, counted, says] = match (&file.expected, &file.tested) {
                    (Some(expected), _) => executed(expected),
                    (_, Some(tested)) => checked_by_test(tested),
                    _ => unreachable!("a file is one of the two"),
                };
                vec![
                    file.family.clone(),
                    file.title.clone(),
                    by,
                    within,
                    counted,
                    says,
                    of_file(file),
                ]
            })
            .collect(),
    );
    let in_no_data = files.iter().filter_map(|file| {
        let covered = file.expected.as_ref()?.undetectable.as_ref()?;
        Some(vec![
            file.title.clone(),
            format!("`{} = {}`", covered.tolerance, covered.value),
            of_file(file),
        ])
    });
    check("in no data", &["fault", "tolerance that covers it", "file"], in_no_data.collect());
    let corrected = files
        .iter()
        .filter_map(|file| Some(vec![file.title.clone(), file.corrected.clone()?, of_file(file)]));
    check("corrected", &["fault", "why the expectation was wrong", "file"], corrected.collect());
}

/// The test that a row names is there, and its file reads the row: what the row expects has to be
/// asked for, or the test fails (tests/common/expectation.rs).
#[test]
fn the_named_tests_read_their_rows() {
    let mut rows = 0;
    for FaultFile { name, tested, .. } in FaultFile::read_all() {
        let Some(tested) = tested else { continue };
        let source = std::fs::read_to_string(root().join(&tested.file)).unwrap();
        for part in [format!("fn {}()", tested.test), format!("\"{name}\"")] {
            assert!(source.contains(&part), "{name}: no `{part}` in {}", tested.file);
        }
        assert!(!tested.expected.is_empty(), "{name}");
        rows += 1;
    }
    assert!(rows >= 46, "{rows}");
}

fn of_file(file: &FaultFile) -> String {
    match &file.tested {
        Some(tested) => format!("`{}`: `{}`", tested.file, tested.test),
        None => format!("`{}`", file.name),
    }
}

fn checked_by_test(tested: &Tested) -> [String; 4] {
    [&tested.detected_by, &tested.within, &tested.counted, &tested.outcome].map(Clone::clone)
}

fn executed(expected: &Expected) -> [String; 4] {
    let within = match (expected.within_cycles, expected.detected_by.as_str()) {
        (Some(1), _) => "1 cycle".to_owned(),
        (Some(cycles), _) => format!("{cycles} cycles"),
        (None, "nothing to detect" | "nobody") => "–".to_owned(),
        (None, _) => "the end of the window".to_owned(),
    };
    let counted = expected.counted.iter();
    let counted: Vec<String> =
        counted.map(|(cause, count)| format!("{cause} {}", count.shown())).collect();
    let counted = if counted.is_empty() { "nothing".to_owned() } else { counted.join(", ") };
    let mut windows = match expected.replay.is_empty() {
        true => "no window".to_owned(),
        false => expected.replay.iter().map(|of| said(of)).collect::<Vec<_>>().join(", then "),
    };
    windows += &format!("; offline {}", said(&expected.identify));
    if let Some(values) = &expected.physical_values {
        windows += &format!("; physical values {values}");
    }
    if let Some(words) = &expected.says {
        windows += &format!("; “{words}”");
    }
    [expected.detected_by.clone(), within, counted, windows]
}

/// A class in words.
fn said(class: &str) -> String {
    match class {
        "yes" | "no" => class.to_owned(),
        "safe" => "no, or yes and right".to_owned(),
        "refused" => "refused".to_owned(),
        "no-sample" => "refused: no sample".to_owned(),
        cause => format!("rejected ({cause})"),
    }
}
