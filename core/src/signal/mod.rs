//! Zero-phase filters, differences and decimation.
