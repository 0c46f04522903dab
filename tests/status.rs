//! The two sockets: who may ask, who answers, and that no client can hold the service up.

use crate::common::expectation::Expectation;
use std::io::{Read, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use didim::live::acquire::{ReceiveBuffer, SharedAcquisition};
use didim::live::stream::StreamOptions;
use didim::live::worker::{Command, SharedEstimation};
use didim::service::status::{
    ClientError, Collector, Dispatcher, ListenError, MAX_REQUEST, ReloadSender, Request, Socket,
    fetch_status, send_request, serve_commands, serve_status,
};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/tmp").unwrap()
}

fn document() -> Arc<[u8]> {
    let options = StreamOptions::new("cell", (Path::new("/tmp/x"), "x"), 6, 500.0, 20.0).unwrap();
    let mut collector = Collector::new(
        &options,
        Some(SharedAcquisition::default()),
        Some(SharedEstimation::default()),
        Some(ReceiveBuffer { asked_bytes: 8192, granted_bytes: Some(4096) }),
        Instant::now(),
    );
    serde_json::to_vec(&collector.snapshot(Instant::now())).unwrap().into()
}

/// Serves a document on a thread of its own until the test is over.
fn serving(path: &Path, document: Arc<[u8]>) -> tokio::sync::oneshot::Sender<()> {
    let socket = Socket::listen(path, 0o660, None).unwrap();
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
fn whichever_program_connects_gets_one_object() {
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
fn the_socket_has_its_permissions_and_leaves_nothing_next_to_it() {
    let folder = folder();
    let path = folder.path().join("status");
    let socket = Socket::listen(&path, 0o640, None).unwrap();
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
    let living = Socket::listen(&path, 0o660, None).unwrap();
    let second = Socket::listen(&path, 0o660, None);
    assert!(matches!(second, Err(ListenError::InUse { .. })), "{second:?}");
    assert!(UnixStream::connect(&path).is_ok(), "the living one is still there");
    drop(living);
    std::fs::write(&path, "notes").unwrap();
    let third = Socket::listen(&path, 0o660, None);
    assert!(matches!(third, Err(ListenError::NotASocket { .. })), "{third:?}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "notes");
}

#[test]
fn a_name_that_another_took_over_is_left_to_it() {
    let folder = folder();
    let path = folder.path().join("status");
    let first = Socket::listen(&path, 0o660, None).unwrap();
    std::fs::remove_file(&path).unwrap();
    let _second = Socket::listen(&path, 0o660, None).unwrap();
    drop(first);
    assert!(path.exists());
}

/// A document larger than a socket's buffer, so that the server is stuck with a client that does
/// not read.
fn large_document() -> Arc<[u8]> {
    let mut large = document().to_vec();
    large.splice(1..1, std::iter::repeat_n(b' ', 4 << 20));
    large.into()
}

/// As many clients as there are places, none of which reads.
fn stuck_clients(path: &Path) -> Vec<UnixStream> {
    (0..8).map(|_| UnixStream::connect(path).unwrap()).collect()
}

#[test]
fn clients_that_never_read_hold_nobody_up() {
    let folder = folder();
    let path = folder.path().join("status");
    let _stop = serving(&path, large_document());
    let stuck = stuck_clients(&path);
    std::thread::sleep(Duration::from_millis(200));
    // All places are taken: the oldest gives its own to one more, at once.
    let start = Instant::now();
    assert!(fetch_small(&path) > 0, "a ninth client");
    let within_s: f64 = Expectation::of("clients-that-never-read").get("answered_within_s");
    assert!(start.elapsed().as_secs_f64() < within_s);
    drop(stuck);
}

#[test]
fn slow_clients_do_not_keep_a_thousand_others_out() {
    let folder = folder();
    let path = folder.path().join("status");
    let _stop = serving(&path, large_document());
    let stuck = stuck_clients(&path);
    let unanswered = (0..1000).filter(|_| fetch_small(&path) == 0).count();
    let expected = Expectation::of("clients-by-the-thousand");
    expected.assert_eq("unanswered_of_1000", &unanswered);
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
fn a_client_is_reported_what_is_wrong() {
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

/// Takes commands on a thread of its own until the test is over. Reloads are refused in words,
/// after a while.
fn commanded(path: &Path) -> tokio::sync::oneshot::Sender<()> {
    serve_refusals(Socket::listen(path, 0o600, None).unwrap(), Arc::default())
}

/// The same on a socket that is listening already. Counts the reloads.
fn serve_refusals(socket: Socket, reloads: Arc<AtomicUsize>) -> tokio::sync::oneshot::Sender<()> {
    let (stop, stopped) = tokio::sync::oneshot::channel();
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let (reload, mut asked) = ReloadSender::channel();
            let dispatcher = Dispatcher { windows: None, reload: Some(reload) };
            let refuse = async {
                while let Some(answer) = asked.recv().await {
                    reloads.fetch_add(1, Ordering::Relaxed);
                    tokio::time::sleep(Duration::from_millis(300)).await;
                    let _ = answer.send(Err("line 7\n  | wrong".to_owned()));
                }
            };
            tokio::select! {
                failed = serve_commands(&socket, dispatcher) => panic!("{failed:?}"),
                () = refuse => {}
                _ = stopped => {}
            }
        });
    });
    stop
}

/// What the socket answers to these bytes, whatever becomes of the connection then.
fn answer_to(path: &Path, bytes: &[u8]) -> String {
    let mut stream = UnixStream::connect(path).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let _ = stream.write_all(bytes);
    let _ = stream.shutdown(std::net::Shutdown::Write);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8(answer).unwrap()
}

#[test]
fn a_command_has_one_line_and_one_answer() {
    let folder = folder();
    let path = folder.path().join("command");
    let nobody = send_request(&path, &Request::Reload);
    assert!(matches!(nobody, Err(ClientError::NoService { .. })));
    let _stop = commanded(&path);
    let mode = std::fs::symlink_metadata(&path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode, 0o600);
    assert_eq!(answer_to(&path, b"reload\n"), "error: line 7 | wrong\n");
    let refused = send_request(&path, &Request::Window(Command::Identify)).unwrap_err();
    assert_eq!(refused.to_string(), "the service refused: this process has no windows");
    // What follows the line is not read as another.
    assert_eq!(answer_to(&path, b"window begin\nreload\n"), "error: this process has no windows\n");
}

#[test]
fn what_is_no_command_is_refused_in_words() {
    let folder = folder();
    let path = folder.path().join("command");
    let _stop = commanded(&path);
    let mut random = 1_u32;
    let mut garbage = Vec::new();
    for _ in 0..100_000 {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        garbage.push((random >> 24) as u8);
    }
    let exactly = [vec![b'x'; MAX_REQUEST - 1], b"\n".to_vec()].concat();
    let longer = [vec![b'x'; MAX_REQUEST], b"\n".to_vec()].concat();
    for (bytes, words) in [
        (exactly.as_slice(), "known: window"),
        (longer.as_slice(), "one line of at most 512 bytes"),
        (&[b'x'; 1 << 20], "one line of at most 512 bytes"),
        (b"", "one line of at most"),
        (b"reload", "one line of at most"),
        (b"\0\0\0\0\n", "UTF-8 text"),
        (b"window begin\xff\n", "UTF-8 text"),
        (&garbage, "error: a command is"),
    ] {
        let answer = answer_to(&path, bytes);
        assert!(answer.starts_with("error: ") && answer.contains(words), "{words}: {answer:?}");
        assert_eq!(answer.lines().count(), 1);
    }
}

#[test]
fn clients_that_say_nothing_hold_no_command_up() {
    let folder = folder();
    let path = folder.path().join("command");
    let _stop = commanded(&path);
    let silent: Vec<_> = (0..4).map(|_| UnixStream::connect(&path).unwrap()).collect();
    std::thread::sleep(Duration::from_millis(200));
    // All places are taken: the oldest gives its own to one more, which has its answer.
    let start = Instant::now();
    let fifth = send_request(&path, &Request::Reload);
    assert!(matches!(fifth, Err(ClientError::Refused { .. })), "{fifth:?}");
    let expected = Expectation::of("clients-that-say-nothing");
    assert!(start.elapsed().as_secs_f64() < expected.get("answered_within_s"));
    let lost_its_place = (&silent[0]).read(&mut [0]).unwrap();
    expected.assert_eq("bytes_for_the_oldest", &lost_its_place);
    // A client that sends a byte now and then has no more time than one that sends none.
    let mut slow = &silent[1];
    for _ in 0..5 {
        let _ = slow.write_all(b"r");
        std::thread::sleep(Duration::from_millis(460));
    }
    assert_eq!(slow.read(&mut [0]).unwrap_or(0), 0, "its time is up");
    // A command that waits for its answer keeps its place.
    let waiting: Vec<_> = (0..4)
        .map(|_| {
            let mut client = UnixStream::connect(&path).unwrap();
            client.write_all(b"reload\n").unwrap();
            client
        })
        .collect();
    std::thread::sleep(Duration::from_millis(100));
    let fifth = send_request(&path, &Request::Reload);
    assert!(matches!(fifth, Err(ClientError::Busy { .. } | ClientError::Io { .. })), "{fifth:?}");
    for mut client in waiting {
        let mut answer = String::new();
        client.read_to_string(&mut answer).unwrap();
        assert_eq!(answer, "error: line 7 | wrong\n");
    }
    drop(silent);
}

/// As for a process that was stopped: the socket takes the command, and the client gives up.
#[test]
fn a_command_whose_client_is_gone_is_not_carried_out() {
    let folder = folder();
    let path = folder.path().join("command");
    let socket = Socket::listen(&path, 0o600, None).unwrap();
    let reloads = Arc::<AtomicUsize>::default();
    let mut gone = UnixStream::connect(&path).unwrap();
    gone.write_all(b"reload\n").unwrap();
    drop(gone);
    // It has only finished sending.
    let mut waiting = UnixStream::connect(&path).unwrap();
    waiting.write_all(b"reload\n").unwrap();
    waiting.shutdown(std::net::Shutdown::Write).unwrap();
    let _stop = serve_refusals(socket, Arc::clone(&reloads));
    let mut answer = String::new();
    waiting.read_to_string(&mut answer).unwrap();
    assert_eq!(answer, "error: line 7 | wrong\n");
    assert_eq!(reloads.load(Ordering::Relaxed), 1);
}

#[test]
fn bytes_at_the_status_socket_change_nothing() {
    let folder = folder();
    let path = folder.path().join("status");
    let _stop = serving(&path, document());
    for bytes in [&b"reload\n"[..], b"\0\xff\n", &[b'x'; 1 << 20]] {
        let answer: serde_json::Value = serde_json::from_str(&answer_to(&path, bytes)).unwrap();
        let cell: String = Expectation::of("nonsense-at-the-socket").get("cell");
        assert_eq!(answer["cell"], cell);
    }
}

#[test]
fn a_socket_is_given_to_its_group() {
    let folder = folder();
    let path = folder.path().join("status");
    let unknown = Socket::listen(&path, 0o660, Some("no-such-group")).unwrap_err();
    assert!(unknown.to_string().contains("no such group"), "{unknown}");
    assert!(!path.exists());
    // A group that this user is a member of, or any for root.
    let own_group = nix::unistd::Group::from_gid(nix::unistd::getgid()).unwrap();
    let name = own_group.map_or_else(|| "root".to_owned(), |group| group.name);
    let wanted = if nix::unistd::geteuid().is_root() { "daemon".to_owned() } else { name };
    let id = nix::unistd::Group::from_name(&wanted).unwrap().unwrap().gid.as_raw();
    let _socket = Socket::listen(&path, 0o660, Some(&wanted)).unwrap();
    let data = std::fs::symlink_metadata(&path).unwrap();
    assert_eq!((data.permissions().mode() & 0o777, data.gid()), (0o660, id));
    assert_eq!(names(folder.path()), std::slice::from_ref(&path));
}
