//! The cell file as the user writes it. The program uses the validated form, [`Cell`](super::Cell).

use core::fmt;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;

use didim_drivers::layout::LayoutSpec;
use didim_drivers::units::DriveSpec;
use didim_dynamics::control::SimulatedController;
use didim_dynamics::robot::{SignModel, TorqueTerm};
use didim_formats::UrdfDrives;
use didim_identification::identification::{
    DecimationFilter, KeptParameters, Method, PositionFilter, SimulationOptions, Tolerances, Use,
    VerdictLimits,
};
use didim_identification::regression::RobustLoss;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::BusAddress;
use super::contact::ContactSection;
use super::data::DataSection;
use super::table::TableSection;
use super::torque_joints::JointReference;
use super::unit::OneOrEach;
use crate::archive::drift::DriftOptions;
use crate::live::real_time_options::RealTimeOptions;
use crate::live::recording::RecordingOptions;
use crate::live::window_options::WindowOptions;

/// The whole file. Unknown keys are errors.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellFile {
    /// Name of the cell. It is part of the names of its shared memory and stands in every result.
    pub name: String,
    /// The robot file (didim-robot(5)) or a URDF.
    pub robot: PathBuf,
    /// Properties of the drives, which a URDF does not have. Required with a URDF.
    ///
    /// If left out: the robot is a robot file.
    #[serde(default)]
    pub urdf: Option<UrdfSection>,
    /// The bus and the meaning of its frames. A cell has `[bus]` or `[data]`.
    ///
    /// If left out: the cell has `[data]`.
    #[serde(default)]
    pub bus: Option<BusSection>,
    /// Recordings of other programs, in place of a bus.
    ///
    /// If left out: the cell has `[bus]`.
    #[serde(default)]
    pub data: Option<DataSection>,
    /// Corrections of tables with didim's own columns.
    ///
    /// If left out: none.
    #[serde(default)]
    pub table: TableSection,
    /// Controller of the arm. Required by the methods that simulate the closed loop.
    ///
    /// If left out: unknown.
    #[serde(default)]
    pub controller: Option<SimulatedController>,
    /// When to identify. Required with `[bus]`.
    ///
    /// If left out: windows by command alone.
    #[serde(default)]
    pub window: Option<WindowOptions>,
    /// Identification: parameters, method and filters.
    pub identification: IdentificationSection,
    /// Frame of loads.
    ///
    /// If left out: as its defaults say.
    #[serde(default)]
    pub payload: PayloadSection,
    /// External torque of each joint, sample by sample. Needs `[bus]`.
    ///
    /// If left out: `didim run` estimates none.
    #[serde(default)]
    pub contact: Option<ContactSection>,
    /// Operation of the service.
    ///
    /// If left out: as its defaults say.
    #[serde(default)]
    pub service: ServiceSection,
}

impl CellFile {
    /// Returns the terms that the recorded torques do not contain.
    pub(super) fn excluded_terms(&self) -> &[TorqueTerm] {
        match (&self.bus, &self.data) {
            (Some(bus), _) => &bus.layout.excludes,
            (None, Some(data)) => &data.excludes,
            (None, None) => &[],
        }
    }
}

/// A table whose keys are defined by the format of another file.
type FreeTable = BTreeMap<String, serde_json::Value>;

/// `[urdf]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UrdfSection {
    /// True if the inertias of the drives are parameters: torque comes from motor current. False if
    /// joint torque sensors measure it.
    ///
    /// Required with a URDF.
    #[serde(default)]
    pub drive_inertia: Option<bool>,
    /// Motor turns per joint turn; 1 if the signals are on the joint side. Negative if they turn in
    /// opposite directions. For a prismatic joint radians of the motor per metre. If motors turn
    /// with several joints: a row for each motor with an entry for each joint, as
    /// `transmission.rows` of a robot file.
    ///
    /// Required with a URDF.
    #[serde(default)]
    pub gear_ratios: Option<GearRatios>,
    /// Friction terms: the keys of `[friction]` of a robot file.
    ///
    /// Required with a URDF.
    #[serde(default)]
    #[schemars(with = "Option<FreeTable>")]
    pub friction: Option<toml::Table>,
    /// Gravity in the frame of the link on which the arm stands \[m/s²\]: `[0.0, 0.0, 9.81]` for an
    /// arm that hangs from the ceiling.
    ///
    /// If left out: 9.81 m/s² along −z of the root.
    #[serde(default)]
    pub gravity_m_s2: Option<[f64; 3]>,
    /// The link on which the arm stands, if the URDF has several roots or the arm begins later.
    ///
    /// If left out: the root of the URDF.
    #[serde(default)]
    pub base: Option<String>,
    /// The link at which the arm ends, if the URDF has several ends or continues as a gripper.
    ///
    /// If left out: the end of the URDF.
    #[serde(default)]
    pub tip: Option<String>,
    /// Properties of single joints, by their names in the URDF: `drive_inertia`, `friction`,
    /// `known_torque`, the limits that replace those of the URDF, and the largest acceleration and
    /// jerk, with the keys of a joint in a robot file.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, FreeTable>")]
    pub joints: BTreeMap<String, toml::Table>,
    /// The friction of single joints, as earlier versions had it; now `friction` under `joints`.
    #[serde(default)]
    #[schemars(with = "FreeTable")]
    pub joint_friction: toml::Table,
}

/// Gear ratios of a URDF.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "one number for each joint, or a row of them for each motor")]
pub enum GearRatios {
    /// One for each joint.
    Each(Vec<f64>),
    /// A row for each motor, with one for each joint.
    Rows(Vec<Vec<f64>>),
}

impl GearRatios {
    /// Returns a row for each motor, with an entry for each joint.
    pub(super) fn rows(&self) -> Vec<Vec<f64>> {
        match self {
            Self::Each(ratios) => UrdfDrives::rows_of_ratios(ratios),
            Self::Rows(rows) => rows.clone(),
        }
    }
}

/// `[payload]`
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PayloadSection {
    /// Link of the URDF in whose frame loads are given and reported, such as `"tool0"`: the last
    /// link, or one that is fixed to it. `payload`, `gains`, `design` and the service use it;
    /// `--frame` replaces it.
    ///
    /// If left out: loads are reported in the frame of the link that the last joint moves. A centre
    /// that is given counts in the model's own frame of this link, with a finding.
    #[serde(default)]
    pub frame: Option<String>,
}

/// `[bus]`
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BusSection {
    /// Where the frames come from: `"can:INTERFACE"`, `"log:FILE"` (candump),
    /// `"ethercat:INTERFACE"` and `"pcap:FILE"` (a tap and a capture of EtherCAT) or `"inproc:"`
    /// (the simulated arm in the same process). A list of `can:` where several interfaces carry
    /// parts of one layout.
    #[serde(deserialize_with = "super::address::one_or_more")]
    #[schemars(with = "OneOrEach<String>")]
    pub source: Vec<BusAddress>,
    /// Receive buffer of each socket \[bytes\]. The kernel counts 768 bytes for a CAN FD frame and
    /// grants twice `net.core.rmem_max` at most.
    #[serde(default = "BusSection::default_receive_buffer_bytes")]
    pub receive_buffer_bytes: u32,
    /// Bit rate of the bus, with CAN FD of the arbitration phase \[bit/s\]; 1000 to 1 000 000. It
    /// configures nothing: `didim check` uses it to check whether the frames fit.
    ///
    /// If left out: unknown.
    #[serde(default)]
    pub bitrate_bps: Option<u32>,
    /// Bit rate of the data phase of CAN FD frames \[bit/s\]; `bitrate_bps` to 8 000 000. It
    /// configures nothing either.
    ///
    /// If left out: unknown.
    #[serde(default)]
    pub data_bitrate_bps: Option<u32>,
    /// Meaning of the bits of each frame.
    pub layout: LayoutSpec,
    /// Correction of the torques of all drives: a factor of each scale. Above 0.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub torque_factor: Option<f64>,
    /// Time from a sample to the instant at which its positions are valid, in addition to `valid`
    /// of the layout, negative if they are late; one for all axes or one for each \[µs\]; −500 000
    /// to 500 000.
    ///
    /// If left out: 0.
    #[serde(default)]
    pub position_delay_us: Option<OneOrEach<f64>>,
    /// The same of the torques \[µs\].
    ///
    /// If left out: 0.
    #[serde(default)]
    pub torque_delay_us: Option<OneOrEach<f64>>,
    /// The gains of each drive, in the order of the axes.
    pub drives: Vec<DriveSpec>,
}

impl BusSection {
    fn default_receive_buffer_bytes() -> u32 {
        4 << 20
    }
}

/// `position_filter` of `[identification]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a filter such as { cutoff_hz = 50.0 }")]
pub struct PositionFilterSection {
    /// Order of one pass.
    #[serde(default = "PositionFilter::default_order")]
    pub order: usize,
    /// Cut-off of one pass \[Hz\]: five times the highest dynamics to be modelled, or more.
    /// `"auto"`: the data choose it, for `didim identify` and `didim compare`.
    pub cutoff_hz: Cutoff,
}

/// The cut-off of the position filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cutoff {
    /// Configured cut-off \[Hz\].
    Hz(f64),
    /// The cut-off is chosen from the data.
    Auto,
}

impl JsonSchema for Cutoff {
    fn schema_name() -> Cow<'static, str> {
        "Cutoff".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "number" }, { "const": "auto" }] })
    }
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionSource {
    /// The data choose them.
    Auto,
}

/// `[identification]`
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdentificationSection {
    /// The method. All but `"idim-ls"` simulate the closed loop and need `[controller]`.
    pub method: Method,
    /// The law for the sign in Coulomb friction, for all joints: `sign` under `[friction]` of a
    /// robot file.
    ///
    /// If left out: that of the robot file.
    #[serde(default)]
    pub sign: Option<SignModel>,
    /// `"auto"`: the data choose the friction laws of the joints. For `didim identify` and `didim
    /// compare`.
    ///
    /// If left out: those of the robot file.
    #[serde(default)]
    pub friction: Option<FrictionSource>,
    /// Filter of the positions.
    pub position_filter: PositionFilterSection,
    /// Filter and decimation of both sides of the equation.
    pub decimation_filter: DecimationFilter,
    /// Names of the parameters to identify (didim-parameters(7)). Others are 0, unless they keep
    /// their nominal values.
    ///
    /// If left out: every base parameter.
    #[serde(default)]
    pub parameters: Option<Vec<String>>,
    /// Joints whose torque is used: numbers from 1, or names. The torques of other joints are not
    /// fitted, judged or predicted; their motion still counts. For arms with torque sensors at some
    /// joints, or dead ones. With `"idim-ls"`.
    ///
    /// If left out: every joint.
    #[serde(default)]
    pub joints: Option<Vec<JointReference>>,
    /// Parameters that are not identified and keep the values of `[nominal]` in the robot file.
    ///
    /// If left out: none.
    #[serde(default)]
    pub keep_nominal: Option<KeptParameters>,
    /// Loss that gives rows with large residuals less weight; with `"idim-ls"` and `"didim"`.
    ///
    /// If left out: least squares.
    #[serde(default)]
    pub robust: Option<RobustLoss>,
    /// Limits that a result has to satisfy to be applicable.
    ///
    /// If left out: as its defaults say.
    #[serde(default)]
    pub limits: VerdictLimits,
    /// Intended uses of results, which decide if a result is applicable: `"monitoring"`, of this
    /// arm over the years; `"prediction"`, of the torque of any motion; `"contact-detection"`;
    /// `"physical-values"`, for comparison with a data sheet; `"rigid-body"`, a mass matrix that
    /// can be inverted anywhere.
    #[serde(default = "Use::default_uses")]
    pub required_uses: Vec<Use>,
    /// The parameters whose values are required, with `"physical-values"`.
    ///
    /// If left out: parameters that contribute to the torque.
    #[serde(default)]
    pub required_parameters: Option<Vec<String>>,
    /// Tolerances of the values in the cell and robot file.
    ///
    /// If left out: as its defaults say.
    #[serde(default)]
    pub tolerances: Tolerances,
    /// Simulation of the closed loop, and end of the iteration. Needs `[controller]`.
    ///
    /// If left out: as its defaults say.
    #[serde(default)]
    pub simulation: Option<SimulationOptions>,
}

/// `[service]`
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ServiceSection {
    /// The folder of the results.
    pub state_directory: PathBuf,
    /// The folder of the sockets and of the stream's own files. The path of a socket in it has at
    /// most 107 bytes.
    pub runtime_directory: PathBuf,
    /// Permissions of the status socket: 0o600 and rights to read and write for others.
    ///
    /// If left out: `0o660`.
    pub status_mode: u32,
    /// Group of the status socket.
    ///
    /// If left out: the service's own.
    pub status_group: Option<String>,
    /// Permissions of the command socket, which is never for everybody.
    ///
    /// If left out: `0o600`; `0o660` with `command_group`.
    pub command_mode: Option<u32>,
    /// Group of the command socket.
    ///
    /// If left out: the service's own.
    pub command_group: Option<String>,
    /// Number of results that are kept; older ones are removed.
    pub keep_results: usize,
    /// Longest absence of the estimation without loss of samples \[s\].
    pub buffer_s: f64,
    /// Priority and processor of the bus thread.
    ///
    /// If left out: an ordinary thread.
    pub real_time: RealTimeOptions,
    /// One process for everything; or acquisition and estimation in one each (`didim run --part
    /// acquisition`, `--part estimation`).
    pub processes: Processes,
    /// Largest amount of data written to disk within 24 hours \[MB\]; 10 to 100 000 000. Recordings
    /// of results give way first, then those of faults and captures, then the ring. Results never
    /// do.
    ///
    /// If left out: no limit.
    pub write_mb_per_day: Option<u64>,
    /// Raw frames on disk.
    ///
    /// If left out: nothing is recorded.
    pub recordings: Option<RecordingOptions>,
    /// Definition of drift from the baseline.
    ///
    /// If left out: as its defaults say.
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
            write_mb_per_day: None,
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Processes {
    /// Acquisition and estimation in one process.
    #[default]
    One,
    /// `didim run --part acquisition` and `didim run --part estimation`.
    Two,
}
