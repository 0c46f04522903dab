//! Seeds of random tests.

use std::ops::Range;

/// Returns the seeds of a random test: those of `DIDIM_SEEDS=7` or `DIDIM_SEEDS=1000..3000`, or
/// else the usual ones.
pub(crate) fn seeds(usual: Range<u64>) -> Range<u64> {
    let Ok(text) = std::env::var("DIDIM_SEEDS") else { return usual };
    let number = |text: &str| text.parse().expect("DIDIM_SEEDS is a number or FROM..TO");
    match text.split_once("..") {
        Some((from, to)) => number(from)..number(to),
        None => number(&text)..number(&text) + 1,
    }
}
