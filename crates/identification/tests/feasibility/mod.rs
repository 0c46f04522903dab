//! Consistent parameters through the public interface: estimates of random arms, and of the TX40.

mod arms;
mod coverage;
mod estimates;
mod refusals;
mod tx40;
