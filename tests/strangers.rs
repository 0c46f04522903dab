//! Another user of the machine does to a service what /dev/shm permits everybody.

use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Process, eventually};
use didim::live::stream::{Pace, ServiceNetwork, StreamNode, StreamOptions, Topic};

/// The user nobody, as everywhere on Debian.
const NOBODY: u32 = 65_534;
/// Maximum time of a start, with any user on the machine.
const START_LIMIT: Duration = Duration::from_secs(5);
const INSIDE: &str = "DIDIM_TEST_INSIDE_A_SHARED_MEMORY_OF_ITS_OWN";

/// Everything that a name can be given to without knowing a prefix: the names before the prefix was
/// drawn at random, among them the one file that every user could write.
const GUESSED: &str = r#"
counter=9204dd183d1c4d8e1ff592a30766ffa6765aa8b5_node.0_10_0.global_mgmt
umask 0
for name in didim_ didim_lock didim-run-lock "didim_$counter" "didim-run-$counter" \
    didim_000000000000_lock "didim_000000000000_$counter"; do
    : >"/dev/shm/$name"
done
head -c 1000 /dev/zero >"/dev/shm/didim_$counter"
"#;

/// What can be done to a file whose name is known. A line for each success, and for the end. `true`
/// is used because a shell ends where `:` cannot open its output.
const ATTACK: &str = r#"
for file in /dev/shm/didim[_-]*_* "$1"/* "$1"/ipc/* "$1"/ipc/*/*; do
    [ -e "$file" ] && [ ! -O "$file" ] || continue
    true >"$file" && echo "truncates $file"
    head -c 16 /dev/urandom 1<>"$file" && echo "writes $file"
    case $file in /dev/shm/*) cat "$file" >/dev/null && echo "reads $file" ;; esac
    unlink "$file" && echo "removes $file"
    mv "$file" "$file.other" && echo "renames $file"
    chmod 666 "$file" && echo "opens $file"
    ln "$file" /dev/shm/linked && echo "links $file"
    # Names like those of the library.
    [ -f "$file" ] && head -c 300 /dev/urandom >"${file%.*}1.${file##*.}"
    true >"$file.new" && case $file in /dev/shm/*) ;; *) echo "creates $file.new" ;; esac
done 2>/dev/null
echo end
"#;

fn stranger(script: &str, runtime: &Path) -> Command {
    let mut command = Command::new("setpriv");
    command.args(["--reuid=65534", "--regid=65534", "--clear-groups", "sh", "-c", script, "sh"]);
    command.arg(runtime).stdout(Stdio::piped());
    command
}

/// Names in shared memory and their owners.
fn names() -> Vec<(String, u32)> {
    let files = fs::read_dir("/dev/shm").unwrap().flatten();
    files
        .filter_map(|file| {
            let owner = file.metadata().ok()?.uid();
            Some((file.file_name().into_string().unwrap(), owner))
        })
        .collect()
}

/// A service's stream, whose threads join and leave it for as long as the file `go` exists.
#[test]
#[ignore = "the other process of a test"]
fn child_joins_again_and_again() {
    let Some(runtime) = std::env::var_os("DIDIM_TEST_RUNTIME").map(PathBuf::from) else { return };
    let network = ServiceNetwork::join(&runtime).unwrap();
    let root = runtime.join("ipc");
    let options = StreamOptions::new("cell", (&root, network.prefix()), 6, 1000.0, 1.0).unwrap();
    let node = StreamNode::join(&options).unwrap();
    let _status = node.document_writer(Topic::Status).unwrap();
    let _samples = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    fs::write(runtime.join("started"), network.prefix()).unwrap();
    while runtime.join("go").exists() {
        drop(StreamNode::join(&options).unwrap().sample_reader().unwrap());
    }
}

fn start(runtime: &Path) -> (Process, String) {
    let _ = fs::remove_file(runtime.join("started"));
    fs::write(runtime.join("go"), "").unwrap();
    let begin = Instant::now();
    let mut child = Command::new(std::env::current_exe().unwrap());
    child.args(["--exact", "strangers::child_joins_again_and_again", "--ignored", "--nocapture"]);
    child.env("DIDIM_TEST_RUNTIME", runtime).stdout(Stdio::null());
    let mut child = Process(child.spawn().unwrap());
    loop {
        assert!(begin.elapsed() < START_LIMIT, "no start within {START_LIMIT:?}");
        assert_eq!(child.0.try_wait().unwrap(), None, "it ended instead");
        match fs::read_to_string(runtime.join("started")) {
            Ok(prefix) if !prefix.is_empty() => return (child, prefix),
            _ => std::thread::sleep(Duration::from_millis(5)),
        }
    }
}

#[test]
#[ignore = "needs root and a mount of its own: tests/run"]
fn another_user_cannot_keep_a_service_from_starting() {
    if std::env::var_os(INSIDE).is_none() {
        let mount = "mount -t tmpfs -o mode=1777 tmpfs /dev/shm && exec \"$@\"";
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-euc", mount, "sh"]).arg(std::env::current_exe().unwrap());
        let test = "strangers::another_user_cannot_keep_a_service_from_starting";
        command.args(["--exact", test, "--ignored", "--nocapture"]).env(INSIDE, "1");
        let ended = command.output().unwrap();
        let said = String::from_utf8_lossy(&ended.stdout);
        assert!(ended.status.success(), "{said}{}", String::from_utf8_lossy(&ended.stderr));
        assert!(said.contains("1 passed"), "{said}");
        return;
    }
    let folder = tempfile::Builder::new().prefix("didim-").tempdir_in("/tmp").unwrap();
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let runtime = folder.path().join("run");
    fs::create_dir(&runtime).unwrap();

    assert!(stranger(GUESSED, &runtime).status().unwrap().success());
    let guessed = names();
    assert!(guessed.len() > 5 && guessed.iter().all(|(_, owner)| *owner == NOBODY), "{guessed:?}");

    // Before the start, while it runs, and after its end.
    let (mut service, prefix) = start(&runtime);
    let there = names();
    assert!(guessed.iter().all(|file| there.contains(file)), "files of others are left alone");
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(3) {
        let output = stranger(ATTACK, &runtime).output().unwrap();
        let succeeded = String::from_utf8_lossy(&output.stdout);
        assert_eq!(succeeded, "end\n", "another user succeeds");
        assert_eq!(service.0.try_wait().unwrap(), None, "the service ended");
    }
    assert!(names().iter().filter(|(_, owner)| *owner != NOBODY).count() > 5);

    // Killed: the next start finds its files, and nobody could know the new prefix.
    service.0.kill().unwrap();
    service.0.wait().unwrap();
    let (mut service, next) = start(&runtime);
    assert_ne!(next, prefix);
    let has_old = |(name, owner): &(String, u32)| name.starts_with(&prefix) && *owner != NOBODY;
    assert!(!names().iter().any(has_old), "{:?}", names());
    fs::remove_file(runtime.join("go")).unwrap();
    eventually("the service ends", || service.0.try_wait().unwrap().is_some());
    assert!(service.0.wait().unwrap().success());
    let remaining: Vec<_> = names().into_iter().filter(|(_, owner)| *owner != NOBODY).collect();
    assert!(remaining.is_empty(), "{remaining:?}");
}
