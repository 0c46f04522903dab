//! Conversion of the frames of a drive bus to joint samples.
//!
//! Contract: this crate can only listen. [`source::Source`] has no way to send; the state machines
//! ([`assemble`], [`clock`]) take time as an argument; every frame and every cycle that is not used
//! is counted under a named cause. Only [`socket`] contains unsafe code. Buses need Linux; logs are
//! read on every system.
//!
//! # Example
//! The frames of one drive, decoded to samples:
//! ```
//! use didim_drivers::assemble::Assembler;
//! use didim_drivers::frame::{Frame, FrameId};
//! use didim_drivers::layout::CompiledLayout;
//! use didim_drivers::units::{DriveSpec, Scales};
//!
//! let dbc = r#"VERSION ""
//! NS_ :
//! BS_:
//! BU_: Drive
//! BO_ 128 SYNC: 0 Drive
//! BO_ 385 Fast: 8 Drive
//!  SG_ Position : 0|32@1- (1,0) [0|0] "count" Drive
//!  SG_ Torque : 32|16@1- (1,0) [0|0] "per mille" Drive
//! "#;
//! let layout = CompiledLayout::compile(
//!     dbc,
//!     &toml::from_str(
//!         r#"
//!         dbc = "drive.dbc"
//!         axes = 1
//!         rate_hz = 250.0
//!         sync = "SYNC"
//!         position = { signal = "Fast.Position", valid = "instant" }
//!         torque = { signal = "Fast.Torque", valid = "instant" }
//!         "#,
//!     )?,
//! )?;
//! let drive: DriveSpec = toml::from_str(
//!     r#"
//!     position.scale.counts_per_revolution = 8192
//!     position.sign = 1
//!     position.zero = 0
//!     position.wraps = "refuse"
//!     position.provenance = "data sheet of the encoder"
//!     torque.scale.per_mille_of_rated_torque.rated_torque_nm = 2.0
//!     torque.sign = 1
//!     torque.provenance = "name plate of the motor"
//!     "#,
//! )?;
//! let scales = Scales::new(&[drive], &layout)?;
//! let mut assembler = Assembler::new(layout, scales);
//!
//! let sync = FrameId::standard(0x080)?;
//! let fast = FrameId::standard(0x181)?;
//! let mut samples = Vec::new();
//! for cycle in 0..3_u64 {
//!     let stamp_ns = 1_700_000_000_000_000_000 + cycle * 4_000_000;
//!     let data = [0, 8, 0, 0, 0xf4, 0x01, 0, 0]; // 2048 counts, 500 per mille
//!     for frame in [Frame::classic(sync, &[])?, Frame::classic(fast, &data)?] {
//!         assembler.handle_frame(&Frame { stamp_ns, ..frame });
//!         samples.extend(assembler.poll_sample());
//!     }
//! }
//! assert_eq!(samples.len(), 2); // The third cycle has not ended.
//! assert!((samples[0].motor_position_rad[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
//! assert!((samples[0].motor_torque_nm[0] - 1.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(target_os = "linux"),
    allow(dead_code, unused_imports, reason = "the service alone uses it")
)]

pub mod assemble;
pub mod clock;
pub mod ethercat;
#[cfg(test)]
#[path = "../../tests/common/expectation.rs"]
mod expectation;
pub mod frame;
pub mod layout;
pub mod samples;
#[cfg(target_os = "linux")]
pub mod socket;
pub mod source;
#[cfg(not(target_os = "linux"))]
pub mod std_clock;
pub mod units;

#[cfg(not(target_os = "linux"))]
pub use std_clock as socket;
