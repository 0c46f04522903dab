//! The cell file as it is typed. [`Cell`](super::Cell) is what the program needs.

use core::fmt;
use std::collections::BTreeMap;
use std::path::PathBuf;

use didim_core::control::SimulatedController;
use didim_core::identification::{
    DecimationFilter, KeptParameters, Method, PositionFilter, SimulationOptions, Tolerances, Use,
    VerdictLimits,
};
use didim_core::regression::RobustLoss;
use didim_core::robot::SignModel;
use didim_drivers::layout::LayoutSpec;
use didim_drivers::units::DriveSpec;
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
    /// Name of the cell: part of the names of its shared memory and results.
    pub name: String,
    /// The robot file or a URDF, relative to the cell file.
    pub robot: PathBuf,
    /// What a URDF does not say of the drives.
    #[serde(default)]
    pub urdf: Option<UrdfSection>,
    /// The bus and what its frames mean.
    #[serde(default)]
    pub bus: Option<BusSection>,
    /// In place of a bus: recordings of other programs.
    #[serde(default)]
    pub data: Option<DataSection>,
    /// What controls the arm: methods that simulate the closed loop need it.
    #[serde(default)]
    pub controller: Option<SimulatedController>,
    /// When to identify; a cell without a bus has no windows.
    #[serde(default)]
    pub window: Option<WindowOptions>,
    /// What to identify, and how.
    pub identification: IdentificationSection,
    /// How the service runs.
    #[serde(default)]
    pub service: ServiceSection,
}

/// `[urdf]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UrdfSection {
    /// The link on which the arm stands, where the URDF has several roots or the arm begins later.
    #[serde(default)]
    pub base: Option<String>,
    /// The link at which it ends, where it has several ends or goes on as a gripper.
    #[serde(default)]
    pub tip: Option<String>,
    /// Whether the inertias of the drives are parameters.
    #[serde(default)]
    pub drive_inertia: Option<bool>,
    /// Turns of each motor to one of its joint.
    #[serde(default)]
    pub gear_ratios: Option<Vec<f64>>,
    /// As `[friction]` of a robot file.
    #[serde(default)]
    pub friction: Option<toml::Table>,
    /// What single joints have of their own, by their names: keys of a joint of a robot file.
    #[serde(default)]
    pub joints: BTreeMap<String, toml::Table>,
    /// The friction of single joints, as earlier versions had it: `friction` under `joints`.
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
    /// Bit rate of the bus, in CAN FD that of the arbitration \[bit/s\]; `didim check` tells with it
    /// whether the frames fit. Nothing is set by it.
    #[serde(default)]
    pub bitrate_bps: Option<u32>,
    /// Bit rate of the data phase of CAN FD frames that switch \[bit/s\].
    #[serde(default)]
    pub data_bitrate_bps: Option<u32>,
    /// Which bits of which frame mean what.
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
    /// Order of one pass; that of the method's own default when left out.
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

/// Where the friction laws of the joints come from.
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
    /// Sign model of Coulomb friction, when another than the robot file's is wanted.
    #[serde(default)]
    pub sign: Option<SignModel>,
    /// Where the friction laws come from, when not from the robot file.
    #[serde(default)]
    pub friction: Option<FrictionSource>,
    /// Filter of the positions.
    pub position_filter: PositionFilterSection,
    /// Filter and decimation of both sides of the equation.
    pub decimation_filter: DecimationFilter,
    /// Essential parameters; every base parameter when left out.
    #[serde(default)]
    pub parameters: Option<Vec<String>>,
    /// Which of the others keep the values of the robot file's `[nominal]`; they are 0 when left out.
    #[serde(default)]
    pub keep_nominal: Option<KeptParameters>,
    /// Whether rows with large residuals count less, and how.
    #[serde(default)]
    pub robust: Option<RobustLoss>,
    /// What a result must satisfy to be called applicable.
    #[serde(default)]
    pub limits: VerdictLimits,
    /// What results are for.
    #[serde(default = "Use::usual")]
    pub required_uses: Vec<Use>,
    /// Names of the parameters whose values are asked for; those that carry torque when left out.
    #[serde(default)]
    pub required_parameters: Option<Vec<String>>,
    /// How well known is what cell and robot state.
    #[serde(default)]
    pub tolerances: Tolerances,
    /// How the closed loop is simulated, and when the iteration ends; needs `[controller]`.
    #[serde(default)]
    pub simulation: Option<SimulationOptions>,
}

/// `[service]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServiceSection {
    /// Where results go.
    pub state_directory: PathBuf,
    /// Where the sockets and the stream's own files are; short, because socket paths are.
    pub runtime_directory: PathBuf,
    /// Who may ask for the status, as the permissions of its socket: `0o660`, the service's user and
    /// the socket's group, unless another is said.
    pub status_mode: u32,
    /// Group of the status socket; the service's own when left out.
    pub status_group: Option<String>,
    /// Who may give commands, likewise: `0o600`, or `0o660` with a `command_group`.
    pub command_mode: Option<u32>,
    /// Group of the command socket; the service's own when left out.
    pub command_group: Option<String>,
    /// Results kept; older ones are removed.
    pub keep_results: usize,
    /// How long the worker may be busy before samples are lost \[s\].
    pub buffer_s: f64,
    /// Priority and processor of the bus thread.
    pub real_time: RealTimeOptions,
    /// One process for everything, or acquisition and estimation in one each.
    pub processes: Processes,
    /// Raw frames on disk; nothing records none.
    pub recordings: Option<RecordingOptions>,
    /// What counts as drift from the baseline.
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
    /// Permissions of the command socket.
    pub fn command_mode(&self) -> u32 {
        let usual = if self.command_group.is_some() { 0o660 } else { 0o600 };
        self.command_mode.unwrap_or(usual)
    }
}

/// How many processes share the work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Processes {
    /// Acquisition and estimation in one.
    #[default]
    One,
    /// `didim run --part acquisition` and `didim run --part estimation`.
    Two,
}
