//! Identification of a robot's dynamic parameters, with their uncertainty, from its recorded
//! motion.
//!
//! Contract: pure functions of their arguments. No I/O, no clock, no threads, no async, and no
//! unsafe code. Independent work runs on threads that the caller has ([`parallel::Parallel`]). The
//! same input gives the same output, bit for bit, on one instruction set. SI units throughout (rad
//! or m, N·m or N, s); names carry a unit wherever a type does not. Nothing here panics on data:
//! every possible fault is an error with a remedy.
//!
//! Dependencies point one way: `identification → {excitation, feasibility, regression, signal} →
//! parallel`. The model of an arm and of its motion comes from `didim_dynamics`.
//!
//! # Example
//! The parameters of a pendulum from arrays of its position and torque:
//! ```
//! use didim_dynamics::Signals;
//! use didim_dynamics::dynamics::{BaseParameters, Model};
//! use didim_dynamics::robot::Robot;
//! use didim_identification::identification::{
//!     DecimationFilter, Experiment, Method, Options, PositionFilter, identify,
//! };
//!
//! let robot = Robot::from_toml(
//!     r#"
//!     name = "pendulum"
//!     gravity_m_s2 = [0.0, -9.81, 0.0]
//!     [[joint]]
//!     type = "revolute"
//!     alpha_deg = 0.0
//!     d_m = 0.0
//!     theta_deg = 0.0
//!     r_m = 0.0
//!     drive_inertia = false
//!     position_min_deg = -170.0
//!     position_max_deg = 170.0
//!     velocity_max_rad_s = 5.0
//!     torque_max_nm = 50.0
//!     [transmission]
//!     rows = [[1.0]]
//!     [friction]
//!     viscous = true
//!     coulomb = false
//!     offset = false
//!     "#,
//! )?;
//!
//! // Ten seconds at 1 kHz of a swing with two frequencies; zz = 0.5 kg·m², mx = 2 kg·m.
//! let (mut position_rad, mut torque_nm) = (Vec::new(), Vec::new());
//! for sample in 0..10_000 {
//!     let t = f64::from(sample) * 1e-3;
//!     let (slow, fast) = (3.0 * t, 7.0 * t);
//!     let q = slow.sin() + 0.5 * fast.sin();
//!     let dq = 3.0 * slow.cos() + 3.5 * fast.cos();
//!     let ddq = -9.0 * slow.sin() - 24.5 * fast.sin();
//!     position_rad.push(q);
//!     torque_nm.push(0.5 * ddq + 2.0 * 9.81 * q.cos() + 0.8 * dq);
//! }
//! let experiment = Experiment::joint_side(Signals {
//!     sample_rate_hz: 1000.0,
//!     position_rad: vec![position_rad],
//!     torque_nm: vec![torque_nm],
//!     reference_rad: None,
//! })?
//! .with_counted(200..9_800)?; // without the transients of the filters
//!
//! let base = BaseParameters::compute(&Model::new(&robot))?;
//! let options = Options::new(
//!     PositionFilter { order: 4, cutoff_hz: 100.0 },
//!     DecimationFilter { order: 8, ripple_db: 0.05, cutoff_ratio: 0.8, factor: 20 },
//! );
//! let identified = identify(Method::IdimLs, &robot, &base, &experiment, &options)?;
//! let inertia = identified
//!     .estimate
//!     .parameters
//!     .iter()
//!     .find(|parameter| parameter.name == "zz1")
//!     .ok_or("zz1 is no base parameter")?;
//! assert!((inertia.value - 0.5).abs() < 1e-3, "{inertia:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod excitation;
pub mod external_torque;
pub mod feasibility;
pub mod identification;
pub mod parallel;
pub mod regression;
pub mod signal;
mod stored_value;
