//! The one place that catches panics of libraries that assert properties of complete files: those
//! of Parquet and of meshes.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Calls the library. A panic becomes an error with its message.
pub(crate) fn catch_panic<T, E>(
    call: impl FnOnce() -> Result<T, E>,
    damaged: impl FnOnce(String) -> E,
) -> Result<T, E> {
    // The call's input is dropped with the error, so that nothing half changed remains.
    catch_unwind(AssertUnwindSafe(call))
        .unwrap_or_else(|_| Err(damaged("its reader gave up".to_owned())))
}
