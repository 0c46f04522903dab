//! The reduction from base to essential parameters, as a table for people and a list for the cell
//! file.

use didim_identification::identification::{Reduction, ReductionStep};

use crate::text::{align_table, significant_digits};

/// Width of a line of the list, in characters.
const LINE_WIDTH: usize = 88;

/// Formats the eliminated parameters, one line each, and the remaining ones.
pub fn reduction_text(reduction: &Reduction) -> String {
    let line = |step: &ReductionStep, what: &str| {
        vec![
            step.name.clone(),
            format!("{} %", significant_digits(100.0 * step.relative_standard_deviation, 3)),
            significant_digits(step.f_statistic, 3),
            significant_digits(step.probability, 2),
            what.to_owned(),
        ]
    };
    let mut rows: Vec<_> = reduction.left_out.iter().map(|step| line(step, "left out")).collect();
    rows.extend(reduction.fixed.iter().map(|step| line(step, "stays")));
    let mut text = align_table(&["parameter", "relative σ", "F", "probability", ""], &rows);
    text += &format!(
        "\n{} of {} base parameters are essential to this motion, at a level of {}\n\n",
        reduction.essential.len(),
        reduction.essential.len() + reduction.left_out.len(),
        reduction.level
    );
    text += &toml_list(&reduction.essential);
    text
}

/// Formats `parameters = […]` for `[identification]` of the cell file.
fn toml_list(names: &[String]) -> String {
    let mut text = "parameters = [\n".to_owned();
    let mut line = String::new();
    for name in names {
        let entry = format!(" \"{name}\",");
        if line.len() + entry.len() > LINE_WIDTH {
            text += &format!("   {line}\n");
            line.clear();
        }
        line += &entry;
    }
    text + &format!("   {line}\n]\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_can_be_put_into_a_cell_file() {
        let names: Vec<String> = (0..40).map(|k| format!("zz{k}r")).collect();
        let text = toml_list(&names);
        let table: toml::Table = text.parse().unwrap();
        let read: Vec<_> =
            table["parameters"].as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect();
        assert_eq!(read, names);
        assert!(text.lines().all(|line| line.len() <= 4 + LINE_WIDTH));
    }
}
