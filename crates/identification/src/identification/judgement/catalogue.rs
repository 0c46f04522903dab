//! Catalogue of the findings: for each code its messages, the uses that it affects, its meaning and
//! its remedy. The reference page is written from it.

use super::finding_code::{FindingCode, Severity};
use crate::identification::problem::Use;

/// One row of the catalogue.
#[derive(Clone, Copy, Debug)]
pub struct CatalogueRow {
    /// The code. Some codes have a row for each severity.
    pub code: FindingCode,
    /// The consequence of the finding.
    pub severity: Severity,
    /// Its messages, with `…` and a lone N, M or P for values.
    pub messages: &'static [&'static str],
    /// The uses that it blocks, or whose refusal it may explain.
    pub uses: &'static [Use],
    /// Explanation of the finding.
    pub meaning: &'static str,
    /// Instruction to the user.
    pub remedy: &'static str,
}

use FindingCode as Code;
use Severity::{Advisory, Blocking, Explanatory};
use Use::{Monitoring, PhysicalValues, Prediction, RigidBody};

/// All uses whose verdict is yes or no.
const ALL_USES: &[Use] = &[Monitoring, Prediction, PhysicalValues, RigidBody];

/// The catalogue, the blocking findings first.
pub const CATALOGUE: &[CatalogueRow] = &[
    CatalogueRow {
        code: Code::OppositeCommand,
        severity: Blocking,
        messages: &[
            "the command of the described controller of joint N differs from the recorded one by \
             twice its size",
        ],
        uses: &[Prediction],
        meaning: "a sign is wrong, or a gain is three times too large; with IDIM-LS it explains \
             and does not block",
        remedy: "Check the sign of the joint's torque or position in the cell, or the gain",
    },
    CatalogueRow {
        code: Code::Controller,
        severity: Blocking,
        messages: &[
            "the command of the described controller of joint N differs from the recorded one by …",
        ],
        uses: &[Prediction],
        meaning: "the described controller did not command the recorded torques; with IDIM-LS it \
             explains and does not block",
        remedy: "Check gains and timing in `[controller]`, the reference, the drive's torque gain",
    },
    CatalogueRow {
        code: Code::ConditionNumber,
        severity: Blocking,
        messages: &["condition number … is above …"],
        uses: &[Monitoring, RigidBody],
        meaning: "the motion does not distinguish the parameters",
        remedy: "Record a richer motion, or identify fewer parameters",
    },
    CatalogueRow {
        code: Code::TorqueUncertainty,
        severity: Blocking,
        messages: &["the parameters leave the torque of joint N uncertain by …"],
        uses: &[Monitoring, RigidBody],
        meaning: "statistical uncertainty of the torque along the motion",
        remedy: "Move longer or more, or identify fewer parameters",
    },
    CatalogueRow {
        code: Code::RelativeError,
        severity: Blocking,
        messages: &["relative error … is above …"],
        uses: &[Prediction, RigidBody],
        meaning: "the model does not describe the torques",
        remedy: "Check drive gains, signs, timing (`valid`)",
    },
    CatalogueRow {
        code: Code::JointError,
        severity: Blocking,
        messages: &["relative error … of joint N is above …"],
        uses: &[Prediction],
        meaning: "the same of one joint",
        remedy: "Check its gear ratio, coupling, drive gain",
    },
    CatalogueRow {
        code: Code::FewRows,
        severity: Blocking,
        messages: &["… independent rows for each parameter, fewer than …"],
        uses: &[Monitoring, RigidBody],
        meaning: "too few rows for standard deviations",
        remedy: "Use longer windows (`window.min_s`), or fewer parameters",
    },
    CatalogueRow {
        code: Code::NotDecimated,
        severity: Blocking,
        messages: &["identified without the decimation filter, …"],
        uses: &[Monitoring, RigidBody],
        meaning: "a result for comparison only",
        remedy: "Set `identification.decimation_filter`",
    },
    CatalogueRow {
        code: Code::NegativeParameter,
        severity: Blocking,
        messages: &[
            "viscous friction … is negative, …",
            "Coulomb friction … is negative, …",
            "drive inertia … is negative, …",
        ],
        uses: &[PhysicalValues],
        meaning: "an impossible parameter, beyond its σ",
        remedy: "Check the signs of torque and transmission",
    },
    CatalogueRow {
        code: Code::IndefiniteMassMatrix,
        severity: Blocking,
        messages: &["the mass matrix is not positive definite at …"],
        uses: &[RigidBody],
        meaning: "no arm has these inertias",
        remedy: "Record a richer motion, or identify fewer parameters",
    },
    CatalogueRow {
        code: Code::NoBodies,
        severity: Blocking,
        messages: &["no physically consistent parameters explain the result: …"],
        uses: &[RigidBody],
        meaning: "no physically consistent parameters fit",
        remedy: "Check reversed signs and the torque delay",
    },
    CatalogueRow {
        code: Code::WrongSigns,
        severity: Blocking,
        messages: &["… of … drive inertias and friction coefficients are negative: …"],
        uses: ALL_USES,
        meaning: "all torques or all positions are sign-flipped",
        remedy: "Flip the sign of one of the two (`bus.drives`)",
    },
    CatalogueRow {
        code: Code::WrongSignsOfJoint,
        severity: Blocking,
        messages: &["all … identifiable drive inertias and friction coefficients of joint N are \
             negative: …"],
        uses: ALL_USES,
        meaning: "the torque or the position of this joint is sign-flipped",
        remedy: "Flip its sign (`bus.drives`)",
    },
    CatalogueRow {
        code: Code::OtherUnit,
        severity: Blocking,
        messages: &["the torque of joint N reaches …, … times its limit …"],
        uses: ALL_USES,
        meaning: "wrong unit or gain",
        remedy: "Check the unit of the torques, the drive's gain, or the limit in the robot file",
    },
    CatalogueRow {
        code: Code::OppositeSignal,
        severity: Explanatory,
        messages: &["the data fit decisively better with the … of motor N inverted: …"],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "a torque or a position is sign-flipped; without gravity on the joint the data \
             cannot tell which",
        remedy: "Flip its sign (`bus.drives`, `data`)",
    },
    CatalogueRow {
        code: Code::SwappedMotors,
        severity: Explanatory,
        messages: &[
            "the data fit decisively better with the drives of motors N and M swapped: …",
            "the data fit decisively better with the torques of motors N and M swapped: …",
            "the data fit decisively better with the positions of motors N and M swapped: …",
        ],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "two drives, or a signal of both, are swapped",
        remedy: "Check node and signal of each drive (`[bus.layout]`)",
    },
    CatalogueRow {
        code: Code::LowPassed,
        severity: Explanatory,
        messages: &["the data fit decisively better without a low-pass of … ms …"],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "a filter in the drive or the logger; the combined uncertainty includes it",
        remedy: "Record without this filter; check that the position filter is not too low",
    },
    CatalogueRow {
        code: Code::LateSignal,
        severity: Explanatory,
        messages: &["the data fit decisively better without a delay of … ms …"],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "a signal is logged late; the combined uncertainty includes it",
        remedy: "State when the signal is valid (`valid`, `torque_delay_us`, `position_delay_us`), \
             or record it in time",
    },
    CatalogueRow {
        code: Code::PositionScale,
        severity: Explanatory,
        messages: &[
            "the position scale of joint … fits the data best at …",
            "the data fit decisively better with the position of motor N multiplied by …",
        ],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "a gear ratio or the counts of an encoder are wrong",
        remedy: "Check the gear ratio (`transmission.rows`) and the scale of the position",
    },
    CatalogueRow {
        code: Code::Coupling,
        severity: Explanatory,
        messages: &[
            "the data fit decisively better with a coupling of … turns of motor N for one of \
             joint M: …",
        ],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "a coupling of the transmission has another sign or ratio, or is missing",
        remedy: "Correct the row of the motor (`transmission.rows`, `urdf.gear_ratios`)",
    },
    CatalogueRow {
        code: Code::DriveInertia,
        severity: Explanatory,
        messages: &[
            "the data fit decisively better with a parameter for the inertia of the drive \
             of joint N: …",
        ],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "the torque accelerates a drive whose inertia is not in the model",
        remedy: "Set `drive_inertia = true` for this joint: the torque is from the motor current",
    },
    CatalogueRow {
        code: Code::GravityDirection,
        severity: Explanatory,
        messages: &["the data fit decisively better with gravity along […] m/s² in the base: …"],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "the arm is mounted differently",
        remedy: "Correct `gravity_m_s2` of the robot file or of `[urdf]`: floor, wall or ceiling",
    },
    CatalogueRow {
        code: Code::GravityRemoved,
        severity: Explanatory,
        messages: &["the data fit decisively better without gravity: …"],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "the controller subtracted gravity from the torques that it reports",
        remedy: "Set `excludes = [\"gravity\"]`, or record torques that contain gravity",
    },
    CatalogueRow {
        code: Code::ConstantTorque,
        severity: Blocking,
        messages: &["the torque of motor N is … in all samples: …"],
        uses: ALL_USES,
        meaning: "a constant torque signal",
        remedy: "Check the signal; record a measured torque",
    },
    CatalogueRow {
        code: Code::UnsignedTorque,
        severity: Blocking,
        messages: &["the torques of motors N, … never cross zero, and turn back before it: …"],
        uses: ALL_USES,
        meaning: "absolute values of torque",
        remedy: "Record torques with their signs",
    },
    CatalogueRow {
        code: Code::ClippedTorque,
        severity: Explanatory,
        messages: &["the torque of motor N stays at its largest value, …"],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "the torque is clipped, and the residual is large",
        remedy: "Check the range of the signal and its unit (`torque.signal`), and the current \
             limit of the drive",
    },
    CatalogueRow {
        code: Code::FrozenPosition,
        severity: Explanatory,
        messages: &[
            "the position of motor N stands still from … to …",
            "the positions of motors … stand still from … to …",
        ],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "a frozen signal, then a jump: the log repeats old values",
        remedy: "Remove these rows from the table, which is then read in parts, or record again",
    },
    CatalogueRow {
        code: Code::TorqueGain,
        severity: Explanatory,
        messages: &[
            "the torque gain … fits the data best at …",
            "the data fit decisively better with the torque of motor N multiplied by …",
        ],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "the data contradict the configured gain, or the torque has another unit",
        remedy: "Check drive gain and gear ratio",
    },
    CatalogueRow {
        code: Code::TorqueDelay,
        severity: Explanatory,
        messages: &["the torque delay … fits the data best …"],
        uses: &[PhysicalValues, RigidBody],
        meaning: "the data contradict the configured delay",
        remedy: "Check hold and delay of the torque (`bus.layout`, `data.torque_valid`), or set \
             `torque_delay_us`",
    },
    CatalogueRow {
        code: Code::KnownTorque,
        severity: Explanatory,
        messages: &["the known torque on joint … fits the data best at …"],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "the data contradict `known_torque`",
        remedy: "Set its `factor`, or correct it",
    },
    CatalogueRow {
        code: Code::Geometry,
        severity: Explanatory,
        messages: &[
            "the zero of joint … fits the data best with … added to the positions …",
            "the twist …",
            "the axis distance …",
            "the link offset …",
        ],
        uses: &[Prediction, PhysicalValues, RigidBody],
        meaning: "the data contradict a zero or the geometry",
        remedy: "Check the encoder's zero (`bus.drives`) and the geometry in the robot file",
    },
    CatalogueRow {
        code: Code::Extrapolation,
        severity: Blocking,
        messages: &["torque uncertainty outside the recorded motion is …"],
        uses: &[Prediction],
        meaning: "torque uncertainty outside the recorded motion; the largest nuisance parameters \
             are named",
        remedy: "Record more and other motions, all joints over their range, and give several \
             `--input`",
    },
    CatalogueRow {
        code: Code::JointExtrapolation,
        severity: Blocking,
        messages: &["torque uncertainty of joint N outside the recorded motion is …"],
        uses: &[Prediction],
        meaning: "the same of one joint",
        remedy: "Move this joint more, together with the others",
    },
    CatalogueRow {
        code: Code::JointAtRest,
        severity: Blocking,
        messages: &["joint N does not move (…): …"],
        uses: &[Prediction],
        meaning: "the friction and inertia of a joint at rest are unknown",
        remedy: "Record it moving, or leave `\"prediction\"` out of `required_uses`",
    },
    CatalogueRow {
        code: Code::CrossValidation,
        severity: Blocking,
        messages: &["cross-validation error of …"],
        uses: &[Prediction],
        meaning: "cross-validation error",
        remedy: "Record more and other motions",
    },
    CatalogueRow {
        code: Code::TooFewMotions,
        severity: Blocking,
        messages: &["cross-validation needs two distinct motions …"],
        uses: &[Prediction],
        meaning: "cross-validation is impossible: repeats contain nothing new",
        remedy: "Record more and other motions",
    },
    CatalogueRow {
        code: Code::ParameterUncertainty,
        severity: Blocking,
        messages: &["combined uncertainty above …"],
        uses: &[PhysicalValues],
        meaning: "combined uncertainty of parameters",
        remedy: "Record a richer motion; configure closer tolerances (`identification.tolerances`) \
             where they are known",
    },
    CatalogueRow {
        code: Code::PositionsDisagree,
        severity: Blocking,
        messages: &[
            "the torques along the simulated motion give other parameters than the positions: …",
        ],
        uses: ALL_USES,
        meaning: "CLOE: controller or model is wrong",
        remedy: "Check the controller, or use a method on torques (`clie`, `didim`)",
    },
    CatalogueRow {
        code: Code::LocalMinimum,
        severity: Blocking,
        messages: &["the simulated torques differ by … times the noise of IDIM-LS: …"],
        uses: ALL_USES,
        meaning: "a local minimum, or another loop",
        remedy: "Choose another start; then check reference and controller",
    },
    CatalogueRow {
        code: Code::Insensitive,
        severity: Blocking,
        messages: &[
            "the simulated positions hardly depend on the parameters, …",
            "the simulated torques hardly depend on the parameters, …",
        ],
        uses: ALL_USES,
        meaning: "the criterion is insensitive",
        remedy: "Use another method (`clie`, `idim-ls`)",
    },
    CatalogueRow {
        code: Code::WeakInstruments,
        severity: Blocking,
        messages: &["a combination of parameters has instruments with a correlation of … only: …"],
        uses: ALL_USES,
        meaning: "IDIM-IV: the simulated motion is not the measured one",
        remedy: "Check reference and controller",
    },
    CatalogueRow {
        code: Code::IncompleteTorque,
        severity: Blocking,
        messages: &["no torque is recorded of joint N: …"],
        uses: &[RigidBody],
        meaning: "the inertia of a joint without a torque is not known; the use is undecided",
        remedy: "Record the torque of every joint, or use the result for the other joints alone",
    },
    CatalogueRow {
        code: Code::NoReference,
        severity: Advisory,
        messages: &["no reference was recorded: …"],
        uses: &[],
        meaning: "the filtered measured position replaces the reference",
        remedy: "Record the target position",
    },
    CatalogueRow {
        code: Code::SlowerLoop,
        severity: Advisory,
        messages: &["the simulated loop has a bandwidth of … Hz at one joint, …"],
        uses: &[],
        meaning: "a faster substitute loop diverges at this sample rate",
        remedy: "Nothing, or describe the cabinet's controller",
    },
    CatalogueRow {
        code: Code::ColouredResiduals,
        severity: Advisory,
        messages: &["the residuals of joint … are not white …"],
        uses: &[],
        meaning: "coloured residuals; σ accounts for them",
        remedy: "Nothing",
    },
    CatalogueRow {
        code: Code::PositionFilterUnchecked,
        severity: Advisory,
        messages: &["the effect of the position filter at … Hz could not be checked, …"],
        uses: &[],
        meaning: "the cut-off is close to half the sample rate",
        remedy: "Record at a higher rate, or lower the cut-off",
    },
    CatalogueRow {
        code: Code::PositionNoiseUnchecked,
        severity: Advisory,
        messages: &[
            "this method does not check the effect of the noise of the positions",
            "the effect of the noise of the positions on the loop could not be simulated",
        ],
        uses: &[],
        meaning: "one check did not run",
        remedy: "Nothing",
    },
    CatalogueRow {
        code: Code::TorqueDelayUnchecked,
        severity: Advisory,
        messages: &["the delay of the torques could not be checked: …"],
        uses: &[],
        meaning: "too few rows, or nothing moves",
        remedy: "Record longer",
    },
    CatalogueRow {
        code: Code::ControllerUnchecked,
        severity: Advisory,
        messages: &["the described controller could not be held against the recorded torques: …"],
        uses: &[],
        meaning: "the check of the controller did not run",
        remedy: "Record reference and command at the controller's period",
    },
    CatalogueRow {
        code: Code::FilterBias,
        severity: Advisory,
        messages: &["the position filter distorts the motion and moves P by …"],
        uses: &[],
        meaning: "bias of the filter; the combined uncertainty includes it",
        remedy: "Raise the cut-off",
    },
    CatalogueRow {
        code: Code::NoiseBias,
        severity: Advisory,
        messages: &["the noise of the positions distorts the friction law and moves P by …"],
        uses: &[],
        meaning: "bias of noise; the combined uncertainty includes it",
        remedy: "Measure positions with less noise; with `idim-ls`, lower the cut-off",
    },
    CatalogueRow {
        code: Code::ClippedTorque,
        severity: Advisory,
        messages: &["the torque of motor N stays at its largest value, …"],
        uses: &[],
        meaning: "perhaps clipped",
        remedy: "Check range and unit",
    },
    CatalogueRow {
        code: Code::FrozenPosition,
        severity: Advisory,
        messages: &["the position of motor N stands still …"],
        uses: &[],
        meaning: "a few frozen samples",
        remedy: "Remove the rows",
    },
    CatalogueRow {
        code: Code::Outliers,
        severity: Advisory,
        messages: &["… of … rows were downweighted, at …"],
        uses: &[],
        meaning: "outliers, with their times",
        remedy: "Check an encoder, a connector or a contact at that time",
    },
    CatalogueRow {
        code: Code::DownweightedThroughout,
        severity: Advisory,
        messages: &["… were downweighted throughout the motion, …"],
        uses: &[],
        meaning: "too many outliers",
        remedy: "Check the residuals: the model may be wrong",
    },
    CatalogueRow {
        code: Code::UnmodelledEffect,
        severity: Advisory,
        messages: &["largest unmodelled effect: …"],
        uses: &[],
        meaning: "largest unmodelled effect",
        remedy: "Friction law: try `friction = \"auto\"`. Coupling: check `transmission.rows`. \
             Left-out parameters: `identify --essential`",
    },
    CatalogueRow {
        code: Code::FarFromNominal,
        severity: Advisory,
        messages: &["the inertial parameters of link N are far from …"],
        uses: &[],
        meaning: "possible, and far from the nominal link",
        remedy: "Look for a missing spring or counterbalance, signs of gravity and axes",
    },
    CatalogueRow {
        code: Code::RateUnchecked,
        severity: Advisory,
        messages: &["the sample rate is taken as stated, …"],
        uses: &[],
        meaning: "frames or rows count, no times",
        remedy: "Compare the rate with the controller's configuration",
    },
    CatalogueRow {
        code: Code::TorqueLimitOpen,
        severity: Advisory,
        messages: &["joint … has no torque limit above the recorded torques: …"],
        uses: &[],
        meaning: "the unit of the torques is not checked, and small torques count as a share of \
             the largest torque of any joint",
        remedy: "Set `torque_max_nm` in the robot file",
    },
    CatalogueRow {
        code: Code::LoadFrame,
        severity: Advisory,
        messages: &["the given centre counts in the model's own frame of the last link, …"],
        uses: &[],
        meaning: "`payload`, `gains` and `design` on a URDF: a centre without the name of its \
             frame counts as in earlier versions, in a frame that the URDF does not show",
        remedy: "Name the frame of the centre: `--frame LINK`, or `frame` in `[payload]`",
    },
    CatalogueRow {
        code: Code::IncompleteTorque,
        severity: Advisory,
        messages: &["no torque of joint N is used: …", "the recorded torques do not contain …: …"],
        uses: &[],
        meaning: "`joints` or `excludes` of the cell: parameters that only this torque shows are \
             not identifiable",
        remedy: "Record complete torques, if you need these parameters",
    },
    CatalogueRow {
        code: Code::Other,
        severity: Advisory,
        messages: &["…"],
        uses: &[],
        meaning: "a finding of another version of didim, in a stored result",
        remedy: "Read its message",
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_its_row_and_no_row_is_there_twice() {
        for (index, row) in CATALOGUE.iter().enumerate() {
            let is_same =
                |other: &CatalogueRow| other.code == row.code && other.severity == row.severity;
            assert!(!CATALOGUE[..index].iter().any(is_same), "{}", row.code.name());
        }
        for code in FindingCode::ALL {
            assert!(CATALOGUE.iter().any(|row| row.code == *code), "{}", code.name());
        }
        for row in CATALOGUE {
            let has_uses = row.severity != Advisory;
            assert_eq!(has_uses, !row.uses.is_empty(), "{}", row.code.name());
            assert!(!row.messages.is_empty(), "{}", row.code.name());
        }
    }
}
