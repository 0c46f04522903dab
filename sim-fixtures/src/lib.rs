//! The simulated arm as a virtual device on a CAN bus.
