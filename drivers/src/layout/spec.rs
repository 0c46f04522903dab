//! Frame settings of a bus in a cell file.

use std::path::PathBuf;

use didim_dynamics::SignalTiming;
use serde::{Deserialize, Serialize};

/// The table `[bus.layout]` of a cell file: it selects the arm's signals from a DBC file.
///
/// A signal is named `Message.Signal`; `{axis}` represents the number of the axis, from 1.
/// Alternatively, a list names the signal of each axis ([`SignalNames`]). With `nodes` or `slaves`
/// it is an object of every drive's dictionary, such as `6064:00`, and its unit. Every signal has a
/// validity time relative to the instant of its sample: the SYNC, or the arrival of the packed
/// frame.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LayoutSpec {
    /// The DBC file, relative to the cell file; or `nodes`, not both. The program that reads the
    /// cell file reads this one too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dbc: Option<PathBuf>,
    /// The nodes of CANopen drives with their device files, one per axis, in the order of the axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<NodeSpec>,
    /// The ENI file of an EtherCAT network, relative to the cell file; or `startup`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eni: Option<PathBuf>,
    /// A capture that holds the start-up of an EtherCAT network, relative to the cell file; or
    /// `eni`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub startup: Option<PathBuf>,
    /// The EtherCAT slaves, one per axis, in the order of the axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub slaves: Vec<SlaveSpec>,
    /// Number of axes.
    pub axes: usize,
    /// Nominal period of the bus cycle \[µs\]; or `rate_hz`, not both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_us: Option<f64>,
    /// Nominal rate of the bus cycle \[Hz\]; or `period_us`, not both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Message whose arrival is the instant of the sample. Without it every signal is in one packed
    /// message, and the arrival of that frame is the instant. On a bus without SYNC it is any
    /// message that arrives once a cycle. Every signal is then valid at the arrival of its own
    /// frame; the message may carry some of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sync: Option<String>,
    /// Method of counting bus cycles.
    #[serde(default)]
    pub cycles_by: CyclesBy,
    /// Measured motor position.
    pub position: PositionSpec,
    /// Motor torque, demanded or measured.
    pub torque: TorqueSpec,
    /// Target motor position of the drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceSpec>,
    /// CiA 402 status word (6041h): a cycle counts only if every drive is in the state "operation
    /// enabled".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status_word: Option<String>,
    /// State signal of the drives that is no CiA 402 status word: a cycle counts only if every axis
    /// has the one value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enabled: Option<EnabledSpec>,
    /// Temperature of each motor, at any rate of arrival.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<ReadingSpec>,
    /// Supply or DC link voltage of each drive, at any rate of arrival.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supply_voltage: Option<ReadingSpec>,
    /// Mode of each drive, an integer: a window ends if a mode changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<ReadingSpec>,
    /// Control law that each command contains in addition to the position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<LawSpec>,
    /// Frames of the layout's messages with other content.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub except: Vec<ExceptSpec>,
    /// Counter in the packed message, incremented by one per sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counter: Option<String>,
}

/// One node of `nodes`: a CANopen drive, or one axis of it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NodeSpec {
    /// Its number on the bus, 1 to 127.
    pub node_id: u8,
    /// EDS file, relative to the cell file: the settings of the drive after a reset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eds: Option<PathBuf>,
    /// DCF file instead: the configured settings of the drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dcf: Option<PathBuf>,
    /// Offset added to the index of every object: 0x800 for the second axis of a drive of several
    /// (CiA 402), which is listed once per axis.
    #[serde(default)]
    pub object_offset: u16,
}

impl NodeSpec {
    /// Returns the device file of either kind.
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
    /// Configured station address, instead of the name or in addition to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub address: Option<u16>,
    /// Offset added to the index of every object, as in [`NodeSpec`].
    #[serde(default)]
    pub object_offset: u16,
}

/// Method of counting bus cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CyclesBy {
    /// By the stamps of the frames, which have to be within half a period of their place. A missing
    /// SYNC is detected. At another rate than the nominal one, nothing is identified.
    #[default]
    Stamps,
    /// By the frames themselves, regardless of late stamps: each SYNC, or packed frame by its
    /// counter, is the next cycle. For adapters and virtual machines that deliver in bursts. A SYNC
    /// lost on the wire and a wrong nominal rate are not detected then. Missing axes, gaps of a
    /// counter and frames that the kernel dropped are detected.
    Frames,
}

/// Signals of a DBC file, one per axis.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(untagged, expecting = "`Message.Signal` with {axis}, or a list of one for each axis")]
pub enum SignalNames {
    /// `Message.Signal` with `{axis}`.
    Pattern(String),
    /// `Message.Signal` of each axis, in the order of the axes.
    Listed(Vec<String>),
}

/// Signal that shows if a drive is enabled.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EnabledSpec {
    /// `Message.Signal` of the DBC file, an unsigned integer of at most 16 bits.
    pub signal: SignalNames,
    /// Value for an enabled drive.
    pub is: u16,
}

/// Signal of an additional reading of a drive.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ReadingSpec {
    /// `Message.Signal` of the DBC file, with `{axis}` or of each axis; all axes may share one
    /// signal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, such as `6079:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: unit of the object, which their files do not contain; a mode has
    /// none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

/// Signals of a law that is sent with each command, τ = `stiffness` (p_d − p) + `damping` (`speed`
/// − v) + `torque`, where p_d is the reference: `Message.Signal` of the DBC file, with `{axis}` or
/// of each axis.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LawSpec {
    /// Factor of the position deviation.
    pub stiffness: SignalNames,
    /// Factor of the speed deviation.
    pub damping: SignalNames,
    /// Target speed.
    pub speed: SignalNames,
    /// Added torque.
    pub torque: SignalNames,
}

/// Frames with the identifier of a message and other content, such as replies about registers.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ExceptSpec {
    /// `Message.Signal` of the DBC file, an unsigned integer of at most 16 bits. Other signals may
    /// use the same bits.
    pub signal: SignalNames,
    /// Its values in such frames.
    pub is: Vec<u16>,
}

/// The signal of the measured position.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PositionSpec {
    /// `Message.Signal` of the DBC file, with `{axis}` or for each axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, such as `6064:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: unit of the object, which their files do not contain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Validity time.
    pub valid: PositionValidity,
}

/// Validity time of a measured position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PositionValidity {
    /// At the instant of the sample: drives latch the position there.
    Instant,
    /// At the arrival of its own frame: the position is interpolated to the instant of the sample.
    Arrival,
}

/// The signal of the torque.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueSpec {
    /// `Message.Signal` of the DBC file, with `{axis}` or for each axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, such as `6064:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: unit of the object, which their files do not contain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Validity time.
    pub valid: TorqueValidity,
}

/// Validity time of a torque.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum TorqueValidity {
    /// At the instant of the sample: a measured torque.
    Instant,
    /// At the arrival of its own frame: the torque is interpolated to the instant of the sample.
    Arrival,
    /// From a delay after the instant of the sample, for a limited time: a command that the current
    /// loop holds until the next one.
    #[serde(rename = "held")]
    ZeroOrderHold {
        /// Time for which the torque acts \[µs\]: usually the cycle of the position controller.
        hold_us: f64,
        /// Delay from the sample's instant until the torque acts \[µs\].
        delay_us: f64,
    },
}

/// Longest hold or delay of a torque, in samples: a longer one is a unit error.
const HOLD_SAMPLES: f64 = 10.0;

impl TorqueValidity {
    /// Returns the timing in seconds.
    ///
    /// # Errors
    /// Description of the problem at `rate_hz` samples per second.
    pub fn timing(&self, rate_hz: f64) -> Result<SignalTiming, String> {
        let Self::ZeroOrderHold { hold_us, delay_us } = *self else {
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
    /// `Message.Signal` of the DBC file, with `{axis}` or for each axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object, such as `6064:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: unit of the object, which their files do not contain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Validity time.
    pub valid: ReferenceValidity,
    /// Sign convention, if the signal is a following error instead of a position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub following_error: Option<FollowingError>,
}

/// Sign convention of a following error: drives use either one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FollowingError {
    /// Target position minus measured position, like 60F4h of CiA 402: the reference is their sum.
    TargetMinusActual,
    /// Measured position minus target position: the reference is their difference.
    ActualMinusTarget,
}

impl FollowingError {
    /// Returns the factor with which the following error is added to the measured position.
    pub fn sign(self) -> f64 {
        match self {
            Self::TargetMinusActual => 1.0,
            Self::ActualMinusTarget => -1.0,
        }
    }
}

/// Time at which a reference takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceValidity {
    /// In the sample whose cycle carries it: a reference that the drive reports.
    Instant,
    /// In the next sample: a synchronous RPDO received after SYNC k takes effect at SYNC k + 1
    /// (CiA 301).
    NextSync,
    /// At the arrival of its own frame: the reference is interpolated to the instant of the sample.
    Arrival,
}
