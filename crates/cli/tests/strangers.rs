//! Other users of the machine try each file, folder, socket and segment of a running service.

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions, Permissions};
use std::io::Read;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::eventually;
use crate::common::manager::terminate;
use crate::program::cell::Site;

/// The user nobody, as everywhere on Debian.
const NOBODY: u32 = 65_534;
/// Names the file with the paths that another user tries.
const PATHS: &str = "DIDIM_TEST_PATHS";

fn say(path: &Path, verb: &str, is_done: bool) {
    if is_done {
        println!("does: {verb} {}", path.display());
    }
}

/// Tries everything that can be done to a path; prints a line for each success.
fn try_path(path: &Path) {
    let Ok(kind) = fs::symlink_metadata(path).map(|metadata| metadata.file_type()) else { return };
    if kind.is_socket() {
        say(path, "connects", UnixStream::connect(path).is_ok());
        let answer = UnixStream::connect(path).and_then(|mut stream| {
            stream.set_read_timeout(Some(Duration::from_secs(5)))?;
            stream.read(&mut [0; 16])
        });
        say(path, "reads", answer.is_ok_and(|length| length > 0));
    } else if kind.is_dir() {
        say(path, "lists", fs::read_dir(path).is_ok());
        say(path, "creates", fs::write(path.join("of-another-user"), "").is_ok());
    } else {
        say(path, "reads", fs::File::open(path).is_ok());
        say(path, "writes", OpenOptions::new().append(true).open(path).is_ok());
        say(path, "truncates", OpenOptions::new().write(true).truncate(true).open(path).is_ok());
    }
    let linked = std::env::temp_dir().join(format!("didim-linked-{}", std::process::id()));
    say(path, "links", fs::hard_link(path, &linked).is_ok());
    say(path, "opens", fs::set_permissions(path, Permissions::from_mode(0o666)).is_ok());
    say(path, "renames", fs::rename(path, path.with_extension("other")).is_ok());
    say(path, "removes", fs::remove_file(path).is_ok() || fs::remove_dir(path).is_ok());
}

#[test]
#[ignore = "the other process of a test"]
fn child_tries_everything() {
    let Some(paths) = std::env::var_os(PATHS) else { return };
    for path in fs::read_to_string(paths).unwrap().lines() {
        try_path(Path::new(path));
    }
}

/// Adds a folder with all that is in it.
fn add_all(path: &Path, paths: &mut BTreeSet<PathBuf>) {
    paths.insert(path.to_owned());
    let entries = fs::read_dir(path).into_iter().flatten().flatten();
    for entry in entries {
        let path = entry.path();
        if entry.file_type().unwrap().is_dir() {
            add_all(&path, paths);
        } else {
            paths.insert(path);
        }
    }
}

/// Returns the successes of a user of this group, without the folder of the test.
fn successes(site: &Site, program: &Path, group: u32) -> BTreeSet<String> {
    let mut command = Command::new("setpriv");
    command.args([&format!("--reuid={NOBODY}"), &format!("--regid={group}"), "--clear-groups"]);
    command.arg(program).args(["--exact", "strangers::child_tries_everything"]);
    command.args(["--ignored", "--nocapture"]).env(PATHS, site.cell.path("paths"));
    let output = command.stderr(Stdio::inherit()).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("1 passed"), "{text}");
    let folder = format!("{}/", site.cell.path("").display().to_string().trim_end_matches('/'));
    let lines = text.lines().filter_map(|line| line.split_once("does: "));
    lines.map(|(_, success)| success.replace(&folder, "")).collect()
}

/// The group reads results and the status.
fn is_granted_to_group(success: &str) -> bool {
    let folder = ["lists state", "reads state/"];
    let others = ["lists run", "connects run/status.sock", "reads run/status.sock"];
    others.contains(&success) || folder.iter().any(|read| success.starts_with(read))
}

#[test]
#[ignore = "needs root: tests/run"]
fn another_user_can_do_what_the_threat_model_grants_and_nothing_else() {
    let site = Site::new(&[("[service]", "[service]\nprocesses = \"one\"")]);
    let folder = site.cell.path("");
    fs::set_permissions(&folder, Permissions::from_mode(0o755)).unwrap();
    // As the units make them: RuntimeDirectoryMode, StateDirectoryMode, UMask.
    fs::create_dir(site.cell.runtime()).unwrap();
    fs::set_permissions(site.cell.runtime(), Permissions::from_mode(0o755)).unwrap();
    fs::set_permissions(site.cell.state(), Permissions::from_mode(0o750)).unwrap();
    let child = site.child();
    let mut command = Command::new("sh");
    command.args(["-c", "umask 0027; exec \"$@\"", "sh"]).arg(child.get_program());
    command.args(child.get_args());
    for (name, value) in child.get_envs() {
        command.env(name, value.unwrap());
    }
    let (mut service, mut manager) = site.start_as("both", command);
    manager.expect(0, "READY=1");
    eventually("a result is stored", || fs::exists(site.cell.state().join("latest.json")).unwrap());

    let mut paths = BTreeSet::new();
    add_all(&site.cell.runtime(), &mut paths);
    add_all(&site.cell.state(), &mut paths);
    let maps = fs::read_to_string(format!("/proc/{}/maps", service.0.id())).unwrap();
    let mapped = maps.lines().filter_map(|line| line.split_whitespace().nth(5));
    let segments = mapped.filter(|path| path.starts_with("/dev/shm/"));
    paths.extend(segments.map(PathBuf::from));
    let is_segment = |path: &&PathBuf| path.starts_with("/dev/shm");
    assert!(paths.iter().filter(is_segment).count() > 5 && paths.len() > 25, "{paths:#?}");
    let sockets = ["run/status.sock", "run/command.sock"];
    assert!(sockets.iter().all(|socket| paths.contains(&site.cell.path(socket))), "{paths:#?}");
    let text: Vec<String> = paths.iter().map(|path| format!("{}\n", path.display())).collect();
    fs::write(site.cell.path("paths"), text.concat()).unwrap();
    // The program of the test may be where others cannot read.
    let program = site.cell.path("program");
    fs::copy(std::env::current_exe().unwrap(), &program).unwrap();
    for readable in [&program, &site.cell.path("paths")] {
        fs::set_permissions(readable, Permissions::from_mode(0o755)).unwrap();
    }

    let of_nobody = successes(&site, &program, NOBODY);
    assert_eq!(of_nobody, BTreeSet::from(["lists run".to_owned()]));

    let of_group = successes(&site, &program, 0);
    let beyond: Vec<&String> =
        of_group.iter().filter(|success| !is_granted_to_group(success)).collect();
    assert_eq!(beyond, Vec::<&String>::new());
    for granted in ["reads run/status.sock", "reads state/latest.json", "reads state/history.jsonl"]
    {
        assert!(of_group.contains(granted), "{granted}: {of_group:#?}");
    }

    // The service has taken no harm.
    eventually("it is identified", || site.status().estimation.unwrap().windows_identified > 0);
    let (status, _) = terminate(&mut service);
    assert!(status.success(), "{status}");
}
