//! Frame settings of a bus in a cell file.

use std::path::PathBuf;

use didim_dynamics::SignalTiming;
use didim_dynamics::robot::TorqueTerm;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The table `[bus.layout]` of a cell file: it selects the arm's signals from a DBC file.
///
/// A signal is named `Message.Signal`; `{axis}` represents the number of the axis, from 1, and
/// `{index}` from 0.
/// Alternatively, a list names the signal of each axis ([`SignalNames`]). With `nodes` or `slaves`
/// it is an object of every drive's dictionary, such as `6064:00`, and its unit. Every signal has a
/// validity time relative to the instant of its sample: the SYNC, or the arrival of the packed
/// frame.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayoutSpec {
    /// The DBC file. A layout has `dbc`, `nodes` or `slaves`.
    ///
    /// If left out: `nodes` or `slaves` describe the frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dbc: Option<PathBuf>,
    /// The CANopen drives with their device files, one entry for each axis, in their order; in
    /// place of `dbc`, `sync` and `counter`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<NodeSpec>,
    /// The ENI file by which the EtherCAT master was configured. `slaves` need it, or `startup`.
    ///
    /// If left out: `startup` describes the slaves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eni: Option<PathBuf>,
    /// A capture that begins before the EtherCAT master starts and ends when the drives run: didim
    /// learns from it how the master configured the slaves.
    ///
    /// If left out: `eni` describes the slaves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub startup: Option<PathBuf>,
    /// The EtherCAT drives, one entry for each axis, in their order; in place of `dbc`, `sync` and
    /// `counter`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub slaves: Vec<SlaveSpec>,
    /// Number of axes.
    pub axes: usize,
    /// The nominal period of the bus cycle \[µs\].
    ///
    /// If left out: `rate_hz` states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_us: Option<f64>,
    /// The nominal rate of the bus cycle \[Hz\]. A layout has `rate_hz` or `period_us`.
    ///
    /// If left out: `period_us` states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// The message whose arrival is the instant of the sample. Without it every signal lies in one
    /// packed message, and the arrival of that is the instant. On a bus without SYNC it is any
    /// message that comes once a cycle, and may carry signals; every signal is then valid at its
    /// own `"arrival"`.
    ///
    /// If left out: one packed message.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sync: Option<String>,
    /// Method of counting bus cycles. `"stamps"`: by the times of the frames, which have to be
    /// within half a period of their place, so that a missing SYNC and a wrong rate are noticed.
    /// `"frames"`: each SYNC or packed frame is the next cycle, however late it is stamped, for
    /// adapters and virtual machines that deliver in bursts.
    #[serde(default)]
    pub cycles_by: CyclesBy,
    /// The measured position of the motor.
    pub position: PositionSpec,
    /// The torque of the motor, demanded or measured.
    pub torque: TorqueSpec,
    /// Terms that the recorded torques do not contain, because controller or drive subtracted
    /// them: `["gravity"]`, `["friction"]` or both. The model of these torques has no such term.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excludes: Vec<TorqueTerm>,
    /// The position command of the drive. Required by the methods that simulate the closed loop.
    ///
    /// If left out: none, not on the bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceSpec>,
    /// Signal or object of the status word of CiA 402 (6041h): a cycle counts when every drive is
    /// in the state "operation enabled".
    ///
    /// If left out: every cycle counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status_word: Option<String>,
    /// With a DBC file, in place of `status_word`: a state that drives of another kind send.
    ///
    /// If left out: every cycle counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enabled: Option<EnabledSpec>,
    /// Temperature of each motor, however seldom it comes.
    ///
    /// If left out: none, not on the bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<ReadingSpec>,
    /// Supply or DC link voltage of each drive, however seldom it comes.
    ///
    /// If left out: none, not on the bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supply_voltage: Option<ReadingSpec>,
    /// Mode of each drive (6061h of CiA 402): a window ends where one changes, and a log is cut
    /// there.
    ///
    /// If left out: none, not on the bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<ReadingSpec>,
    /// With a DBC file: the control law that each command holds in addition to the position, as in
    /// MIT mode. Where it stays along a record, the methods that simulate the loop take it in place
    /// of `[controller]`.
    ///
    /// If left out: none, not on the bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<LawSpec>,
    /// With a DBC file: frames that have the identifier of a message and carry something else. They
    /// are counted as `excepted`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub except: Vec<ExceptSpec>,
    /// Signal of a counter in the packed message, one more for each sample.
    ///
    /// If left out: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counter: Option<String>,
}

/// One node of `nodes`: a CANopen drive, or one axis of it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodeSpec {
    /// Its number on the bus, 1 to 127; `$NODEID` in the file.
    pub node_id: u8,
    /// Its EDS file: what the drive does after a reset.
    ///
    /// If left out: `dcf` is the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eds: Option<PathBuf>,
    /// Its DCF file: how the drive was configured.
    ///
    /// If left out: `eds` is the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dcf: Option<PathBuf>,
    /// Added to the index of every object: 0x800 for the second axis of a multi-axis drive (CiA
    /// 402). Such a drive is listed once for each axis.
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
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlaveSpec {
    /// Its name in the ENI file.
    ///
    /// If left out: `address` says which.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its station address, as the master configured it; the only one that a `startup` knows.
    ///
    /// If left out: `name` says which.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub address: Option<u16>,
    /// Added to the index of every object: 0x800 for the second axis of a multi-axis drive (CiA
    /// 402). Such a drive is listed once for each axis.
    #[serde(default)]
    pub object_offset: u16,
}

/// Method of counting bus cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
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
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "`Message.Signal` with {axis}, or a list of one for each axis")]
pub enum SignalNames {
    /// `Message.Signal` with `{axis}`, which counts from 1, or `{index}`, which counts from 0.
    Pattern(String),
    /// `Message.Signal` of each axis, in the order of the axes.
    Listed(Vec<String>),
}

/// Signal that shows if a drive is enabled.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnabledSpec {
    /// Its signal of the DBC file, as of `position`: an unsigned integer of at most 16 bits, with
    /// factor 1 and offset 0. Its bits may be those of other signals.
    pub signal: SignalNames,
    /// Its value where the drive is enabled.
    pub is: u16,
}

/// Signal of an additional reading of a drive.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReadingSpec {
    /// With a DBC file: `Message.Signal`, as of `position`; one signal may be that of every axis. A
    /// temperature is in "degC", "°C" or "C", or in tenths ("0.1 degC", "0.1 °C"); a voltage in
    /// "V", "mV", "0.1 V" or "0.01 V"; a mode is an integer of at most 16 bits.
    ///
    /// If left out: `object` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object in hexadecimal, as `6064:00`.
    ///
    /// If left out: `signal` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, one of those; none of a mode.
    ///
    /// If left out: that of the DBC file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

/// Signals of a law that is sent with each command, τ = `stiffness` (p_d − p) + `damping` (`speed`
/// − v) + `torque`, where p_d is the reference: `Message.Signal` of the DBC file, with `{axis}` or
/// of each axis.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LawSpec {
    /// Its signal, as of `position`, in "Nm/rad" \[N·m/rad\]; 0 to 511.
    pub stiffness: SignalNames,
    /// Its signal, in "Nms/rad" \[N·m·s/rad\]; 0 to 5.1.
    pub damping: SignalNames,
    /// The signal of the speed that is asked for, in "rad/s" \[rad/s\]; to ±65.
    pub speed: SignalNames,
    /// The signal of the torque that is added, in "Nm" \[N·m\]; to ±131.
    pub torque: SignalNames,
}

/// Frames with the identifier of a message and other content, such as replies about registers.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExceptSpec {
    /// Its signal of the DBC file, as of `position`: an unsigned integer of at most 16 bits, with
    /// factor 1 and offset 0. Its bits may be those of other signals.
    pub signal: SignalNames,
    /// Its values in such frames.
    pub is: Vec<u16>,
}

/// The signal of the measured position.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PositionSpec {
    /// With a DBC file: `Message.Signal`, with `{axis}` in place of the number of the axis, from 1;
    /// or a list of one for each axis.
    ///
    /// If left out: `object` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object in hexadecimal, as `6064:00`.
    ///
    /// If left out: `signal` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, which their files do not state; the gains
    /// are checked against it.
    ///
    /// If left out: that of the DBC file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// When it is valid: `"instant"`, at the instant of the sample, where drives latch it;
    /// `"arrival"`, at the arrival of its own frame, on a bus without SYNC: it is interpolated to
    /// the instant of the sample.
    pub valid: PositionValidity,
}

/// Validity time of a measured position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PositionValidity {
    /// At the instant of the sample: drives latch the position there.
    Instant,
    /// At the arrival of its own frame: the position is interpolated to the instant of the sample.
    Arrival,
}

/// The signal of the torque.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TorqueSpec {
    /// With a DBC file: `Message.Signal`, with `{axis}` in place of the number of the axis, from 1;
    /// or a list of one for each axis.
    ///
    /// If left out: `object` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object in hexadecimal, as `6064:00`.
    ///
    /// If left out: `signal` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, which their files do not state; the gains
    /// are checked against it.
    ///
    /// If left out: that of the DBC file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// When it is valid: `"instant"`, at the instant of the sample, as a measured torque;
    /// `"arrival"`, as of the position; `{ held = { … } }`, a command that the current loop holds
    /// until the next one.
    pub valid: TorqueValidity,
}

/// Validity time of a torque.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
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
        /// Time for which a command acts \[µs\], as a rule the cycle of the position controller; 0
        /// to ten periods of the samples.
        hold_us: f64,
        /// Time from the instant of the sample to the start of its action \[µs\]; 0 to ten periods
        /// of the samples.
        delay_us: f64,
    },
}

/// Longest hold or delay of a torque, in samples: a longer one is a unit error.
const HOLD_DELAY_SAMPLES: f64 = 10.0;

impl TorqueValidity {
    /// Returns the timing of the torque in seconds.
    ///
    /// # Errors
    /// Returns a description of the problem, if the hold or the delay is not possible at `rate_hz`
    /// samples per second.
    pub fn timing(&self, rate_hz: f64) -> Result<SignalTiming, String> {
        let Self::ZeroOrderHold { hold_us, delay_us } = *self else {
            return Ok(SignalTiming::INSTANTANEOUS);
        };
        let most_us = HOLD_DELAY_SAMPLES * 1e6 / rate_hz;
        if [hold_us, delay_us].iter().all(|us| (0.0..=most_us).contains(us)) {
            return Ok(SignalTiming { hold_s: hold_us * 1e-6, delay_s: delay_us * 1e-6 });
        }
        Err(format!("hold_us and delay_us have to be between 0 and {most_us} (ten periods)"))
    }
}

/// The signal of the reference position.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReferenceSpec {
    /// With a DBC file: `Message.Signal`, with `{axis}` in place of the number of the axis, from 1;
    /// or a list of one for each axis.
    ///
    /// If left out: `object` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalNames>,
    /// With `nodes` or `slaves`: index and sub-index of the object in hexadecimal, as `6064:00`.
    ///
    /// If left out: `signal` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// With `nodes` or `slaves`: the unit of the object, which their files do not state; the gains
    /// are checked against it.
    ///
    /// If left out: that of the DBC file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// When it takes effect: `"instant"`, in the sample whose cycle carries it, as one that the
    /// drive reports; `"next-sync"`, in the next sample, as a synchronous RPDO (CiA 301) and an
    /// output of EtherCAT; `"arrival"`, as of the position.
    pub valid: ReferenceValidity,
    /// Where no target is on the bus: the signal is a following error in the unit of the position,
    /// and this difference. `"target-minus-actual"`, as 60F4h of CiA 402: the reference is the sum
    /// of position and following error; `"actual-minus-target"`: their difference. Drives have
    /// either: move one axis slowly forward, and the target is ahead.
    ///
    /// If left out: it is a position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub following_error: Option<FollowingErrorSign>,
}

/// Sign convention of a following error: drives use either one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FollowingErrorSign {
    /// Target position minus measured position, like 60F4h of CiA 402: the reference is their sum.
    TargetMinusActual,
    /// Measured position minus target position: the reference is their difference.
    ActualMinusTarget,
}

impl FollowingErrorSign {
    /// Returns the factor with which the following error is added to the measured position.
    pub fn sign(self) -> f64 {
        match self {
            Self::TargetMinusActual => 1.0,
            Self::ActualMinusTarget => -1.0,
        }
    }
}

/// Time at which a reference takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
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
