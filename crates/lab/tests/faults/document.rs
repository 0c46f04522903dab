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

/// Returns the lines of a function, from its name to its end, as rustfmt indents it.
fn function<'a>(source: &'a [&str], name: &str) -> Option<&'a [&'a str]> {
    let start = source.iter().position(|line| line.contains(&format!("fn {name}(")))?;
    let end =
        start + 1 + source[start + 1..].iter().position(|line| is_end_of(source[start], line))?;
    Some(&source[start..=end])
}

fn indentation(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// True if the line is the last one of the item or statement that begins with `first`.
fn is_end_of(first: &str, line: &str) -> bool {
    !line.trim().is_empty() && indentation(line) == indentation(first) && !line.ends_with('{')
}

/// Returns the lines of a test and of the functions of its file that it names.
fn body_of(source: &[&str], test: &str) -> Vec<String> {
    let all = source.iter().filter_map(|line| line.split_once("fn ")?.1.split('(').next());
    let names: Vec<&str> = all.filter(|name| name.len() > 3).collect();
    let mut taken = vec![test];
    let mut lines = Vec::new();
    let mut next = 0;
    while let Some(name) = taken.get(next) {
        next += 1;
        let Some(body) = function(source, name) else { continue };
        let words: Vec<&str> =
            body.iter().flat_map(|line| line.split(|c: char| !is_of_name(c))).collect();
        for name in names.iter().filter(|name| words.contains(name)) {
            if !taken.contains(name) {
                taken.push(name);
            }
        }
        lines.extend(body.iter().map(ToString::to_string));
    }
    lines
}

fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Returns the statements that assert, without white space.
fn assertions(body: &[String]) -> Vec<String> {
    let asserts = |line: &str| {
        ["assert", "eventually(", "expect(", "panic!("].iter().any(|word| line.contains(word))
    };
    let lines = body.iter().enumerate().filter(|(_, line)| asserts(line));
    lines.map(|(index, _)| statement(&body[index..])).collect()
}

/// Returns the statement that begins with the first line, without white space.
fn statement(lines: &[String]) -> String {
    let rest = lines[1..].iter().position(|next| is_end_of(&lines[0], next));
    let last = if lines[0].ends_with(';') { 0 } else { 1 + rest.unwrap_or(0) };
    without_space(&lines[..=last.min(lines.len() - 1)].concat())
}

fn without_space(text: &str) -> String {
    text.split_whitespace().collect()
}

/// Returns the letters and digits of a text, for names of any case.
fn letters(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The words of a row, and its cause, stand in the test that the row names or in functions that
/// this test calls, and some of the words in an assertion.
#[test]
fn the_named_tests_assert_the_words_of_their_rows() {
    let (mut rows, mut wrong) = (0, Vec::new());
    for file in FaultFile::read_all() {
        let Some(covered_by) = &file.covered_by else { continue };
        let source = std::fs::read_to_string(root().join(&covered_by.file)).unwrap();
        let lines: Vec<&str> = source.lines().collect();
        let body = body_of(&lines, &covered_by.test);
        assert!(!body.is_empty(), "{}: {} has no such test", file.name, covered_by.file);
        let (text, asserted) = (without_space(&body.concat()), assertions(&body));
        let has = |word: &&String| text.contains(&without_space(word));
        let missing = covered_by.words.iter().filter(|word| !has(word));
        wrong.extend(missing.map(|word| format!("{}: no `{word}`", file.name)));
        let is_asserted = |word: &String| {
            asserted.iter().any(|statement| statement.contains(&without_space(word)))
        };
        if !covered_by.words.iter().any(is_asserted) {
            wrong.push(format!("{}: none of its words is asserted", file.name));
        }
        let causes = covered_by.counted.split(", ").filter(|cause| *cause != "nothing");
        let uncounted = causes.filter(|cause| !letters(&text).contains(&letters(cause)));
        wrong.extend(uncounted.map(|cause| format!("{}: no cause `{cause}`", file.name)));
        rows += 1;
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(rows >= 46, "{rows}");
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
