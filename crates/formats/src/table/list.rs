//! Lists of numbers in one field, as pandas, NumPy and PyTorch write them.

/// Returns the elements of a field that is a list: `[1, 2]`, `[1 2]`, `(1, 2)` or `array([1, 2])`.
pub(super) fn elements(field: &str) -> Option<Vec<&str>> {
    let inner = ["array", "tensor"]
        .into_iter()
        .find_map(|function| field.strip_prefix(function)?.strip_prefix('(')?.strip_suffix(')'));
    let list = inner.unwrap_or(field);
    let brackets = [('[', ']'), ('(', ')')].into_iter();
    let mut inside =
        brackets.filter_map(|(begin, end)| list.strip_prefix(begin)?.strip_suffix(end));
    let parts = inside.next()?.split(|c: char| c == ',' || c.is_whitespace());
    Some(parts.filter(|part| !part.is_empty()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_several_forms() {
        for list in ["[1.5, -2]", "[1.5 -2]", "(1.5,-2)", "array([ 1.5,\n -2])", "[1.5  -2.]"] {
            let numbers: Vec<f64> =
                elements(list).unwrap().iter().map(|part| part.parse().unwrap()).collect();
            assert_eq!(numbers, [1.5, -2.0], "{list}");
        }
        assert_eq!(elements("[]"), Some(vec![]));
        for none in ["", "1.5", "[1", "q[0]"] {
            assert_eq!(elements(none), None, "{none}");
        }
    }
}
