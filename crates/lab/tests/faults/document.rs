//! docs/evidence/reliability.md: what the files of faults say, for people.

use super::file::{CoveredBy, Expected, FaultFile, root};
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
                let [by, within, counted, says] = match (&file.expected, &file.covered_by) {
                    (Some(expected), _) => executed(expected),
                    (_, Some(covered_by)) => checked_by_test(covered_by),
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

/// A row names a test that asserts what the row says.
#[test]
fn the_named_tests_contain_the_words_of_their_rows() {
    let mut inspected = 0;
    for file in FaultFile::read_all() {
        let Some(covered_by) = &file.covered_by else { continue };
        let source = std::fs::read_to_string(root().join(&covered_by.file)).unwrap();
        let begin = source.find(&format!("fn {}(", covered_by.test));
        let body = begin.map(|begin| &source[begin..]).unwrap_or_default();
        assert!(!body.is_empty(), "{}: {} has no such test", file.name, covered_by.file);
        let body = body.split("#[test]").next().unwrap();
        for words in &covered_by.words {
            assert!(body.contains(words.as_str()), "{}: no `{words}` in {body}", file.name);
            inspected += 1;
        }
    }
    assert!(inspected >= 20, "{inspected}");
}

fn of_file(file: &FaultFile) -> String {
    match &file.covered_by {
        Some(covered_by) => format!("`{}`: `{}`", covered_by.file, covered_by.test),
        None => format!("`{}`", file.name),
    }
}

fn checked_by_test(covered_by: &CoveredBy) -> [String; 4] {
    [&covered_by.detected_by, &covered_by.within, &covered_by.counted, &covered_by.says]
        .map(Clone::clone)
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
