//! Faults of a bus, a machine or a person: what is detected, within what time, counted as what, and
//! what a result says. [`file`] has the expectations, which were written down before anything was
//! run; [`executed`] holds the service to them, [`random`] to what matters most, with what [`draw`]
//! comes up with, and [`document`] is docs/evidence/reliability.md.

mod bench;
mod document;
mod draw;
mod executed;
mod file;
mod hour;
mod outcome;
mod random;
