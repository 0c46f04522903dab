//! The exceptions of the package.

use std::fmt;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::words::in_python;

create_exception!(didim, Error, PyException, "Base of the exceptions of this package.");
create_exception!(
    didim,
    ConfigurationError,
    Error,
    "A cell, robot or layout is wrong. The message names file, line and key."
);
create_exception!(
    didim,
    DataError,
    Error,
    "A recording cannot be read, or does not fit the robot."
);
create_exception!(
    didim,
    IdentificationError,
    Error,
    "The method refused the data or failed. The message states the remedy."
);
create_exception!(didim, UsageError, Error, "Arguments contradict each other or are unknown.");

/// Adds the exceptions to the module.
pub(crate) fn add_to(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let python = module.py();
    module.add("Error", python.get_type::<Error>())?;
    module.add("ConfigurationError", python.get_type::<ConfigurationError>())?;
    module.add("DataError", python.get_type::<DataError>())?;
    module.add("IdentificationError", python.get_type::<IdentificationError>())?;
    module.add("UsageError", python.get_type::<UsageError>())
}

/// Creates an exception about a configuration.
pub(crate) fn configuration(error: impl fmt::Display) -> PyErr {
    ConfigurationError::new_err(in_python(&error.to_string()).into_owned())
}

/// Creates an exception about a recording.
pub(crate) fn data(error: impl fmt::Display) -> PyErr {
    DataError::new_err(in_python(&error.to_string()).into_owned())
}

/// Creates an exception about an identification.
pub(crate) fn identification(error: impl fmt::Display) -> PyErr {
    IdentificationError::new_err(in_python(&error.to_string()).into_owned())
}

/// Creates an exception about the arguments of a call.
pub(crate) fn usage(error: impl fmt::Display) -> PyErr {
    UsageError::new_err(in_python(&error.to_string()).into_owned())
}
