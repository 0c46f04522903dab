//! The manual, held to the program.

mod keys;
mod pages;
