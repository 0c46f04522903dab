//! Limits of the process that a running service needs, checked before it starts.
//!
//! A process that meets a limit in the middle of its start fails at an arbitrary place, some of
//! which are in libraries that panic, and its message names anything but the limit.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// A limit with the need of the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Need {
    resource: Resource,
    /// Limited quantity, as in a sentence.
    quantity: &'static str,
    /// Need of the service, in units of the limit.
    needed: u64,
    /// Setting of a systemd unit, and option of `ulimit`.
    settings: (&'static str, &'static str),
    /// Bytes in a unit of `ulimit`; 1 for a number of files.
    ulimit_unit: u64,
}

impl Need {
    /// Returns the need of the service, in units of the limit.
    pub fn needed(&self) -> u64 {
        self.needed
    }
}

/// Needs of a service of one cell. The measured process has 71 open files and 8 threads in 609 MB
/// of addresses, and 21 MB of data before its first sample; a demonstration at 5 kHz has 677 MB of
/// addresses. The rest is for clients, interfaces, long windows and larger buffers.
pub const NEEDS: [Need; 3] = [
    Need {
        resource: Resource::Nofile,
        quantity: "open files",
        needed: 128,
        settings: ("LimitNOFILE", "-n"),
        ulimit_unit: 1,
    },
    Need {
        resource: Resource::As,
        quantity: "bytes of address space",
        needed: 1 << 30,
        settings: ("LimitAS", "-v"),
        ulimit_unit: 1 << 10,
    },
    Need {
        resource: Resource::Data,
        quantity: "bytes of data",
        needed: 256 << 20,
        settings: ("LimitDATA", "-d"),
        ulimit_unit: 1 << 10,
    },
];

/// A limit of the process is below the need of the service. Raise it in the systemd unit or the
/// shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {}", self.shortage(), self.remedy())]
pub struct LimitTooLow {
    /// The limit.
    pub limit: u64,
    /// The need.
    pub need: Need,
}

impl LimitTooLow {
    /// Returns the limit and the need, as part of a sentence.
    pub fn shortage(&self) -> String {
        let Need { quantity, needed, .. } = self.need;
        format!(
            "this process is limited to {} {quantity}, and the service needs {needed}",
            self.limit
        )
    }

    /// Returns how the limit is raised, as part of a sentence.
    pub fn remedy(&self) -> String {
        let Need { needed, settings: (unit, option), ulimit_unit, .. } = self.need;
        let shell = needed / ulimit_unit;
        format!("set {unit}={needed} in the systemd unit, or run `ulimit {option} {shell}`")
    }
}

/// Returns the limits that would refuse the start of a service by this process. A soft limit alone
/// does not, because [`require_limits`] raises it.
pub fn low_limits() -> impl Iterator<Item = LimitTooLow> {
    NEEDS.into_iter().filter_map(|need| {
        let limit = getrlimit(need.resource).maximum.filter(|limit| *limit < need.needed)?;
        Some(LimitTooLow { limit, need })
    })
}

/// Checks the limits of this process. A soft limit below the need is first raised as far as the
/// hard limit permits. Call it before anything else of the service.
///
/// # Errors
/// [`LimitTooLow`] for the first limit that is too low.
pub fn require_limits() -> Result<(), LimitTooLow> {
    NEEDS.iter().try_for_each(|need| {
        let limit = getrlimit(need.resource);
        if limit.current.is_none_or(|current| current >= need.needed) {
            return Ok(());
        }
        let raised = limit.maximum.map_or(need.needed, |maximum| maximum.min(need.needed));
        // If the system refuses, the limit is as before.
        let _ = setrlimit(need.resource, Rlimit { current: Some(raised), ..limit });
        match getrlimit(need.resource).current {
            Some(limit) if limit < need.needed => Err(LimitTooLow { limit, need: *need }),
            _ => Ok(()),
        }
    })
}
