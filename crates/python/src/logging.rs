//! Log messages of the library, passed on to the logger `didim` of Python's `logging`.

use std::fmt;

use pyo3::prelude::*;
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt as _};

use crate::words::in_python;

/// Name of the logger.
const LOGGER: &str = "didim";

/// Starts to pass on messages. A second call has no effect.
pub(crate) fn start() {
    let passes_on = tracing_subscriber::registry().with(PassOn);
    let _ = tracing::subscriber::set_global_default(passes_on);
}

/// Passes a message on to Python.
pub(crate) fn log(python: Python<'_>, level: Level, message: &str) -> PyResult<()> {
    let level = match level {
        Level::ERROR => 40,
        Level::WARN => 30,
        Level::INFO => 20,
        Level::DEBUG | Level::TRACE => 10,
    };
    let logger = python.import("logging")?.call_method1("getLogger", (LOGGER,))?;
    // A `%` in the message is no format, because there are no arguments.
    logger.call_method1("log", (level, in_python(message))).map(drop)
}

struct PassOn;

impl<S: Subscriber> Layer<S> for PassOn {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let of_project = event.metadata().target().starts_with(LOGGER);
        if !of_project {
            return;
        }
        let mut message = Message(String::new());
        event.record(&mut message);
        Python::attach(|python| {
            // A message that cannot be passed on costs no result.
            let _ = log(python, *event.metadata().level(), &message.0);
        });
    }
}

/// The text of an event.
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        use std::fmt::Write as _;

        // Writing to a String cannot fail.
        let _ = match field.name() {
            "message" => write!(self.0, "{value:?}"),
            name => write!(self.0, " {name}={value:?}"),
        };
    }
}
