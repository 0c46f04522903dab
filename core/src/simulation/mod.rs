//! The closed loop, integrated.
