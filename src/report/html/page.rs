//! The parts of a page: the complete file, its sections, and readable numbers.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::report::panel::CURVE_STYLE;
use crate::text::significant_digits;

const STYLE: &str = include_str!("style.css");

/// Creates a complete file. `own_style` is added after the common style.
pub fn document(title: &str, own_style: &str, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(CURVE_STYLE)) (PreEscaped(own_style)) }
            }
            body { (content) }
        }
    };
    page.into_string() + "\n"
}

/// Creates a section under a heading, with a sentence on how to read it.
pub fn section(heading: &str, explanation: &str, content: &Markup) -> Markup {
    html! {
        section id=(anchor(heading)) {
            h2 { (heading) }
            @if !explanation.is_empty() { p.explanation { (explanation) } }
            (content)
        }
    }
}

/// Returns the anchor of a section in its page, such as `torque-measured-and-predicted`.
fn anchor(heading: &str) -> String {
    let words = heading.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}

/// Creates a list of contents from the sections of a page. Text from files is escaped, so it cannot
/// look like a section.
pub fn contents_list(sections: &Markup) -> Markup {
    let headings = sections.0.split("<section id=\"").skip(1).filter_map(|section| {
        let (id, rest) = section.split_once('"')?;
        let heading = rest.split_once("<h2>")?.1.split_once("</h2>")?.0;
        Some((id, heading))
    });
    html! {
        nav.contents aria-label="Contents" { ul {
            @for (id, heading) in headings {
                li { a href=("#".to_owned() + id) { (PreEscaped(heading)) } }
            }
        } }
    }
}

/// Formats a number with the given significant digits and a typographic minus sign. NaN becomes a
/// dash.
pub fn number_text(value: f64, digits: usize) -> String {
    if value.is_finite() {
        with_real_minus(&significant_digits(value, digits))
    } else {
        "–".to_owned()
    }
}

/// Formats a ratio as a percentage.
pub fn percent_text(share: f64, digits: usize) -> String {
    if share.is_finite() {
        format!("{} %", number_text(100.0 * share, digits))
    } else {
        "–".to_owned()
    }
}

/// Formats a probability. Below one in ten thousand, its exact value is meaningless and not shown.
pub fn probability(p: f64) -> String {
    if p < 1e-4 { "< 0.0001".to_owned() } else { number_text(p, 2) }
}

/// Replaces hyphens as minus signs by typographic minus signs, and exponents by powers of ten.
pub fn with_real_minus(text: &str) -> String {
    let text = text.replace('-', "−");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let raised = |c: char| match c {
        '−' => '⁻',
        digit => digit.to_digit(10).map_or(digit, |k| SUPERSCRIPTS[k as usize]),
    };
    format!("{mantissa}·10{}", exponent.chars().map(raised).collect::<String>())
}

const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// Turns text into a sentence, with a capital letter and a full stop. Text between backticks is
/// code.
pub fn to_sentence(text: &str) -> Markup {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    let sentence: String = first.chain(letters).chain(['.']).collect();
    with_code(&sentence)
}

/// Formats text between backticks as code. A backtick without a second one stays.
pub fn with_code(text: &str) -> Markup {
    let Some((before, (code, after))) =
        text.split_once('`').and_then(|(before, rest)| Some((before, rest.split_once('`')?)))
    else {
        return html! { (text) };
    };
    html! { (before) code { (code) } (with_code(after)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_between_backticks_is_code() {
        let text = "set `cell.toml:3 data.sign[2]`: -1 <a> `open";
        let sentence = "Set <code>cell.toml:3 data.sign[2]</code>: -1 &lt;a&gt; `open.";
        assert_eq!(to_sentence(text).into_string(), sentence);
    }
}
