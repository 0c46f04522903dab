//! Sine, cosine, hyperbolic tangent and sign in the languages of generated code: those of
//! `didim_dynamics::numeric`, from the same sources (Cody and Waite's range reduction; Muller,
//! *Elementary Functions*, 3rd ed., ch. 11), for angles up to 1e5 rad.

use super::statements::Language;

/// Prefix of the marker line before each function of the library; the function's name follows it.
const FUNCTION_MARKER: &str = "//// ";

/// Returns the functions that code calls, and those that they call. In C every name begins with a
/// prefix, which `@` represents.
pub(super) fn called_by(code: &str, language: Language, prefix: &str) -> String {
    let (library, prefix) = match language {
        Language::C => (include_str!("elementary.c"), format!("{prefix}_")),
        Language::Rust => (include_str!("elementary.rust"), String::new()),
    };
    let mut called = String::new();
    // Each calls those before it.
    for function in library.split(FUNCTION_MARKER).skip(1).collect::<Vec<_>>().into_iter().rev() {
        let Some((name, text)) = function.split_once('\n') else { continue };
        let call = format!("{prefix}{name}(");
        let calls = |text: &str| {
            text.match_indices(&call)
                .any(|(at, _)| !text[..at].ends_with(|of: char| of.is_alphanumeric() || of == '_'))
        };
        if calls(code) || calls(&called) {
            called = format!("{}{called}", text.replace("@_", &prefix));
        }
    }
    called
}
