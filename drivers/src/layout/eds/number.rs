//! Numbers in the notation of device files: `128`, `0x80`, `$NODEID+0x180`.

/// Returns the value of a number for a node, or a description of the error.
///
/// A decimal number must not have a leading zero, because some tools would read it as octal and
/// others would not. A comment after the number is ignored.
pub(super) fn parse(text: &str, node: u8) -> Result<u64, String> {
    let text = text.split(';').next().unwrap_or_default().trim();
    let compact: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let lower = compact.to_lowercase();
    const NODE_VARIABLE: &str = "$nodeid";
    if !lower.contains('$') {
        return constant(&lower).ok_or_else(|| expected_text(text));
    }
    let other = match (lower.strip_prefix(NODE_VARIABLE), lower.strip_suffix(NODE_VARIABLE)) {
        (Some(""), _) => return Ok(node.into()),
        (Some(rest), _) => rest.strip_prefix('+'),
        (None, Some(rest)) => rest.strip_suffix('+'),
        (None, None) => None,
    };
    let sum = other.and_then(constant).and_then(|value| value.checked_add(node.into()));
    sum.ok_or_else(|| expected_text(text))
}

fn constant(text: &str) -> Option<u64> {
    match text.strip_prefix("0x") {
        Some(digits) if digits.bytes().all(|b| b.is_ascii_hexdigit()) => {
            u64::from_str_radix(digits, 16).ok()
        }
        Some(_) => None,
        None if text.len() > 1 && text.starts_with('0') => None,
        None if text.bytes().all(|b| b.is_ascii_digit()) => text.parse().ok(),
        None => None,
    }
}

fn expected_text(text: &str) -> String {
    let shown: String = text.chars().take(40).collect();
    format!("`{shown}` is not a number; write 128, 0x80 or $NODEID+0x180")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_formulas() {
        for (text, value) in [
            ("128", 128),
            ("0", 0),
            ("0x80", 128),
            ("0X1a", 26),
            ("$NODEID+0x180", 0x185),
            ("$NodeId + 384", 389),
            ("0x80000000+$NODEID", 0x8000_0005),
            ("$NODEID", 5),
            ("0x40000180 + $nodeid", 0x4000_0185),
            ("0x03 ; default", 3),
        ] {
            assert_eq!(parse(text, 5), Ok(value), "{text}");
        }
        for text in
            ["", "; 3", "080", "0x", "1.5", "-1", "$NODE+1", "$NODEID+", "$NODEID-1", "+$NODEID"]
        {
            assert!(parse(text, 5).is_err(), "{text}");
        }
        assert!(parse("0x10000000000000000", 5).is_err());
        assert!(parse("$NODEID+0xFFFFFFFFFFFFFFFF", 5).is_err());
    }
}
