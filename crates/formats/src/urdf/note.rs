//! Notes on an arm that a URDF describes.

use core::fmt;

/// Note on an arm: nothing wrong, but worth knowing.
#[derive(Clone, Debug, PartialEq)]
pub enum UrdfNote {
    /// A moving link has no body: there are no nominal values.
    NoBody {
        /// The link.
        link: String,
    },
    /// An impossible body: there are no nominal values.
    ImpossibleBody {
        /// Its link.
        link: String,
        /// Why it cannot.
        problem: String,
    },
    /// A joint outside the chain is assumed to be fixed at 0.
    HeldStill {
        /// The joint.
        joint: String,
    },
    /// A limit that is 0 or missing remains unknown.
    OpenLimit {
        /// The joint.
        joint: String,
        /// The attribute.
        what: &'static str,
    },
    /// A limit of the torque or force below the weight of the file's bodies. It remains unknown.
    PlaceholderEffort {
        /// The joints with this limit.
        joints: String,
        /// The limit \[N·m or N\].
        effort: f64,
        /// Static torque or force that this value does not hold \[N·m or N\].
        gravity: f64,
    },
    /// A joint without an end.
    Continuous {
        /// The joint.
        joint: String,
    },
    /// A range from 0 to 0, which is taken for unknown.
    OpenRange {
        /// The joint.
        joint: String,
    },
    /// Position limits that look like degrees.
    LimitsInDegrees {
        /// The joint.
        joint: String,
        /// Lower and upper limit \[as in the file\].
        range: [f64; 2],
    },
    /// An angle of a link's body that looks like degrees.
    BodyInDegrees {
        /// The link.
        link: String,
        /// The angle in the file.
        text: String,
    },
    /// An axis with entries that rounding left.
    CleanedAxis {
        /// The joint.
        joint: String,
        /// The axis in the file.
        text: String,
        /// Largest entry that is taken for 0, of an axis of length 1 \[1\].
        largest: f64,
    },
    /// Two axes that are nearly parallel.
    NearlyParallel {
        /// The joint after the other.
        joint: String,
        /// The angle between them.
        angle_rad: f64,
    },
    /// An angle that is printed with too few digits leaves two axes nearly parallel or
    /// perpendicular.
    RoughAngle {
        /// The joint after the other.
        joint: String,
        /// The angle in the file.
        text: String,
        /// Angle from parallel or perpendicular.
        angle_rad: f64,
    },
    /// An offset between two joints that is taken for zero.
    ZeroLength {
        /// The joint after the other.
        joint: String,
        /// The offset.
        length_m: f64,
    },
    /// Attributes that are not read.
    UnreadAttribute(UnreadAttribute),
}

/// An attribute that is not read, of an element that is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnreadAttribute {
    /// The element.
    pub element: String,
    /// The attribute.
    pub attribute: String,
    /// Line of the first one.
    pub line: usize,
    /// Number of elements that have it.
    pub places: usize,
}

impl UrdfNote {
    pub(super) fn is_of_link(&self, name: &str) -> bool {
        match self {
            Self::NoBody { link } | Self::ImpossibleBody { link, .. } => link == name,
            _ => false,
        }
    }
}

impl fmt::Display for UrdfNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoBody { link } => {
                write!(f, "the link `{link}` has no inertial: there are no nominal parameters")
            }
            Self::ImpossibleBody { link, problem } => {
                write!(f, "the link `{link}` has {problem}: there are no nominal parameters")
            }
            Self::HeldStill { joint } => {
                write!(f, "the joint `{joint}` is not part of the chain and is fixed at 0")
            }
            Self::OpenLimit { joint, what } => {
                write!(
                    f,
                    "the joint `{joint}` has no {what} in its <limit>: it is unknown, and what \
                    needs it says so"
                )
            }
            Self::PlaceholderEffort { joints, effort, gravity } => write!(
                f,
                "the effort {effort} in the <limit> of {joints} is taken for a placeholder: with \
                the file's own masses gravity reaches {gravity:.1}. The limit is unknown; give it \
                in [urdf.joints] of the cell"
            ),
            Self::Continuous { joint } => {
                write!(
                    f,
                    "the joint `{joint}` turns without end; 100 turns either way are taken for its \
                    range"
                )
            }
            Self::OpenRange { joint } => write!(
                f,
                "the joint `{joint}` has a range from 0 to 0: it is unknown, and 100 turns either \
                way are taken; give position_min_deg and position_max_deg in [urdf.joints] of the \
                cell"
            ),
            Self::LimitsInDegrees { joint, range: [lower, upper] } => write!(
                f,
                "the limits of the joint `{joint}`, {lower} and {upper}, look like degrees; they \
                are in radians: correct them, or give position_min_deg and position_max_deg in \
                [urdf.joints] of the cell"
            ),
            Self::BodyInDegrees { link, text } => write!(
                f,
                "`rpy` in the <inertial> of the link `{link}` has {text}, which looks like \
                degrees; it is in radians: correct it, the nominal inertia depends on it"
            ),
            Self::CleanedAxis { joint, text, largest } => write!(
                f,
                "the axis `{text}` of the joint `{joint}` has entries of at most {largest:.1e}, \
                which are taken for 0"
            ),
            Self::NearlyParallel { joint, angle_rad } => write!(
                f,
                "the axis of `{joint}` is {angle_rad:.1e} rad from parallel to the one before, and \
                taken for parallel"
            ),
            Self::RoughAngle { joint, text, angle_rad } => write!(
                f,
                "`{text}` in the <origin> of `{joint}` leaves its axis {angle_rad:.1e} rad from \
                parallel or perpendicular to the one before; give quarter turns with six decimals \
                (1.570796, 3.141593)"
            ),
            Self::ZeroLength { joint, length_m } => {
                write!(f, "offsets of `{joint}` cancel to {length_m:.1e} m, which is taken for 0")
            }
            Self::UnreadAttribute(UnreadAttribute { element, attribute, line, places }) => write!(
                f,
                "line {line}: `{attribute}` of <{element}> is not read ({places} in all); URDF \
                does not have it, and its value has no effect"
            ),
        }
    }
}
