//! Shape of a link for collision checks.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Joint, JointKind};

/// All points within a radius of a segment, in the frame of its link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// One end of the segment \[m\].
    pub from_m: [f64; 3],
    /// The other end \[m\]; equal to the first one for a ball.
    pub to_m: [f64; 3],
    /// Radius \[m\].
    pub radius_m: f64,
}

/// A capsule in a file. Without ends it reaches from the frame of its link to that of the next
/// link.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCapsule {
    /// One end of the segment, x, y and z \[m\].
    ///
    /// If left out: the origin of that frame.
    from_m: Option<[f64; 3]>,
    /// The other end \[m\]. Has to be stated where the next joint is prismatic.
    ///
    /// If left out: the origin of the next link's frame; of the last link its own.
    to_m: Option<[f64; 3]>,
    /// The radius \[m\]; greater than 0.
    radius_m: f64,
}

impl RawCapsule {
    /// Converts it to a capsule of a link; `next` is the joint on that link, `None` for the last
    /// link.
    pub(super) fn of_link(self, next: Option<&Joint>) -> Result<Capsule, String> {
        let Self { from_m, to_m, radius_m } = self;
        if !(radius_m.is_finite() && radius_m > 0.0) {
            return Err(format!("`radius_m` = {radius_m} must be finite and greater than 0"));
        }
        let end = match (to_m, next) {
            (Some(to_m), _) => to_m,
            (None, None) => [0.0; 3],
            (None, Some(next)) if next.kind == JointKind::Revolute => {
                [next.d_m, -next.r_m * next.alpha.sin, next.r_m * next.alpha.cos]
            }
            (None, Some(_)) => {
                return Err(
                    "the next joint slides, so that nothing says how far the link reaches; \
                    state `to_m`"
                        .to_owned(),
                );
            }
        };
        let from_m = from_m.unwrap_or_default();
        match from_m.iter().chain(&end).all(|value| value.is_finite()) {
            true => Ok(Capsule { from_m, to_m: end, radius_m }),
            false => Err("`from_m` and `to_m` must be finite numbers".to_owned()),
        }
    }
}
