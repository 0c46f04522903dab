//! The output error methods, and instruments of the simulated motion, on simulated arms.

mod controller;
mod exact;
mod failures;
mod figures;
mod held_out;
mod instruments;
mod link_bodies;
mod loops;
mod recordings;
mod robust;
mod sensitivity;
mod variants;
