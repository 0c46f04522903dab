//! The service, its documents and its rooms.

mod common;

mod acquire;
mod arrows;
mod manager;
mod operations;
mod paths;
mod service;
mod status;
mod stream;
