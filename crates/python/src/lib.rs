//! The extension module `didim._native` of the Python package `didim`: robots, recordings and
//! results on NumPy arrays. The package's Python files name its parts for users.
//!
//! Contract: SI units throughout. Long work runs on its own thread without the interpreter's lock,
//! so that other Python threads go on and an interrupt ends the wait. Every error is an exception
//! of this package with the words of the command line, and arguments in place of its options.

mod cell;
mod errors;
mod logging;
mod recording;
mod result;
mod rows;
mod words;
mod work;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    logging::start();
    errors::add_to(module)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<cell::Cell>()?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<result::Result>()?;
    module.add_function(wrap_pyfunction!(recording::read, module)?)?;
    module.add_function(wrap_pyfunction!(result::identify, module)?)?;
    module.add_function(wrap_pyfunction!(in_python, module)?)?;
    Ok(())
}

/// Returns a message of the program with arguments in place of options.
#[pyfunction]
fn in_python(message: &str) -> String {
    words::in_python(message).into_owned()
}
