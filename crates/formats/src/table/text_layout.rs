//! Layout of a text table, from its first lines: the separator, the lines before the rows, and the
//! columns.

use std::borrow::Cow;
use std::collections::BTreeSet;

use super::list::elements;

/// Most records that are inspected.
pub(super) const INSPECTED_RECORDS: usize = 1000;
/// Separators. If several fit equally well, the last one is taken; blanks fit only if nothing else
/// does, because names contain them.
const SEPARATORS: [u8; 4] = [b' ', b'\t', b';', b','];
/// Marks of a line that is a comment, or the header of NumPy and MATLAB.
const COMMENT_MARKS: [char; 2] = ['#', '%'];
/// Names of a row of units.
const UNIT_ROW_NAMES: [&str; 4] = ["unit", "units", "einheit", "unité"];

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextColumn {
    /// Field of the row, from 0.
    pub(super) field: usize,
    /// Element of the field, if the field is a list.
    pub(super) element: Option<usize>,
}

/// Layout of a text table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TextLayout {
    pub(super) separator: u8,
    /// Number of fields of the header, or of the rows without a header.
    pub(super) field_count: usize,
    /// Line of the header, from 1, if there is one.
    pub(super) header_line: Option<u64>,
    /// Line of the first row, from 1.
    pub(super) first_line: u64,
    /// Number of records before the first row.
    pub(super) records_before: usize,
    /// The header and the lines between it and the rows. A recording that was appended repeats
    /// them.
    pub(super) head: Vec<Vec<String>>,
    pub(super) columns: Vec<TextColumn>,
    /// Names of the columns; those of a list have an index, `position[0]`. Numbers from 1 without a
    /// header.
    pub(super) names: Vec<String>,
    /// Unit of each column, from a row of units below the header; empty without one.
    pub(super) units: Vec<String>,
    /// Unit that follows each number of a column, as `15.2 °`; empty without one.
    pub(super) suffixes: Vec<String>,
    /// Texts of the first row, by column.
    pub(super) first_row: Vec<String>,
    /// True for each field with texts and no numbers in the sample, or with neither a name nor
    /// values. Empty until [`find_texts`](Self::find_texts).
    pub(super) is_text: Vec<bool>,
}

/// A line of the sample.
struct SampleRecord {
    /// Number of records before it.
    place: usize,
    /// Line, from 1.
    line: u64,
    fields: Vec<String>,
}

impl TextLayout {
    /// Finds the layout from the first lines. `wanted` are the columns looked for.
    pub(super) fn find(sample: &[u8], wanted: &[String]) -> Self {
        // A number may be that of a column, and stand in any row.
        let wanted: Vec<&str> =
            wanted.iter().map(String::as_str).filter(|name| !is_number(name)).collect();
        // Without its separator, a table has one column, as it has with commas.
        let occurs = |separator: &u8| *separator == b',' || sample.contains(separator);
        let layouts = SEPARATORS.into_iter().filter(occurs).map(|separator| {
            let matching = |layout: &Self| {
                layout.names.iter().filter(|name| wanted.contains(&name.as_str())).count()
            };
            let mut layout = Self::with_separator(sample, separator, &[]);
            if matching(&layout) < wanted.len() {
                layout = Self::with_separator(sample, separator, &wanted);
            }
            let matching = matching(&layout);
            let numbers = layout.first_row.iter().filter(|text| is_number(text)).count();
            let fields = if separator == b' ' { 0 } else { layout.field_count };
            ((matching, numbers, fields), layout)
        });
        layouts.max_by_key(|(fit, _)| *fit).map(|(_, layout)| layout).unwrap_or_default()
    }

    fn with_separator(sample: &[u8], separator: u8, wanted: &[&str]) -> Self {
        let records = sample_records(sample, separator);
        let count = most_frequent_count(&records);
        let numbers =
            |record: &&SampleRecord| record.fields.iter().filter(|field| is_numeric(field)).count();
        // A row in the middle of the rows shows which columns have numbers.
        let typical_row = records.iter().filter(|record| record.fields.len() == count);
        let typical_row = typical_row.max_by_key(numbers);
        let is_numeric_column: Vec<bool> = typical_row
            .map(|row| row.fields.iter().map(|field| is_numeric(field)).collect())
            .unwrap_or_default();
        let header = find_header(&records, count, &is_numeric_column, wanted);
        let begin = header.map_or(0, |header| header + 1);
        let is_row = |record: &SampleRecord| {
            record.fields.len() != count || !is_below_header(&record.fields, &is_numeric_column)
        };
        let begin = match header {
            Some(_) => records.iter().skip(begin).position(is_row).map_or(begin, |at| begin + at),
            None => records.iter().position(|record| record.fields.len() == count).unwrap_or(0),
        };
        let header = header.map(|header| first_header_line(&records, header, begin));
        let head = records.get(header.unwrap_or(begin)..begin).unwrap_or_default();
        let row = records.get(begin).map_or(&[][..], |record| &record.fields);
        let field_count = head.first().map_or(count, |header| match is_lvm_header(header, count) {
            true => count,
            false => header.fields.len(),
        });
        let mut layout = Self {
            separator,
            field_count,
            header_line: head.first().map(|header| header.line),
            first_line: records.get(begin).map_or(1, |record| record.line),
            records_before: records.get(begin).map_or(usize::MAX, |record| record.place),
            head: head.iter().map(|record| record.fields.clone()).collect(),
            ..Self::default()
        };
        layout.add_columns(row, typical_row.map_or(&[], |record| &record.fields));
        layout
    }

    /// Finds the fields that have no numbers in the rows of the sample, which takes as long as
    /// finding the layout.
    pub(super) fn find_texts(&mut self, sample: &[u8]) {
        let records = sample_records(sample, self.separator);
        let begin = records.iter().position(|record| record.place >= self.records_before);
        let rows = &records[begin.unwrap_or(records.len())..];
        let head = joined_names(&self.head);
        let names = head.as_ref().or(self.head.first());
        self.is_text = (0..self.field_count)
            .map(|field| {
                let name = names.map_or("unnamed", |names| names.get(field).map_or("", |of| of));
                let values = rows.iter().filter_map(|row| row.fields.get(field));
                is_text(values.map(String::as_str), !name.is_empty())
            })
            .collect();
        // Texts may begin below the first row.
        for (column, text) in self.columns.iter().zip(&mut self.first_row) {
            let values = || rows.iter().filter_map(|row| row.fields.get(column.field));
            if text.is_empty() && self.is_text[column.field] {
                let first = values().find(|value| !value.is_empty());
                *text = first.cloned().unwrap_or_default();
            }
        }
    }

    /// Adds the columns: one for each field, or for each element of a field that is a list.
    fn add_columns(&mut self, row: &[String], typical_row: &[String]) {
        let names = joined_names(&self.head);
        let units = match names.is_some() {
            true => None,
            false => unit_row(&self.head).cloned(),
        };
        let suffix_of = |text: &str| unit_suffix(text).unwrap_or_default().to_owned();
        let has_suffixes = typical_row.iter().any(|text| unit_suffix(text).is_some());
        for field in 0..self.field_count {
            let header = names.as_ref().or(self.head.first()).and_then(|header| header.get(field));
            let name = header.cloned().unwrap_or_else(|| (field + 1).to_string());
            let text = row.get(field).map_or("", String::as_str);
            let typical_text = typical_row.get(field).map_or("", String::as_str);
            let suffix = suffix_of(typical_text);
            let unit = units.as_ref().map(|units| units.get(field).cloned().unwrap_or_default());
            let unit = unit.or_else(|| has_suffixes.then(|| suffix.clone()));
            let parts = elements(typical_text).filter(|_| is_numeric(typical_text));
            let count = parts.as_ref().map_or(1, Vec::len);
            for element in 0..count {
                let is_list = parts.is_some();
                self.columns.push(TextColumn { field, element: is_list.then_some(element) });
                let index = if is_list { format!("[{element}]") } else { String::new() };
                self.names.push(format!("{name}{index}"));
                self.units.extend(unit.clone());
                self.suffixes.push(suffix.clone());
                let part = elements(text).and_then(|parts| parts.get(element).copied());
                self.first_row.push(part.filter(|_| is_list).unwrap_or(text).to_owned());
            }
        }
    }
}

/// Splits the sample into records. A comment mark at the beginning of a line is removed.
fn sample_records(sample: &[u8], separator: u8) -> Vec<SampleRecord> {
    let mut reader = reader_builder(separator).from_reader(sample);
    let records = reader.byte_records().take(INSPECTED_RECORDS).map_while(Result::ok);
    let records = records.enumerate().map(|(place, record)| {
        let fields = record.iter().map(|field| String::from_utf8_lossy(field).into_owned());
        let mut fields: Vec<String> = fields.collect();
        if let Some(first) = fields.first_mut().filter(|first| is_comment(first)) {
            *first = first.trim_start_matches(COMMENT_MARKS).trim().to_owned();
        }
        if separator == b' ' {
            fields.retain(|field| !field.is_empty());
        }
        SampleRecord { place, line: line_of(&record, sample), fields }
    });
    records.filter(|record| record.fields.iter().any(|field| !field.is_empty())).collect()
}

/// Returns the line of a record, from 1. Its position is that of the blank lines before it.
fn line_of(record: &csv::ByteRecord, sample: &[u8]) -> u64 {
    let Some(position) = record.position() else { return 1 };
    let at = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = sample.get(at..).unwrap_or_default().iter();
    let breaks = rest.take_while(|byte| matches!(byte, b'\r' | b'\n'));
    position.line() + breaks.filter(|byte| **byte == b'\n').count() as u64
}

/// Returns the settings of the reader of records.
pub(super) fn reader_builder(separator: u8) -> csv::ReaderBuilder {
    let mut builder = csv::ReaderBuilder::new();
    builder.has_headers(false).flexible(true).trim(csv::Trim::All).delimiter(separator);
    builder
}

/// Returns true if a line with this first field is a comment.
pub(super) fn is_comment(first: &str) -> bool {
    first.starts_with(COMMENT_MARKS)
}

/// Returns the number of fields that most records have; the larger one of equals.
fn most_frequent_count(records: &[SampleRecord]) -> usize {
    let count_of = |fields: usize| records.iter().filter(|of| of.fields.len() == fields).count();
    let mut counts: Vec<usize> = records.iter().map(|record| record.fields.len()).collect();
    counts.sort_unstable();
    counts.dedup();
    counts.into_iter().max_by_key(|fields| (count_of(*fields), *fields)).unwrap_or_default()
}

/// Returns the record of the header: the one with most of the wanted columns, or the one before the
/// rows with most different texts above numbers, or the last one without a number.
fn find_header(
    records: &[SampleRecord],
    count: usize,
    is_numeric_column: &[bool],
    wanted: &[&str],
) -> Option<usize> {
    let matches = |record: &SampleRecord| {
        record.fields.iter().filter(|field| wanted.contains(&field.as_str())).count()
    };
    let best = records.iter().enumerate().rev().max_by_key(|(_, record)| matches(record));
    if let Some((at, record)) = best
        && matches(record) > 0
    {
        return Some(at);
    }
    let first = records.iter().position(|record| record.fields.len() == count)?;
    if !is_numeric_column.contains(&true) || is_count(&records[first].fields) {
        return Some(first);
    }
    // Lines of a preamble may have as many fields as the names of the columns.
    let is_row = |record: &SampleRecord| {
        record.fields.len() == count
            && record.fields.iter().any(|field| is_numeric(field))
            && texts_above_numbers(&record.fields, is_numeric_column) == 0
    };
    let row = records.iter().position(is_row).unwrap_or(records.len());
    let names = |record: &SampleRecord| different_texts(&record.fields, is_numeric_column);
    let is_above = |record: &SampleRecord| record.fields.len() >= count;
    let before = records[..row].iter().enumerate().filter(|(_, record)| is_above(record));
    match before.rev().max_by_key(|(_, record)| names(record)) {
        Some((at, record)) if names(record) > 0 => Some(at),
        _ => records[..first].iter().rposition(|record| {
            record.fields.len() > 1 && !record.fields.iter().any(|field| is_numeric(field))
        }),
    }
}

/// Counts the different texts in columns of numbers.
fn different_texts(fields: &[String], is_numeric_column: &[bool]) -> usize {
    let columns = fields.iter().zip(is_numeric_column);
    let texts = columns.filter(|(field, is)| **is && !field.is_empty() && !is_numeric(field));
    texts.map(|(field, _)| field).collect::<BTreeSet<_>>().len()
}

/// Returns true for the header of a LabVIEW measurement file, whose rows may lack the comment
/// (National Instruments, specification of the LabVIEW measurement file).
fn is_lvm_header(header: &SampleRecord, count: usize) -> bool {
    header.fields.len() == count + 1 && header.fields.last().is_some_and(|last| last == "Comment")
}

/// Counts the texts in columns of numbers.
fn texts_above_numbers(fields: &[String], is_numeric_column: &[bool]) -> usize {
    let columns = fields.iter().zip(is_numeric_column);
    columns.filter(|(field, is)| **is && !field.is_empty() && !is_numeric(field)).count()
}

/// Returns true for a record that belongs to the header: at least half of the numbers are texts, or
/// texts are all that it has.
fn is_below_header(fields: &[String], is_numeric_column: &[bool]) -> bool {
    let numbers = is_numeric_column.iter().filter(|is| **is).count();
    let texts = texts_above_numbers(fields, is_numeric_column);
    let has_numbers = fields.iter().any(|field| is_numeric(field));
    numbers > 0 && (2 * texts >= numbers || (texts > 0 && !has_numbers))
}

/// Returns the first line of a header of several lines: one above the found one, if the names of
/// the found one repeat and those of all lines together do not.
fn first_header_line(records: &[SampleRecord], header: usize, begin: usize) -> usize {
    let count = records[header].fields.len();
    let is_text = |record: &SampleRecord| {
        record.fields.len() == count && !record.fields.iter().any(|field| is_numeric(field))
    };
    let above = records[..header].iter().rev().take_while(|record| is_text(record)).count();
    let lines = |first: usize| -> Vec<Vec<String>> {
        records[first..begin].iter().map(|record| record.fields.clone()).collect()
    };
    let first = header - above;
    match has_repeated(&records[header].fields) && joined_names(&lines(first)).is_some() {
        true => first,
        false => header,
    }
}

/// Returns true if a name stands more than once.
fn has_repeated(names: &[String]) -> bool {
    let named = || names.iter().filter(|name| !name.is_empty());
    named().collect::<BTreeSet<_>>().len() < named().count()
}

/// Joins the names of two or more lines of a header, if the first line repeats its names and all
/// together do not (pandas, columns with several levels). `None` if one line has the names.
fn joined_names(head: &[Vec<String>]) -> Option<Vec<String>> {
    let (first, below) = head.split_first().filter(|(first, _)| has_repeated(first))?;
    let joined = first.iter().enumerate().map(|(field, name)| {
        let further = below.iter().filter_map(|line| line.get(field));
        let parts = core::iter::once(name).chain(further).filter(|part| !part.is_empty());
        parts.map(String::as_str).collect::<Vec<_>>().join(" ")
    });
    let joined: Vec<String> = joined.collect();
    (!has_repeated(&joined)).then_some(joined)
}

/// Returns true for the header of columns without names: 0, 1, 2 and so on, after an empty field of
/// an index (pandas).
fn is_count(fields: &[String]) -> bool {
    let numbers = fields.strip_prefix(&[String::new()]).unwrap_or(fields);
    numbers.len() > 2 && numbers.iter().enumerate().all(|(at, field)| *field == at.to_string())
}

/// Returns the row of units below a header: the one that says so, or the only one.
fn unit_row(head: &[Vec<String>]) -> Option<&Vec<String>> {
    let below = head.get(1..)?;
    let says_unit = |field: &String| UNIT_ROW_NAMES.contains(&field.to_lowercase().as_str());
    let says = below.iter().find(|fields| fields.iter().any(says_unit));
    says.or_else(|| below.first().filter(|_| below.len() == 1))
}

/// Returns true for values with texts and no numbers, or for none at all without a name.
fn is_text<'a>(values: impl Iterator<Item = &'a str>, is_named: bool) -> bool {
    let mut is_empty = true;
    for value in values.filter(|value| !value.is_empty()) {
        if is_numeric(value) {
            return false;
        }
        is_empty = false;
    }
    !is_empty || !is_named
}

/// Returns true for a number, a number with its unit, or a list of numbers.
fn is_numeric(field: &str) -> bool {
    match elements(field) {
        Some(parts) => !parts.is_empty() && parts.into_iter().all(is_number),
        None => is_number(field) || unit_suffix(field).is_some(),
    }
}

fn is_number(text: &str) -> bool {
    with_decimal_point(text).parse::<f64>().is_ok()
}

/// Returns the unit behind a number: `°` of `15.2°`, `sec` of `0.004 sec`.
pub(super) fn unit_suffix(text: &str) -> Option<&str> {
    let is_digit = |c: char| c.is_ascii_digit();
    let end = text.rfind(|c: char| is_digit(c) || c == '.').map(|at| at + 1)?;
    let (number, unit) = text.split_at_checked(end)?;
    let unit = unit.trim_start();
    let is_unit = |c: char| c.is_alphabetic() || "°%‰·*/² ".contains(c);
    let is_plain = !unit.is_empty() && unit.chars().all(is_unit);
    (is_plain && number.starts_with(|c: char| is_digit(c) || "+-.".contains(c)))
        .then_some(unit)
        .filter(|_| is_number(number))
}

/// Returns a number with a decimal point in place of a decimal comma.
pub(super) fn with_decimal_point(number: &str) -> Cow<'_, str> {
    match number.contains(',') {
        true => Cow::Owned(number.replace(',', ".")),
        false => Cow::Borrowed(number),
    }
}
