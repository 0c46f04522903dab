//! What the service needs of the system: a user of its own, and no capability.

use std::fs;
use std::os::unix::fs::{PermissionsExt, chown};
use std::process::{Command, Stdio};

use crate::common::manager::{Manager, terminate};
use crate::common::{Process, eventually};
use crate::program::cell::Site;
use crate::program::{AT_1_KHZ, Installation, command};
use didim::live::acquire::{Grant, RealTimeGrants};

/// The user nobody and its group, as everywhere on Debian.
const NOBODY: u32 = 65_534;

/// The command as nobody, without any capability or the way to one, with the limits that `prlimit`
/// gives. The cell's folders become nobody's.
fn unprivileged(child: &Command, cell: &Installation, limits: &[&str]) -> Command {
    assert!(rustix::process::geteuid().is_root(), "only root can become another user");
    let mut command = Command::new("prlimit");
    command.stdout(Stdio::null()).args(limits).args([
        "setpriv",
        "--reuid=65534",
        "--regid=65534",
        "--clear-groups",
        "--bounding-set=-all",
        "--inh-caps=-all",
        "--ambient-caps=-all",
        "--no-new-privs",
    ]);
    command.arg(child.get_program()).args(child.get_args());
    for (name, value) in child.get_envs() {
        command.env(name, value.unwrap());
    }
    // What the service manager would have made for its user.
    let folder = cell.path("");
    for path in [folder.clone(), cell.state(), cell.cell()] {
        chown(path, Some(NOBODY), Some(NOBODY)).unwrap();
    }
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
    command
}

const WISHES: (&str, &str) =
    ("[service]", "[service.real_time]\npriority = 20\nlock_memory = true\n\n[service]");

/// A line of /proc/PID/status.
fn process_status(process: u32, key: &str) -> String {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix(key)).unwrap();
    line.trim_start_matches(':').trim().to_owned()
}

/// The scheduling policy of the bus thread (proc(5), field 41 of stat): 1 is SCHED_FIFO.
fn policy_of_the_bus_thread(process: u32) -> (u32, u32) {
    let threads = fs::read_dir(format!("/proc/{process}/task")).unwrap();
    // Threads of the start may end while they are listed.
    let stat = threads
        .filter_map(|thread| fs::read_to_string(thread.ok()?.path().join("stat")).ok())
        .find(|stat| stat.contains("(bus)"))
        .unwrap();
    // What follows the name begins with field 3.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    (fields[41 - 3].parse().unwrap(), fields[40 - 3].parse().unwrap())
}

fn has_no_privilege(process: u32) {
    for set in ["CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"] {
        assert_eq!(process_status(process, set), "0000000000000000", "{set}");
    }
    assert_eq!(process_status(process, "NoNewPrivs"), "1");
    assert_eq!(process_status(process, "Uid"), "65534\t65534\t65534\t65534");
}

/// Runs the service as nobody and has it identify; what it was granted, and the child's number is
/// handed to `look` meanwhile.
fn runs(limits: &[&str], inspect: impl Fn(u32)) -> (RealTimeGrants, Vec<String>) {
    let site = Site::new(&[("min_s = 3.0", "min_s = 1.0"), WISHES]);
    let child = site.child();
    let command = unprivileged(&child, &site.cell, limits);
    let (mut child, mut manager) = site.start_as("both", command);
    manager.expect(0, "READY=1");
    has_no_privilege(child.0.id());
    inspect(child.0.id());
    site.identify_now();
    eventually("a result", || site.cell.state().join("latest.json").exists());
    let status = site.status();
    let (ended, _) = terminate(&mut child);
    assert!(ended.success(), "{ended}");
    (status.acquisition.unwrap().real_time.unwrap(), status.health.reasons)
}

#[test]
#[ignore = "needs root and a CAN bus: tests/run"]
fn it_runs_as_nobody_without_a_capability_and_says_what_it_was_not_granted() {
    let limits = ["--rtprio=0:0", "--memlock=65536:65536"];
    let (grants, reasons) = runs(&limits, |process| {
        assert_eq!(policy_of_the_bus_thread(process).0, 0);
        assert_eq!(process_status(process, "VmLck"), "0 kB");
    });
    let Grant::Refused { why: priority } = &grants.priority else { panic!("{grants:?}") };
    assert!(priority.contains("LimitRTPRIO"), "{priority}");
    let Grant::Refused { why: memory } = &grants.memory else { panic!("{grants:?}") };
    assert!(memory.contains("65536 bytes") && memory.contains("LimitMEMLOCK"), "{memory}");
    for why in [priority, memory] {
        assert!(reasons.iter().any(|reason| reason.contains(why)), "{reasons:?}");
    }
}

#[test]
#[ignore = "needs root and a CAN bus: tests/run"]
fn limits_are_all_it_needs_for_its_priority_and_its_memory() {
    // As LimitRTPRIO and LimitMEMLOCK do in the units.
    let limits = ["--rtprio=20:20", "--memlock=unlimited:unlimited"];
    let (grants, reasons) = runs(&limits, |process| {
        assert_eq!(policy_of_the_bus_thread(process), (1, 20), "SCHED_FIFO 20");
        let locked = process_status(process, "VmLck");
        let kib: u64 = locked.strip_suffix(" kB").unwrap().parse().unwrap();
        // The stream's shared memory alone is more.
        assert!(kib > 10_000, "{locked}");
    });
    assert_eq!((&grants.priority, &grants.memory), (&Grant::Granted, &Grant::Granted));
    assert!(!reasons.iter().any(|reason| reason.contains("not granted")), "{reasons:?}");
}

#[test]
#[ignore = "needs root and a CAN bus: tests/run"]
fn nobody_may_listen_to_a_real_bus() {
    let interface = crate::common::bus::vcan();
    let bus = format!("\"can:{interface}\"");
    let cell = Installation::from_cell(
        "tx40-packed-fd",
        &[&AT_1_KHZ[..], &[("\"can:vcan0\"", &bus)]].concat(),
    );
    let runs = command(&[
        &"run",
        &"--cell",
        &cell.cell(),
        &"--state",
        &cell.state(),
        &"--runtime",
        &cell.runtime(),
    ]);
    let mut runs = unprivileged(&runs, &cell, &["--rtprio=0:0"]);
    let mut manager = Manager::listen(&cell.path(""), "notify");
    manager.manages(&mut runs, None);
    let mut daemon = Process(runs.spawn().unwrap());
    manager.expect(0, "READY=1");
    has_no_privilege(daemon.0.id());
    let sim = format!("can:{interface}");
    let played = command(&[&"sim", &"--cell", &cell.cell(), &"--bus", &sim]).output().unwrap();
    assert!(played.status.success(), "{played:?}");
    let status =
        || didim::service::status::fetch_status(&cell.runtime().join("status.sock")).unwrap();
    eventually("its frames", || status().acquisition.unwrap().frames > 6_000);
    let (ended, _) = terminate(&mut daemon);
    assert!(ended.success(), "{ended}");
}
