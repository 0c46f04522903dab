//! Numbers with the digits that their uncertainty justifies, and aligned tables of them.

/// Widths of the columns of a table, in characters, so that Greek letters align.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnWidths(Vec<usize>);

impl ColumnWidths {
    /// Returns the widths of a header.
    pub fn of_header(header: &[&str]) -> Self {
        Self(header.iter().map(|cell| cell.chars().count()).collect())
    }

    /// Widens the columns for a row.
    pub fn fit(&mut self, row: &[String]) {
        for (width, cell) in self.0.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }

    /// Returns the widths of some of the columns.
    pub fn select(&self, columns: &[usize]) -> Self {
        Self(columns.iter().filter_map(|column| self.0.get(*column).copied()).collect())
    }

    /// Returns the length of a line.
    pub fn line_length(&self) -> usize {
        self.0.iter().sum::<usize>() + 2 * self.0.len().saturating_sub(1)
    }

    /// Renders a row, with two spaces between columns. The first column is left-aligned, the others
    /// are right-aligned.
    pub fn line<'a>(&self, cells: impl IntoIterator<Item = &'a str>) -> String {
        let mut text = String::new();
        for (column, (cell, width)) in cells.into_iter().zip(&self.0).enumerate() {
            let padding = " ".repeat(width.saturating_sub(cell.chars().count()));
            if column == 0 {
                text += cell;
                text += &padding;
            } else {
                text += "  ";
                text += &padding;
                text += cell;
            }
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
        text
    }
}

/// Renders rows under a header, aligned as [`ColumnWidths::line`] does.
pub fn align_table(header: &[&str], rows: &[Vec<String>]) -> String {
    let mut widths = ColumnWidths::of_header(header);
    rows.iter().for_each(|row| widths.fit(row));
    let mut text = widths.line(header.iter().copied());
    for row in rows {
        text += &widths.line(row.iter().map(String::as_str));
    }
    text
}

/// Formats a number with `digits` significant digits, in plain notation if that is readable.
pub fn significant_digits(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return value.to_string();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    #[expect(clippy::cast_possible_truncation, reason = "an exponent of f64 is within ±324")]
    let exponent = value.abs().log10().floor() as i32;
    if !(-5..=6).contains(&exponent) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let decimals = i32::try_from(digits).unwrap_or(0) - 1 - exponent;
    format!("{value:.*}", usize::try_from(decimals).unwrap_or(0))
}

/// Formats a number with the digits that its standard deviation justifies: to the last digit of a
/// standard deviation of two significant digits, but with at most `most` digits (GUM, 7.2.6).
pub fn to_uncertainty(value: f64, standard_deviation: f64, most: usize) -> String {
    let is_known = standard_deviation.is_finite() && standard_deviation != 0.0;
    if !(is_known && value.is_finite()) || value == 0.0 {
        return significant_digits(value, most.min(4));
    }
    #[expect(clippy::cast_possible_truncation, reason = "an exponent of f64 is within ±324")]
    let [exponent, last] = [value, standard_deviation].map(|of| of.abs().log10().floor() as i32);
    let digits = usize::try_from(exponent - last + 2).unwrap_or(0);
    if digits > 0 || !(-5..=1).contains(&last) {
        return significant_digits(value, digits.clamp(1, most));
    }
    // The value is less than a unit of the last digit.
    let text = format!("{value:.*}", usize::try_from(1 - last).unwrap_or(0));
    let is_zero = !text.contains(|c: char| ('1'..='9').contains(&c));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_align_by_characters() {
        let rows = vec![vec!["ψ".into(), "1.5".into()], vec!["zz1r".into(), "-12".into()]];
        assert_eq!(align_table(&["name", "σ"], &rows), "name    σ\nψ     1.5\nzz1r  -12\n");
    }

    #[test]
    fn values_end_with_the_last_digit_of_their_uncertainty() {
        for (value, deviation, text) in [
            (4.739_01, 0.021, "4.739"),
            (-0.013_14, 0.0086, "-0.0131"),
            (5.806_861, 0.0023, "5.8069"),
            (0.000_36, 0.0033, "0.0004"),
            (-0.000_001, 0.1, "0.00"),
            (2.5, 0.0, "2.500"),
            (0.0, 0.1, "0"),
            (123.456, 2.5, "123.5"),
            (8.1, 441.0, "8"),
            (1.234_567_89, 1e-9, "1.234568"),
        ] {
            assert_eq!(to_uncertainty(value, deviation, 7), text, "{value} ± {deviation}");
        }
    }

    #[test]
    fn numbers_have_the_given_digits() {
        let cases = [
            (1.28043, "1.280"),
            (0.012_345, "0.01235"),
            (-0.000_123_45, "-0.0001234"),
            (12_345.6, "12346"),
            (1e-9, "1.000e-9"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
        ];
        for (value, text) in cases {
            assert_eq!(significant_digits(value, 4), text);
        }
    }
}
