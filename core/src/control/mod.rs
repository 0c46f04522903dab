//! The joint controllers of the real loop as data.
