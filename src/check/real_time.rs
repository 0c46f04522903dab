//! Check that the bus thread may use the configured priority and processor.

use rustix::process::{Resource, geteuid, getrlimit};

use super::finding::Finding;
use crate::cell::Cell;
use crate::live::real_time_options::RealTimeOptions;

pub(super) fn check(cell: &Cell, findings: &mut Vec<Finding>) {
    let asked = cell.service.real_time;
    if let Some(priority) = asked.priority {
        // A superuser has CAP_SYS_NICE, and the limit does not apply.
        let limit = if geteuid().is_root() { None } else { getrlimit(Resource::Rtprio).maximum };
        findings.extend(priority_above(priority, limit));
    }
    if asked.lock_memory && !geteuid().is_root() {
        // `run` locks all memory or none. With a limit, a later allocation would fail.
        if let Some(bytes) = getrlimit(Resource::Memlock).maximum {
            findings.push(Finding::warning(
                "service.real_time.lock_memory",
                format!("is requested, but this user may lock at most {bytes} bytes"),
                "set LimitMEMLOCK=infinity in the systemd unit, or memlock in \
                 /etc/security/limits.d",
            ));
        }
    }
    if let Some(cpu) = asked.cpu {
        // The request is the same as in `run`. It is made on a separate thread, so that the current
        // thread keeps its processor.
        let options = RealTimeOptions { cpu: Some(cpu), ..Default::default() };
        let granted = std::thread::spawn(move || options.apply().cpu).join();
        if let Ok(crate::live::acquire::Grant::Refused { why }) = granted {
            findings.push(Finding::warning(
                "service.real_time.cpu",
                format!("not granted: {why}"),
                "name a processor that this machine has and the service may use",
            ));
        }
    }
}

/// Reports a priority above the limit. `None` as the limit permits all priorities.
fn priority_above(priority: u8, limit: Option<u64>) -> Option<Finding> {
    let limit = limit.filter(|limit| *limit < u64::from(priority))?;
    Some(Finding::warning(
        "service.real_time.priority",
        format!("{priority} is requested, but this user may have at most {limit}"),
        "set LimitRTPRIO= in the systemd unit, or rtprio in /etc/security/limits.d",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_priority_is_held_against_the_limit() {
        assert_eq!(priority_above(30, None), None);
        assert_eq!(priority_above(30, Some(30)), None);
        let finding = priority_above(30, Some(29)).unwrap();
        assert!(finding.what.contains("30 is requested") && finding.what.contains("at most 29"));
    }
}
