//! Source of the signals of a result.

use didim_formats::Side;

/// Source of the signals of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalSource {
    /// Frames of the cell's bus, as they come.
    Live,
    /// Frames of the cell's bus, from a log.
    Bus,
    /// Tables with the columns of `[data]`.
    Table,
    /// Tables with didim's own columns, on a side of the transmission.
    OwnTable(Side),
    /// Arrays in memory, in SI units. A cell has no scales, zeros or signs for them.
    Arrays,
    /// Bags with the joint states of `[data.bag]`.
    Bag,
}
