//! Faults of a URDF.

/// Reason why the arm of a URDF cannot be identified. Lines are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UrdfError {
    /// Not XML. Correct it.
    #[error("it is no XML: {problem}")]
    Xml {
        /// Message of the parser, with the place.
        problem: String,
    },
    /// A document without an element.
    #[error("it has no element at all; give a URDF")]
    Empty,
    /// A document type, whose entities could stand for any content.
    #[error(
        "it has a document type (<!DOCTYPE …>), whose entities are not read; write their values in \
        their places, and remove it"
    )]
    DocumentType,
    /// More links than an arm has.
    #[error("line {line}: it has more than 1000 links or joints; give the URDF of the arm alone")]
    TooLarge {
        /// Line of the first link beyond the limit.
        line: usize,
    },
    /// A xacro file: macros that xacro has to expand.
    #[error(
        "line {line}: this is a xacro file: it contains `{what}`. Source the robot's packages, \
        expand the file with `xacro FILE > arm.urdf` and your robot's arguments (name:=value), and \
        give the result"
    )]
    Xacro {
        /// The element or the attribute's value.
        what: String,
        /// Line of the macro.
        line: usize,
    },
    /// Not a URDF. Give one.
    #[error("line {line}: the document is a <{found}>, not a <robot>; give a URDF")]
    NotARobot {
        /// Its element.
        found: String,
        /// Its line.
        line: usize,
    },
    /// An element misses a required part.
    #[error("line {line}: <{element}> has no {what}; add it")]
    Missing {
        /// The element.
        element: String,
        /// The missing part.
        what: &'static str,
        /// Its line.
        line: usize,
    },
    /// An element or a name appears twice.
    #[error("line {line}: {what} is there twice; keep one")]
    Twice {
        /// Name of the value.
        what: String,
        /// Place of the second one.
        line: usize,
    },
    /// A value is not a number.
    #[error("line {line}: `{text}` of `{attribute}` is not {expected}")]
    Number {
        /// Text found there.
        text: String,
        /// The attribute.
        attribute: &'static str,
        /// Expected content.
        expected: &'static str,
        /// Its line.
        line: usize,
    },
    /// The axis of a joint that moves is 0.
    #[error(
        "line {line}: joint `{joint}` has the axis `{text}`, which is no direction; give its \
        <axis> the direction in which the joint moves"
    )]
    ZeroAxis {
        /// The joint.
        joint: String,
        /// Its axis in the file.
        text: String,
        /// Its line.
        line: usize,
    },
    /// The rotation of a joint is in degrees.
    #[error(
        "line {line}: `rpy` of joint `{joint}` has {text}, which looks like degrees; it is in \
        radians: write {text} deg as {}",
        radians(text)
    )]
    Degrees {
        /// The joint.
        joint: String,
        /// The angle in the file.
        text: String,
        /// Line of the joint.
        line: usize,
    },
    /// A joint of a type that URDF does not have.
    #[error(
        "line {line}: the type \"{found}\" of joint `{joint}` does not exist; use revolute, \
        continuous, prismatic or fixed"
    )]
    UnknownType {
        /// The joint.
        joint: String,
        /// Its type.
        found: String,
        /// Its line.
        line: usize,
    },
    /// A joint names a link that is not there.
    #[error(
        "line {line}: joint `{joint}` names the link `{link}`, which is not there; its links are \
        {available}"
    )]
    UnknownLink {
        /// The joint.
        joint: String,
        /// The link.
        link: String,
        /// The available links.
        available: String,
        /// Its line.
        line: usize,
    },
    /// Two joints lead to one link, or a link to itself: no serial arm.
    #[error(
        "line {line}: joint `{joint}` closes a loop at the link `{link}`; an arm is a chain: open \
         the loop, and give each joint the torque that acts on it"
    )]
    Loop {
        /// The joint.
        joint: String,
        /// The link.
        link: String,
        /// Its line.
        line: usize,
    },
    /// The requested base or tip is no link.
    #[error("the {end} `{link}` is no link of the URDF; its links are {available}")]
    NoSuchEnd {
        /// `base` or `tip`.
        end: &'static str,
        /// The name.
        link: String,
        /// Those there are.
        available: String,
    },
    /// Several links to which no joint leads.
    #[error(
        "no joint leads to any of the links {roots}; name the base with --base, or with `base` in \
        [urdf] of the cell"
    )]
    Bases {
        /// Their names.
        roots: String,
    },
    /// Several ends of moving chains.
    #[error(
        "the arm could end at any of the links {}; name one with --tip, or with `tip` in [urdf] of \
        the cell",
        offered(forks, tips)
    )]
    Tips {
        /// Names of the links before a fork.
        forks: String,
        /// Names of the ends.
        tips: String,
    },
    /// No chain leads from the base to the tip.
    #[error("no chain of joints leads from the base `{base}` to the tip `{tip}`; choose others")]
    NotConnected {
        /// The base.
        base: String,
        /// The tip.
        tip: String,
    },
    /// No joint of the chain moves, or more than an arm can have.
    #[error("{found} joints move between `{base}` and `{tip}`; an arm has 1 to {largest}")]
    Joints {
        /// Number found.
        found: usize,
        /// The base.
        base: String,
        /// The tip.
        tip: String,
        /// Largest supported number.
        largest: usize,
    },
    /// A joint of the chain has a type that a single drive cannot move.
    #[error(
        "line {line}: joint `{joint}` is {kind}, which a chain of driven joints cannot have; end \
        the arm before it"
    )]
    Kind {
        /// The joint.
        joint: String,
        /// Its type.
        kind: &'static str,
        /// Its line.
        line: usize,
    },
    /// A joint of the chain that follows another.
    #[error(
        "line {line}: joint `{joint}` follows `{of}` (mimic) and has no own drive. Write the arm \
        as a robot file (TOML) with one joint for both, or end the chain before it"
    )]
    Mimic {
        /// The joint.
        joint: String,
        /// The one that it follows.
        of: String,
        /// Its line.
        line: usize,
    },
    /// A joint of the chain without limits, or with an empty range.
    #[error(
        "line {line}: joint `{joint}` has {problem}; state in its <limit> what the drive can do"
    )]
    Limit {
        /// The joint.
        joint: String,
        /// The problem.
        problem: String,
        /// Its line.
        line: usize,
    },
    /// The inertial of a link on a joint outside the arm is incomplete or physically impossible.
    #[error(
        "the link `{link}` hangs on joints which are no part of the arm, and its inertial is \
         incomplete or of no body; correct it, or remove it"
    )]
    ImpossibleHeld {
        /// The link.
        link: String,
    },
    /// The links behind joints outside the arm have more mass than the identified body.
    #[error(
        "with the inertials that the file has behind joints which are no part of the arm, nothing \
         possible is left for the link `{link}`; correct those inertials, or remove them"
    )]
    NothingLeft {
        /// The link.
        link: String,
    },
}

/// Converts an angle in degrees to the text of an angle in radians.
fn radians(text: &str) -> String {
    let degrees: f64 = text.parse().unwrap_or_default();
    format!("{:.9}", degrees.to_radians())
}

/// Lists the links at which an arm could end.
fn offered(forks: &str, tips: &str) -> String {
    match forks {
        "" => tips.to_owned(),
        forks => format!("{forks} (before the fork of a gripper) {tips}").trim_end().to_owned(),
    }
}
