//! The two sockets: who may ask, who answers, and that no client can hold the service up.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use didim::acquire::{ReceiveBuffer, SharedAcquisition};
use didim::status::{
    ClientError, Collector, ListenError, Socket, fetch_status, parse_command, send_command,
    serve_status,
};
use didim::stream::StreamOptions;
use didim::worker::{Command, SharedEstimation};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/tmp").unwrap()
}

fn document() -> Arc<[u8]> {
    let options = StreamOptions::new("cell", (Path::new("/tmp/x"), "x"), 6, 500.0, 20.0).unwrap();
    let mut collector = Collector::new(
        &options,
        Some(SharedAcquisition::default()),
        Some(SharedEstimation::default()),
        Some(ReceiveBuffer { asked_bytes: 8192, granted_bytes: 4096 }),
        Instant::now(),
    );
    serde_json::to_vec(&collector.snapshot(Instant::now())).unwrap().into()
}

/// Serves a document on a thread of its own until the test is over.
fn serving(path: &Path, document: Arc<[u8]>) -> tokio::sync::oneshot::Sender<()> {
    let socket = Socket::listen(path, 0o660).unwrap();
    let (stop, stopped) = tokio::sync::oneshot::channel();
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let (_keep, latest) = tokio::sync::watch::channel(document);
            tokio::select! {
                failed = serve_status(&socket, latest) => panic!("{failed:?}"),
                _ = stopped => {}
            }
        });
    });
    stop
}

fn names(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn whoever_connects_gets_one_object() {
    let folder = folder();
    let path = folder.path().join("status");
    let _stop = serving(&path, document());
    let snapshot = fetch_status(&path).unwrap();
    assert_eq!(snapshot.cell, "cell");
    assert_eq!(snapshot.acquisition.unwrap().receive_buffer_bytes, Some(4096));
    let [waiting, smaller] = snapshot.health.reasons.as_slice() else {
        panic!("{:?}", snapshot.health);
    };
    assert_eq!(waiting, "no frame has come yet");
    assert!(smaller.contains("4096 bytes instead of 8192"), "{smaller}");
}

#[test]
fn the_socket_has_its_permissions_and_leaves_nothing_beside_it() {
    let folder = folder();
    let path = folder.path().join("status");
    let socket = Socket::listen(&path, 0o640).unwrap();
    assert_eq!(std::fs::symlink_metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    assert_eq!(names(folder.path()), std::slice::from_ref(&path));
    drop(socket);
    assert_eq!(names(folder.path()), Vec::<PathBuf>::new());
}

#[test]
fn a_dead_service_is_replaced_a_living_one_and_a_file_are_not() {
    let folder = folder();
    let path = folder.path().join("status");
    // A dead process leaves its name.
    drop(UnixListener::bind(&path).unwrap());
    assert!(path.exists());
    let living = Socket::listen(&path, 0o660).unwrap();
    let second = Socket::listen(&path, 0o660);
    assert!(matches!(second, Err(ListenError::InUse { .. })), "{second:?}");
    assert!(UnixStream::connect(&path).is_ok(), "the living one is still there");
    drop(living);
    std::fs::write(&path, "notes").unwrap();
    let third = Socket::listen(&path, 0o660);
    assert!(matches!(third, Err(ListenError::NotASocket { .. })), "{third:?}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "notes");
}

#[test]
fn a_name_that_another_took_over_is_left_to_it() {
    let folder = folder();
    let path = folder.path().join("status");
    let first = Socket::listen(&path, 0o660).unwrap();
    std::fs::remove_file(&path).unwrap();
    let _second = Socket::listen(&path, 0o660).unwrap();
    drop(first);
    assert!(path.exists());
}

#[test]
fn clients_that_never_read_hold_nobody_up() {
    let folder = folder();
    let path = folder.path().join("status");
    // More than a socket's buffer takes, so that the server is stuck with each of them.
    let mut large = document().to_vec();
    large.splice(1..1, std::iter::repeat_n(b' ', 4 << 20));
    let _stop = serving(&path, large.into());
    let stuck: Vec<_> = (0..8).map(|_| UnixStream::connect(&path).unwrap()).collect();
    std::thread::sleep(Duration::from_millis(200));
    // All places are taken: one more is sent away at once.
    let start = Instant::now();
    let refused = fetch_small(&path);
    assert_eq!(refused, 0, "a ninth client");
    assert!(start.elapsed() < Duration::from_secs(1));
    // And when their time is up, the places are free.
    std::thread::sleep(Duration::from_millis(2300));
    assert!(fetch_small(&path) > 0);
    drop(stuck);
}

/// Bytes of the beginning of an answer.
fn fetch_small(path: &Path) -> usize {
    let mut stream = UnixStream::connect(path).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    stream.read(&mut [0; 1024]).unwrap_or(0)
}

#[test]
fn what_a_client_writes_is_not_read() {
    let folder = folder();
    let path = folder.path().join("status");
    let _stop = serving(&path, document());
    let mut stream = UnixStream::connect(&path).unwrap();
    let _ = stream.write_all(b"GET / HTTP/1.1\r\n\r\n");
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let json: serde_json::Value = serde_json::from_slice(&answer).unwrap();
    assert_eq!(json["cell"], "cell");
}

#[test]
fn a_client_is_told_what_is_wrong() {
    let folder = folder();
    let path = folder.path().join("status");
    assert!(matches!(fetch_status(&path), Err(ClientError::NoService { .. })));
    let stop = serving(&path, Arc::from(*b"{\"schema\":99}"));
    assert!(matches!(fetch_status(&path), Err(ClientError::OtherSchema { theirs: 99 })));
    drop(stop);
    let path = folder.path().join("other");
    let _stop = serving(&path, Arc::from(*b"hello"));
    assert!(matches!(fetch_status(&path), Err(ClientError::NotAStatus { .. })));
    let path = folder.path().join("silent");
    let _stop = serving(&path, Arc::from(*b""));
    assert!(matches!(fetch_status(&path), Err(ClientError::Busy { .. })));
}

#[test]
fn commands_are_two_lines() {
    assert_eq!(parse_command("window begin\n"), Ok(Command::Begin));
    assert_eq!(parse_command("window end\r\n"), Ok(Command::End));
    for bad in ["", "window", "window begin now", "WINDOW BEGIN", "window begin\nwindow end"] {
        assert!(parse_command(bad).is_err(), "{bad:?}");
    }
    let folder = folder();
    let nobody = send_command(&folder.path().join("control"), Command::Begin);
    assert!(matches!(nobody, Err(ClientError::NoService { .. })));
}
