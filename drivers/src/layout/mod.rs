//! Which bits of which frame mean what.
