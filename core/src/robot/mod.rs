//! What an arm is: links, joints, transmission, limits, friction and the names of parameters.

/// An arm as read from its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {}
