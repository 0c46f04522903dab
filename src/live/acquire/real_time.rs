//! Requests for a real-time priority, a dedicated processor and locked memory of the bus thread.

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use rustix::thread::{CpuSet, sched_setaffinity};
use serde::{Deserialize, Serialize};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use crate::live::real_time_options::RealTimeOptions;

/// Outcome of a request.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "grant")]
pub enum Grant {
    /// The property was not requested.
    #[default]
    NotAsked,
    /// The property was granted.
    Granted,
    /// The system refused the property, and the thread runs without it.
    Refused {
        /// Reason, with the remedy if there is one.
        why: String,
    },
}

/// Real-time properties granted to the bus thread.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RealTimeGrants {
    /// Real-time priority.
    pub priority: Grant,
    /// Dedicated processor.
    pub cpu: Grant,
    /// Locked memory of the complete process.
    #[serde(default)]
    pub memory: Grant,
}

impl RealTimeOptions {
    /// Requests the configured properties for the calling thread. A refusal is reported and is not
    /// an error: the samples have the time stamps of the bus, and the socket buffer compensates for
    /// a delayed thread.
    pub fn apply(self) -> RealTimeGrants {
        RealTimeGrants {
            cpu: self.cpu.map_or(Grant::NotAsked, pin_to_cpu),
            priority: self.priority.map_or(Grant::NotAsked, raise_priority),
            memory: if self.lock_memory { lock_memory() } else { Grant::NotAsked },
        }
    }
}

fn pin_to_cpu(cpu: usize) -> Grant {
    if cpu >= CpuSet::MAX_CPU {
        return Grant::Refused { why: format!("there is no processor {cpu}") };
    }
    let mut set = CpuSet::new();
    set.set(cpu);
    match sched_setaffinity(None, &set) {
        Ok(()) => Grant::Granted,
        Err(why) => Grant::Refused { why: format!("processor {cpu}: {why}") },
    }
}

fn raise_priority(priority: u8) -> Grant {
    // The crate's scale is that of the kernel for a real-time policy: 1..=99.
    let wanted = ThreadPriority::try_from(priority).map_err(str::to_owned);
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let granted = wanted.and_then(|wanted| {
        set_thread_priority_and_policy(thread_native_id(), wanted, policy)
            .map_err(|why| format!("{why:?}"))
    });
    match granted {
        Ok(()) => Grant::Granted,
        Err(why) => Grant::Refused {
            why: format!(
                "SCHED_FIFO {priority}: {why}; in the unit: LimitRTPRIO of at least as much \
                 (RLIMIT_RTPRIO), RestrictRealtime=no"
            ),
        },
    }
}

/// Locks the resident memory, and other memory when it is first touched. Locking all memory at once
/// would include the complete stack of every thread and the reserves of the allocator, which are
/// hundreds of unused megabytes. The shared memory of the stream has been touched before.
///
/// With a memory limit, mlockall(2) would let a later allocation or thread start fail, which would
/// end the process. The function therefore locks all memory or none.
fn lock_memory() -> Grant {
    let limit = getrlimit(Resource::Memlock);
    if let (Some(current), None) = (limit.current, limit.maximum) {
        // Every process may raise its limit up to the hard limit. The calls below read the
        // resulting limit.
        let _ = setrlimit(Resource::Memlock, Rlimit { current: None, maximum: None });
        tracing::debug!(current, "the limit of locked memory is removed");
    }
    if let Some(bytes) = getrlimit(Resource::Memlock).current {
        return Grant::Refused {
            why: format!(
                "lock_memory: at most {bytes} bytes may be locked; in the unit: \
                 LimitMEMLOCK=infinity (RLIMIT_MEMLOCK)"
            ),
        };
    }
    match mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT) {
        Ok(()) => Grant::Granted,
        Err(why) => Grant::Refused {
            why: format!(
                "lock_memory: {why}; in the unit: LimitMEMLOCK=infinity, and mlockall among the \
                 permitted system calls (SystemCallFilter=@memlock)"
            ),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_asked_nothing_done() {
        assert_eq!(RealTimeOptions::default().apply(), RealTimeGrants::default());
    }

    #[test]
    fn what_does_not_exist_is_refused_in_words() {
        let asked = RealTimeOptions { priority: Some(0), cpu: Some(100_000), lock_memory: false };
        let grants = std::thread::spawn(move || asked.apply()).join().unwrap();
        assert!(matches!(grants.cpu, Grant::Refused { .. }), "{grants:?}");
        assert!(matches!(grants.priority, Grant::Refused { .. }), "{grants:?}");
    }

    #[test]
    fn granted_options_are_in_effect() {
        let asked = RealTimeOptions { priority: Some(7), cpu: Some(0), lock_memory: false };
        std::thread::spawn(move || {
            let grants = asked.apply();
            assert_eq!(grants.cpu, Grant::Granted);
            let allowed = rustix::thread::sched_getaffinity(None).unwrap();
            assert_eq!((allowed.count(), allowed.is_set(0)), (1, true));
            // The machine decides if the priority is granted. The reported grant must be true.
            let policy = thread_priority::thread_schedule_policy().unwrap();
            let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
            assert_eq!(grants.priority == Grant::Granted, policy == fifo);
        })
        .join()
        .unwrap();
    }
}
