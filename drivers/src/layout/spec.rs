//! What a cell file says about the frames of its bus.

use std::path::PathBuf;

use didim_core::identification::SignalTiming;
use serde::{Deserialize, Serialize};

/// The table `[bus.layout]` of a cell file: which signals of which DBC file are the arm's.
///
/// A signal is named `Message.Signal`; `{axis}` stands for the number of the axis, from 1, or a list
/// names each axis' own ([`SignalNames`]). With `nodes` or `slaves` it is an object of every drive's
/// dictionary, as `6064:00`, and its unit. Every signal says when it is valid, relative to the instant of
/// its sample: the SYNC, or the arrival of the packed frame.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LayoutSpec {
    /// The DBC file, relative to the cell file; or `nodes`, not both. Whoever reads the cell file
    /// reads this one too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dbc: Option<PathBuf>,
    /// The nodes of CANopen drives with their device files, one per axis, in the order of the axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<NodeSpec>,
    /// The ENI file of an EtherCAT network, relative to the cell file; or `startup`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eni: Option<PathBuf>,
    /// A capture that holds the start-up of an EtherCAT network, relative to the cell file; or `eni`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub startup: Option<PathBuf>,
    /// The EtherCAT slaves, one per axis, in the order of the axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub slaves: Vec<SlaveSpec>,
    /// Number of axes.
    pub axes: usize,
    /// The nominal period of the bus cycle \[µs\]; or `rate_hz`, not both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_us: Option<f64>,
    /// The nominal rate of the bus cycle \[Hz\]; or `period_us`, not both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// The message whose arrival is the instant of the sample. Without it every signal lies in one
    /// packed message, and that frame's arrival is the instant. On a bus without SYNC any message that
    /// comes once a cycle, where every signal is valid at the arrival of its own frame; it may carry
    /// some of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sync: Option<String>,
    /// How bus cycles are counted.
    #[serde(default)]
    pub cycles_by: CyclesBy,
    /// Measured motor position.
    pub position: PositionSpec,
    /// Motor torque, demanded or measured.
    pub torque: TorqueSpec,
    /// Motor position that the drive was told to reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceSpec>,
    /// CiA 402 status word (6041h): a cycle counts only when every drive is in the state "operation
    /// enabled".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status_word: Option<String>,
    /// A state that the drives send, where it is no CiA 402 status word: a cycle counts only when every
    /// axis has the one value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enabled: Option<EnabledSpec>,
    /// Temperature of each motor, however seldom it comes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<ReadingSpec>,
    /// Supply or DC link voltage of each drive, however seldom it comes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supply_voltage: Option<ReadingSpec>,
    /// Mode of each drive, an integer: a window ends where one changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<ReadingSpec>,
    /// The law that each command states beside the position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<LawSpec>,
    /// Which frames of the layout's messages carry something else.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub except: Vec<ExceptSpec>,
    /// A counter in the packed message, one more per sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counter: Option<String>,
}

/// One node of `nodes`: a CANopen drive, or one axis of it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NodeSpec {
    /// Its number on the bus, 1 to 127.
    pub node_id: u8,
    /// Its EDS file, relative to the cell file: what the drive does after a reset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eds: Option<PathBuf>,
    /// Its DCF file instead: how the drive was configured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dcf: Option<PathBuf>,
    /// Added to the index of every object: 0x800 for the second axis of a drive of several (CiA
    /// 402), which is listed once per axis.
    #[serde(default)]
    pub object_offset: u16,
}

impl NodeSpec {
    /// The device file, whichever it is.
    pub fn file(&self) -> Option<&std::path::Path> {
        self.eds.as_deref().or(self.dcf.as_deref())
    }
}

/// One entry of `slaves`: an EtherCAT drive, or one axis of it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SlaveSpec {
    /// Its name in the ENI file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its configured station address, in place of the name or beside it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub address: Option<u16>,
    /// Added to the index of every object, as in [`NodeSpec`].
    #[serde(default)]
    pub object_offset: u16,
}

/// How bus cycles are counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CyclesBy {
    /// The stamps of the frames, which have to be within half a period of their place: a SYNC that is
    /// missing is noticed, and what comes at another rate than the nominal one is not identified.
    #[default]
    Stamps,
    /// The frames themselves, however late they are stamped: each SYNC, or packed frame by its
    /// counter, is the next cycle. For adapters and virtual machines that deliver in bursts. A SYNC
    /// lost on the wire and a wrong nominal rate are not noticed then; missing axes, gaps of a counter
    /// and frames that the kernel dropped are.
    Frames,
}

/// Signals of a DBC file, one per axis.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(untagged, expecting = "`Message.Signal` with {axis}, or a list of one for each axis")]
pub enum SignalNames {
    /// `Message.Signal` with `{axis}`.
    Pattern(String),
    /// `Message.Signal` of each axis, in their order.
    Listed(Vec<String>),
}

/// The signal that tells whether a drive is enabled.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EnabledSpec {
    /// `Message.Signal` of the DBC file, an unsigned integer of at most 16 bits.
    pub signal: SignalNames,
    /// Its value where the drive is enabled.
    pub is: u16,
}

/// The signal of what a drive tells besides.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ReadingSpec {
    /// `Message.Signal` of the DBC file, with `{axis}` or of each axis; one signal may be that of all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, as `6079:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, which their files do not tell; none of a mode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

/// The signals of a law that comes with each command, τ = `stiffness` (p_d − p) + `damping` (`speed` − v) + `torque`, where
/// p_d is the reference: `Message.Signal` of the DBC file, with `{axis}` or of each axis.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LawSpec {
    /// What the deviation of the position is multiplied by.
    pub stiffness: SignalNames,
    /// What the deviation of the speed is multiplied by.
    pub damping: SignalNames,
    /// The speed asked for.
    pub speed: SignalNames,
    /// The torque that is added.
    pub torque: SignalNames,
}

/// Frames that have the identifier of a message and are something else, as answers about registers.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ExceptSpec {
    /// `Message.Signal` of the DBC file, an unsigned integer of at most 16 bits, which may be
    /// those of other signals.
    pub signal: SignalNames,
    /// Its values in such frames.
    pub is: Vec<u16>,
}

/// The signal of the measured position.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PositionSpec {
    /// `Message.Signal` of the DBC file, with `{axis}` or of each axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, as `6064:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, which their files do not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// When it is valid.
    pub valid: PositionValidity,
}

/// When a measured position is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PositionValidity {
    /// At the instant of the sample: drives latch it there.
    Instant,
    /// At the arrival of its own frame: it is interpolated to the instant of the sample.
    Arrival,
}

/// The signal of the torque.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueSpec {
    /// `Message.Signal` of the DBC file, with `{axis}` or of each axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, as `6064:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, which their files do not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// When it is valid.
    pub valid: TorqueValidity,
}

/// When a torque is valid.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum TorqueValidity {
    /// At the instant of the sample: a measured torque.
    Instant,
    /// At the arrival of its own frame: it is interpolated to the instant of the sample.
    Arrival,
    /// From the instant of the sample, later by a delay, for a while: a command that the current
    /// loop holds until the next one.
    Held {
        /// How long it acts \[µs\]: as a rule the cycle of the position controller.
        hold_us: f64,
        /// How much later than the sample's instant it starts to act \[µs\].
        delay_us: f64,
    },
}

/// The longest hold or delay of a torque, in samples: beyond it is a slip of units.
const HOLD_SAMPLES: f64 = 10.0;

impl TorqueValidity {
    /// In seconds.
    ///
    /// # Errors
    /// What is wrong with it for so many samples per second.
    pub fn timing(&self, rate_hz: f64) -> Result<SignalTiming, String> {
        let Self::Held { hold_us, delay_us } = *self else {
            return Ok(SignalTiming::INSTANTANEOUS);
        };
        let most_us = HOLD_SAMPLES * 1e6 / rate_hz;
        if [hold_us, delay_us].iter().all(|us| (0.0..=most_us).contains(us)) {
            return Ok(SignalTiming { hold_s: hold_us * 1e-6, delay_s: delay_us * 1e-6 });
        }
        Err(format!("hold_us and delay_us have to be between 0 and {most_us} (ten periods)"))
    }
}

/// The signal of the reference position.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceSpec {
    /// `Message.Signal` of the DBC file, with `{axis}` or of each axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, as `6064:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, which their files do not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// When it is valid.
    pub valid: ReferenceValidity,
    /// For a signal that is no position but a following error: which difference it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub following_error: Option<FollowingError>,
}

/// Which difference a following error is: drives have either.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FollowingError {
    /// The position to be reached less the measured one, as 60F4h of CiA 402: the reference is their sum.
    TargetMinusActual,
    /// The measured position less the one to be reached: the reference is their difference.
    ActualMinusTarget,
}

impl FollowingError {
    /// What it has to be multiplied by to be added to the measured position.
    pub fn sign(self) -> f64 {
        match self {
            Self::TargetMinusActual => 1.0,
            Self::ActualMinusTarget => -1.0,
        }
    }
}

/// When a reference takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceValidity {
    /// In the sample whose cycle carries it: a reference that the drive reports.
    Instant,
    /// In the next sample: a synchronous RPDO received after SYNC k takes effect at SYNC k + 1
    /// (CiA 301).
    NextSync,
    /// At the arrival of its own frame: it is interpolated to the instant of the sample.
    Arrival,
}
