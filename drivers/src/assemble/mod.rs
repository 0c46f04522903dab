//! Frames to samples: a pure state machine.
