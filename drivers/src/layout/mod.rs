//! Assignment of the bits of frames to quantities of the arm.
//!
//! A DBC file defines the positions of signals in frames. A [`LayoutSpec`] selects the positions,
//! torques and references of the arm from these signals, and defines when each of them is valid.
//! Both are read once, at start, and compiled to a [`CompiledLayout`]. It is a table from
//! identifier to message and, for each message, the bits of each signal. CiA 402 is described by a
//! DBC file, not by code. The device files of the drives (EDS, DCF) may replace the DBC file; their
//! PDOs are read in the same way. The description of an EtherCAT network (ENI) may also replace it.
//!
//! Values here are in the units of the DBC file; [`crate::units`] converts them to SI.

mod compile;
mod compile_nodes;
mod compile_slaves;
mod contents;
mod dbc;
mod eds;
mod encode;
mod error;
mod field;
mod plan;
mod process_data;
mod readings;
mod selector;
mod slaves;
mod spec;

pub use contents::{CarriedObject, DeviceContents};
pub use dbc::{Database, MessageFormat, NamedSignal, SignalFormat};
pub use eds::{EdsError, MAX_DEVICE_FILE_BYTES};
pub use encode::{AxisValues, CycleValues, EncodeError};
pub use error::LayoutError;
pub use field::{ByteOrder, DoesNotFit, EXACT_BITS, Encoding, Field};
pub use plan::{CompiledLayout, Extraction, MessagePlan, Quantity, Role, SampledBy, Unreadable};
pub use process_data::ProcessData;
pub(crate) use process_data::{
    AL_ERROR, AL_STATUS_BITS, AssembledFrame, BELOW_SAFE_OPERATIONAL, ProcessDatagram,
    SAFE_OPERATIONAL, SYNC_FRAME, WRONG_COUNTER,
};
pub use selector::Selector;
pub use slaves::NetworkError;
pub use spec::{
    CyclesBy, EnabledSpec, ExceptSpec, FollowingErrorSign, LawSpec, LayoutSpec, NodeSpec,
    PositionSpec, PositionValidity, ReadingSpec, ReferenceSpec, ReferenceValidity, SignalNames,
    SlaveSpec, TorqueSpec, TorqueValidity,
};
