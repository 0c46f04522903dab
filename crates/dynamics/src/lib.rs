//! Rigid-body dynamics of serial arms: description of an arm, its motion, and its closed loop.
//!
//! Contract: pure functions of their arguments. No I/O, no clock, no threads, no async. The only
//! unsafe code calls a function with vector instructions, after asking the processor. The same
//! input gives the same output, bit for bit, on one instruction set. SI units throughout (rad or m,
//! N·m or N, s); names carry a unit wherever a type does not. Nothing here panics on data: every
//! fault is an error with a remedy.
//!
//! Dependencies point one way:
//! `simulation → control → dynamics → trajectory → robot → numeric → sample`.
//!
//! # Example
//! The torque that holds a pendulum still: one revolute joint, its axis horizontal.
//! ```
//! use didim_dynamics::dynamics::{Model, Workspace};
//! use didim_dynamics::robot::Robot;
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
//!     viscous = false
//!     coulomb = false
//!     offset = false
//!     [nominal]
//!     zz1 = 0.5 # kg·m²
//!     mx1 = 2.0 # kg·m
//!     m1 = 4.0 # kg
//!     "#,
//! )?;
//! let nominal = robot.nominal().ok_or("the robot's file has no nominal parameters")?;
//! let model = Model::new(&robot);
//!
//! let (q, dq, ddq) = ([60_f64.to_radians()], [0.0], [0.0]); // rad, rad/s, rad/s²
//! let mut torque_nm = [0.0];
//! let mut workspace = Workspace::new();
//! let parameters = nominal.standard_parameters();
//! model.inverse_dynamics(&mut workspace, parameters, &q, &dq, &ddq, &mut torque_nm);
//! assert!((torque_nm[0] - 2.0 * 9.81 * q[0].cos()).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod control;
pub mod dynamics;
pub mod numeric;
pub mod robot;
pub mod sample;
pub mod simulation;
pub mod trajectory;

pub use sample::{JointSample, MAX_JOINTS, Reading, Readings, SignalTiming, Signals};
