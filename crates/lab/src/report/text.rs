//! The tables of a comparison as text.

use std::fmt::Write as _;

use super::{Cell, Judgement, Table, View, conclusion};
use crate::comparison::LimitOutcome;
use didim::text::align_table;

/// Returns the comparison as text for a terminal with lines of `line` characters: the verdicts
/// first, then every table, with aligned columns. Marked cells have an asterisk.
pub fn terminal(view: &View<'_>, line: usize) -> String {
    let mut text = String::new();
    let judgements = view.judgements();
    let width = judgements.iter().map(|of| of.trial.to_string().chars().count()).max().unwrap_or(0);
    for of in &judgements {
        let name = of.trial.to_string();
        let padding = " ".repeat(width - name.chars().count());
        let _ = write!(
            text,
            "{name}{padding}  {}",
            wrap_sentence(&judgement_sentence(of), width + 2, line)
        );
    }
    for table in view.tables() {
        let _ = write!(text, "\n{}\n{}", table.title, wrap_sentence(&table.note, 0, line));
        if !is_prose(&table) {
            text.push('\n');
        }
        text += &aligned_table(&table, line);
    }
    if !view.outcomes.is_empty() && view.outcomes.iter().all(LimitOutcome::is_met) {
        let _ = writeln!(text, "\nAll {} limits hold.", view.outcomes.len());
    }
    if let Some(sentence) = conclusion::conclusion_sentence(view) {
        let _ = write!(text, "\n{}", wrap_sentence(&sentence, 0, line));
    }
    text
}

/// Returns the comparison as Markdown for a document, with headings, sentences and tables.
pub fn markdown(view: &View<'_>) -> String {
    let mut text = String::from("## Verdicts\n\n| method | verdict |\n|:---|:---|\n");
    for of in &view.judgements() {
        let _ = writeln!(text, "| {} | {} |", of.trial, escape_cell(&judgement_sentence(of)));
    }
    for table in view.tables() {
        let _ = write!(text, "\n## {}\n\n", table.title);
        if !table.note.is_empty() {
            let _ = write!(text, "{}\n\n", escape_cell(&table.note));
        }
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        text += &line(&table.header);
        let numbers = table.header.len().saturating_sub(1);
        let rule = if is_prose(&table) { ":---" } else { "---:" };
        let _ = writeln!(text, "|:---|{}", format!("{rule}|").repeat(numbers));
        for row in &table.rows {
            let cells: Vec<String> = row.iter().map(markdown_cell).collect();
            text += &line(&cells);
        }
    }
    if let Some(sentence) = conclusion::conclusion_sentence(view) {
        let _ = writeln!(text, "\n{}", escape_cell(&sentence));
    }
    text
}

fn judgement_sentence(of: &Judgement) -> String {
    let verdict = if of.reason.is_some() { of.verdict.to_uppercase() } else { of.verdict.into() };
    let reason = of.reason.as_ref().map(|reason| format!(": {reason}")).unwrap_or_default();
    let more = if of.further_reasons > 0 {
        format!(" (and {} more)", of.further_reasons)
    } else {
        String::new()
    };
    format!("{verdict}{reason}{more}")
}

/// Returns true if the second column has words instead of numbers.
fn is_prose(table: &Table) -> bool {
    table.header.len() == 2
}

fn aligned_table(table: &Table, columns: usize) -> String {
    if is_prose(table) {
        let width = table.rows.iter().filter_map(|row| row.first());
        let width = width.map(|cell| cell.text.chars().count()).max().unwrap_or(0);
        return table
            .rows
            .iter()
            .map(|row: &Vec<Cell>| {
                let texts: Vec<&str> = row.iter().map(|cell| cell.text.as_str()).collect();
                let (name, rest) = texts.split_first().unwrap_or((&"", &[]));
                let padding = " ".repeat(width - name.chars().count());
                format!("{name}{padding}  {}", wrap_sentence(&rest.join("  "), width + 2, columns))
            })
            .collect();
    }
    // If a cell of a column is marked, the other cells of the column get a space in place of the
    // mark.
    let has_mark = |column: usize| {
        table.rows.iter().any(|row| row.get(column).is_some_and(|cell| cell.is_marked))
    };
    let marked_columns: Vec<bool> = (0..table.header.len()).map(has_mark).collect();
    let with_mark = |text: &str, marked: bool, space: bool| match (marked, space) {
        (true, _) => format!("{text}*"),
        (false, true) => format!("{text} "),
        (false, false) => text.to_owned(),
    };
    let header: Vec<String> = table
        .header
        .iter()
        .zip(&marked_columns)
        .map(|(text, space)| with_mark(text, false, *space))
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    align_table(
        &header,
        &table
            .rows
            .iter()
            .map(|row: &Vec<Cell>| {
                let cells = row.iter().zip(&marked_columns);
                cells.map(|(cell, space)| with_mark(&cell.text, cell.is_marked, *space)).collect()
            })
            .collect::<Vec<_>>(),
    )
}

/// Breaks a sentence into lines of at most `columns` characters. Each line begins after `before`
/// characters, which the text in front of the sentence takes.
fn wrap_sentence(text: &str, before: usize, columns: usize) -> String {
    let mut lines = String::new();
    let mut width = before;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if width > before && width + 1 + length > columns {
            lines += &format!("\n{}", " ".repeat(before));
            width = before;
        } else if width > before {
            lines.push(' ');
            width += 1;
        }
        lines += word;
        width += length;
    }
    if !lines.is_empty() {
        lines.push('\n');
    }
    lines
}

fn markdown_cell(cell: &Cell) -> String {
    let text = escape_cell(&cell.text);
    if cell.is_marked { format!("**{text}**") } else { text }
}

/// Escapes a name from a file, so that it does not break a table.
fn escape_cell(text: &str) -> String {
    text.replace('|', "\\|").replace('<', "&lt;").replace(['\n', '\r'], " ")
}
