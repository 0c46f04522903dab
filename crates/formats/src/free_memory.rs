//! Free memory.

use sysinfo::{
    MemoryRefreshKind, Pid, Process, ProcessRefreshKind, ProcessesToUpdate, RefreshKind, System,
};

/// Returns the memory that is free to this process \[bytes\]; 0 if the system does not report it.
pub(crate) fn free_memory() -> u64 {
    let of_memory = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    let Ok(mut system) = System::new_with_specifics(of_memory) else { return 0 };
    // The limit of a container, a unit or a shell may be below that of the machine.
    let process = Pid::from_u32(std::process::id());
    let nothing = ProcessRefreshKind::nothing();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[process]), false, nothing);
    let of_group = system.process(process).and_then(Process::cgroup_limits);
    let of_group = of_group.or_else(|| system.cgroup_limits()).map(|limits| limits.free_memory);
    let limits = [of_group, data_limit()];
    limits.into_iter().flatten().fold(system.available_memory(), u64::min)
}

/// Returns the limit of a process's data that a shell or a unit has set \[bytes\].
#[cfg(unix)]
fn data_limit() -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    getrlimit(Resource::Data).current
}

#[cfg(not(unix))]
fn data_limit() -> Option<u64> {
    None
}
