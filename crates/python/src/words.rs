//! Wording of messages for Python. The libraries name options as the command line does; arguments
//! of Python have the same names with underscores, but for a few.

use std::borrow::Cow;

/// Options whose argument has another name.
const RENAMED: [(&str, &str); 3] = [("from", "start"), ("to", "end"), ("input", "data")];

/// Returns a message with the arguments of Python in place of options: `sample_rate` for
/// `--sample-rate`. Commands for a shell in backticks stay as they are.
pub(crate) fn in_python(message: &str) -> Cow<'_, str> {
    if !message.contains("--") {
        return message.into();
    }
    let spans = message.split('`').enumerate().map(|(index, span)| match index % 2 {
        1 if !span.starts_with("--") => span.to_owned(),
        _ => with_arguments(span),
    });
    spans.collect::<Vec<_>>().join("`").into()
}

fn with_arguments(text: &str) -> String {
    let mut words = text.split("--");
    let mut out = words.next().unwrap_or_default().to_owned();
    for word in words {
        let length = word.find(|c: char| !c.is_ascii_lowercase() && c != '-');
        let (name, rest) = word.split_at(length.unwrap_or(word.len()));
        let is_option = !name.is_empty() && !out.ends_with(|c: char| c.is_alphanumeric());
        match RENAMED.iter().find(|(option, _)| *option == name) {
            _ if !is_option => out.extend(["--", name]),
            Some((_, argument)) => out.push_str(argument),
            None => out.push_str(&name.replace('-', "_")),
        }
        out.push_str(rest);
    }
    out
}
