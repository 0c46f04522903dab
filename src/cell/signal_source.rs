//! Source of the signals of a result.

/// Source of the signals of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalSource {
    /// Frames of the cell's bus, as they come.
    Live,
    /// Frames of the cell's bus, from a log.
    Bus,
    /// Tables with the columns of `[data]`, or with didim's own.
    Table,
    /// Bags with the joint states of `[data.bag]`.
    Bag,
}
