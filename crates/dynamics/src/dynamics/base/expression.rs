//! Regrouped parameters in the usual notation.

/// Number of digits of a printed coefficient. Geometry is given with fewer, and more would show
/// rounding.
const DIGITS: usize = 6;

/// Returns the sum of `coefficient · name` as text: `zz1 + ia1 + 0.07 mz3 + 0.05185 (m3+m4)`.
///
/// Names with equal coefficients other than ±1 are grouped at the position of the first of them.
/// The number 1 of a coefficient ±1 is omitted.
pub fn format_sum<'a>(terms: impl IntoIterator<Item = (f64, &'a str)>) -> String {
    let mut groups: Vec<(f64, Vec<&str>)> = Vec::new();
    for (coefficient, name) in terms {
        let coefficient = round_digits(coefficient);
        let is_one = coefficient.abs().total_cmp(&1.0).is_eq();
        let same = |group: &&mut (f64, Vec<&str>)| group.0.total_cmp(&coefficient).is_eq();
        match groups.iter_mut().find(same) {
            Some((_, names)) if !is_one => names.push(name),
            _ => groups.push((coefficient, vec![name])),
        }
    }
    let mut text = String::new();
    for (coefficient, names) in groups {
        text.push_str(match (text.is_empty(), coefficient < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        });
        let size = coefficient.abs();
        if size.total_cmp(&1.0).is_ne() {
            text.push_str(&format!("{size} "));
        }
        match names.as_slice() {
            [name] => text.push_str(name),
            names => text.push_str(&format!("({})", names.join("+"))),
        }
    }
    text
}

/// Returns the nearest number with `DIGITS` significant digits.
fn round_digits(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::format_sum;

    #[test]
    fn equal_coefficients_stand_together_and_ones_are_not_written() {
        let terms = [
            (1.0, "zz1"),
            (1.0 - 1e-14, "ia1"),
            (-1.0, "yy2"),
            (0.070_000_000_000_01, "mz3"),
            (-0.05, "m3"),
            (-0.05 + 1e-16, "m4"),
        ];
        assert_eq!(format_sum(terms), "zz1 + ia1 - yy2 + 0.07 mz3 - 0.05 (m3+m4)");
        assert_eq!(format_sum([(-2.0, "m1")]), "-2 m1");
        assert_eq!(format_sum([]), "");
    }
}
