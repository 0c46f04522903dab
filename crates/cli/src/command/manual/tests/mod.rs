//! Tests that the manual matches the program.

mod keys;
mod pages;
