//! Options that take one of a few names: help, completions and the suggestions behind a mistake know them.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use didim::offline::Format;
use didim_core::identification::Method;

/// The cell where none is named: that of the service of this machine, as its unit has it.
pub(super) const DEFAULT_CELL: &str = "/etc/didim/cell.toml";

/// Reads the name of a method.
pub(super) fn methods() -> impl TypedValueParser<Value = Method> {
    one_of(Method::ALL, |method| PossibleValue::new(method.name()).help(method.long_name()))
}

/// Reads the name of a format of models.
pub(super) fn formats() -> impl TypedValueParser<Value = Format> {
    one_of(Format::ALL, |format| PossibleValue::new(format.name()))
}

fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    shown: fn(T) -> PossibleValue,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(shown)).try_map(move |name| {
        all.into_iter().find(|of| shown(*of).get_name() == name).ok_or("no such name")
    })
}
