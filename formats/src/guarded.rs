//! The one place where panics of the library for Parquet are caught: it asserts what only a whole file has.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Calls the library; where it panics, the error is made of what is said then.
pub(crate) fn guarded<T, E>(
    call: impl FnOnce() -> Result<T, E>,
    damaged: impl FnOnce(String) -> E,
) -> Result<T, E> {
    // What it was given is dropped with the error, so that nothing half changed is left.
    catch_unwind(AssertUnwindSafe(call))
        .unwrap_or_else(|_| Err(damaged("its reader gave up".to_owned())))
}
