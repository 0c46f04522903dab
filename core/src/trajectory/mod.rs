//! Reference motions that respect limits.
