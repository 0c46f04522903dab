//! The cell file as written by the user. [`Cell`](super::Cell) is the form that the program needs.

use core::fmt;
use std::collections::BTreeMap;
use std::path::PathBuf;

use didim_drivers::layout::LayoutSpec;
use didim_drivers::units::DriveSpec;
use didim_dynamics::control::SimulatedController;
use didim_dynamics::robot::SignModel;
use didim_identification::identification::{
    DecimationFilter, KeptParameters, Method, PositionFilter, SimulationOptions, Tolerances, Use,
    VerdictLimits,
};
use didim_identification::regression::RobustLoss;
use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Deserializer};

use super::BusAddress;
use super::data::DataSection;
use crate::archive::drift::DriftOptions;
use crate::live::acquire::RealTimeOptions;
use crate::live::recording::RecordingOptions;
use crate::live::worker::WindowOptions;

/// The whole file. Unknown keys are errors.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellFile {
    /// Name of the cell. It is part of the names of its shared memory and results.
    pub name: String,
    /// The robot file or a URDF, relative to the cell file.
    pub robot: PathBuf,
    /// Drive data that a URDF does not contain.
    #[serde(default)]
    pub urdf: Option<UrdfSection>,
    /// The bus and the meaning of its frames.
    #[serde(default)]
    pub bus: Option<BusSection>,
    /// Recordings of other programs, in place of a bus.
    #[serde(default)]
    pub data: Option<DataSection>,
    /// Controller of the arm. Methods that simulate the closed loop need it.
    #[serde(default)]
    pub controller: Option<SimulatedController>,
    /// Conditions for identification; a cell without a bus has no windows.
    #[serde(default)]
    pub window: Option<WindowOptions>,
    /// Content and method of the identification.
    pub identification: IdentificationSection,
    /// Operation of the service.
    #[serde(default)]
    pub service: ServiceSection,
}

/// `[urdf]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UrdfSection {
    /// Base link of the arm, if the URDF has several roots or the arm begins later.
    #[serde(default)]
    pub base: Option<String>,
    /// Last link of the arm, if it has several ends or continues as a gripper.
    #[serde(default)]
    pub tip: Option<String>,
    /// True if the inertias of the drives are parameters.
    #[serde(default)]
    pub drive_inertia: Option<bool>,
    /// Turns of each motor per turn of its joint.
    #[serde(default)]
    pub gear_ratios: Option<Vec<f64>>,
    /// Same as `[friction]` of a robot file.
    #[serde(default)]
    pub friction: Option<toml::Table>,
    /// Settings of single joints, by joint name: keys of a joint of a robot file.
    #[serde(default)]
    pub joints: BTreeMap<String, toml::Table>,
    /// Friction of single joints in the form of earlier versions; now `friction` under `joints`.
    #[serde(default)]
    pub joint_friction: toml::Table,
}

/// `[bus]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BusSection {
    /// One bus, or several that carry parts of the same layout.
    #[serde(deserialize_with = "super::address::one_or_more")]
    pub source: Vec<BusAddress>,
    /// Receive buffer of each socket \[bytes\]. 4 MiB hold about two seconds at 5 kHz.
    #[serde(default = "BusSection::default_receive_buffer_bytes")]
    pub receive_buffer_bytes: u32,
    /// Bit rate of the bus, in CAN FD that of the arbitration \[bit/s\]. `didim check` uses it to
    /// report whether the frames fit. It sets nothing.
    #[serde(default)]
    pub bitrate_bps: Option<u32>,
    /// Bit rate of the data phase of CAN FD frames with bit rate switching \[bit/s\].
    #[serde(default)]
    pub data_bitrate_bps: Option<u32>,
    /// Meaning of the bits of each frame.
    pub layout: LayoutSpec,
    /// Gains of each drive, in the order of the axes.
    pub drives: Vec<DriveSpec>,
}

impl BusSection {
    fn default_receive_buffer_bytes() -> u32 {
        4 << 20
    }
}

/// `position_filter` of `[identification]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a filter such as { cutoff_hz = 50.0 }")]
pub struct PositionFilterSection {
    /// Order of one pass; the method's default if left out.
    #[serde(default = "PositionFilter::default_order")]
    pub order: usize,
    /// Cut-off of one pass.
    pub cutoff_hz: Cutoff,
}

/// The cut-off of the position filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cutoff {
    /// Stated \[Hz\].
    Hz(f64),
    /// The data choose it.
    Auto,
}

impl<'de> Deserialize<'de> for Cutoff {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl Visitor<'_> for Either {
            type Value = Cutoff;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a frequency in Hz or \"auto\"")
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Cutoff, E> {
                Ok(Cutoff::Hz(value))
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Cutoff, E> {
                i32::try_from(value)
                    .map(|value| Cutoff::Hz(f64::from(value)))
                    .map_err(|_| E::invalid_value(Unexpected::Signed(value), &self))
            }

            fn visit_str<E: serde::de::Error>(self, value: &str) -> Result<Cutoff, E> {
                match value {
                    "auto" => Ok(Cutoff::Auto),
                    other => Err(E::invalid_value(Unexpected::Str(other), &self)),
                }
            }
        }

        deserializer.deserialize_any(Either)
    }
}

/// Source of the joints' friction laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionSource {
    /// The data choose them.
    Auto,
}

/// `[identification]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdentificationSection {
    /// The method.
    pub method: Method,
    /// Sign model of Coulomb friction, if it differs from the robot file's.
    #[serde(default)]
    pub sign: Option<SignModel>,
    /// Source of the friction laws, if not the robot file.
    #[serde(default)]
    pub friction: Option<FrictionSource>,
    /// Filter of the positions.
    pub position_filter: PositionFilterSection,
    /// Filter and decimation of both sides of the equation.
    pub decimation_filter: DecimationFilter,
    /// Essential parameters; every base parameter if left out.
    #[serde(default)]
    pub parameters: Option<Vec<String>>,
    /// Other parameters fixed at the values of the robot file's `[nominal]`; they are 0 if left
    /// out.
    #[serde(default)]
    pub keep_nominal: Option<KeptParameters>,
    /// Loss that reduces the weight of rows with large residuals, if any.
    #[serde(default)]
    pub robust: Option<RobustLoss>,
    /// Conditions for an applicable result.
    #[serde(default)]
    pub limits: VerdictLimits,
    /// Intended uses of results.
    #[serde(default = "Use::usual")]
    pub required_uses: Vec<Use>,
    /// Names of the parameters whose values are required; those that contribute to the torque if
    /// left out.
    #[serde(default)]
    pub required_parameters: Option<Vec<String>>,
    /// Tolerances of the values configured in cell and robot.
    #[serde(default)]
    pub tolerances: Tolerances,
    /// Simulation of the closed loop and end of the iteration; needs `[controller]`.
    #[serde(default)]
    pub simulation: Option<SimulationOptions>,
}

/// `[service]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServiceSection {
    /// Where results go.
    pub state_directory: PathBuf,
    /// Folder of the sockets and the stream's own files. It has to be short, because socket paths
    /// are.
    pub runtime_directory: PathBuf,
    /// Permissions of the status socket, which decide who may query the status. Default `0o660`:
    /// the service's user and the socket's group.
    pub status_mode: u32,
    /// Group of the status socket; the service's own group if left out.
    pub status_group: Option<String>,
    /// Permissions of the command socket, which decide who may give commands: `0o600`, or `0o660`
    /// with a `command_group`.
    pub command_mode: Option<u32>,
    /// Group of the command socket; the service's own group if left out.
    pub command_group: Option<String>,
    /// Number of results kept; older ones are removed.
    pub keep_results: usize,
    /// Time that the worker may be busy before samples are lost \[s\].
    pub buffer_s: f64,
    /// Priority and processor of the bus thread.
    pub real_time: RealTimeOptions,
    /// One process for everything, or one each for acquisition and estimation.
    pub processes: Processes,
    /// Raw frames on disk; none are recorded if left out.
    pub recordings: Option<RecordingOptions>,
    /// Limits of drift from the baseline.
    pub drift: DriftOptions,
}

impl Default for ServiceSection {
    fn default() -> Self {
        Self {
            state_directory: PathBuf::from("/var/lib/didim"),
            runtime_directory: PathBuf::from("/run/didim"),
            status_mode: 0o660,
            status_group: None,
            command_mode: None,
            command_group: None,
            keep_results: crate::archive::store::DEFAULT_KEEP,
            buffer_s: crate::live::stream::DEFAULT_BUFFER_S,
            real_time: RealTimeOptions::default(),
            processes: Processes::One,
            recordings: None,
            drift: DriftOptions::default(),
        }
    }
}

impl ServiceSection {
    /// Returns the permissions of the command socket.
    pub fn command_mode(&self) -> u32 {
        let usual = if self.command_group.is_some() { 0o660 } else { 0o600 };
        self.command_mode.unwrap_or(usual)
    }
}

/// Number of processes that share the work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Processes {
    /// Acquisition and estimation in one process.
    #[default]
    One,
    /// `didim run --part acquisition` and `didim run --part estimation`.
    Two,
}
