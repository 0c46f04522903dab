//! The sample stream between threads and processes: what arrives, what is lost, who dies.

use std::os::unix::fs::PermissionsExt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::expectation::Expectation;
use crate::common::{Network, Process, eventually, sample};
use didim::live::stream::{
    BATCH_SAMPLES, BatchKind, Pace, ServiceNetwork, StreamError, StreamNode, Topic,
};
use didim_drivers::socket::monotonic_ns;

const FULL: u64 = BATCH_SAMPLES as u64;

#[test]
fn samples_arrive_as_they_were_written() {
    let network = Network::new();
    let options = network.options();
    let mut writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    let mut reader = StreamNode::join(&options).unwrap().sample_reader().unwrap();
    let now = Instant::now();
    let began_ns = monotonic_ns();
    for sequence in 0..FULL + 3 {
        writer.write(&sample(sequence), sequence / 10, now, began_ns + sequence).unwrap();
    }
    assert_eq!(writer.batches_sent(), 1, "the second batch is neither full nor of age");
    assert_eq!(writer.due_in(now), Some(options.max_batch_age));
    writer.send_if_due(now + options.max_batch_age).unwrap();
    assert_eq!(writer.due_in(now), None);
    writer.finish().unwrap();

    let mut sequence = 0;
    for (count, kind) in [(FULL, BatchKind::Live), (3, BatchKind::Live), (0, BatchKind::End)] {
        reader.wait_for_batch(Duration::from_secs(1)).unwrap();
        let batch = reader.receive().unwrap().unwrap();
        assert_eq!((batch.samples().len() as u64, batch.kind()), (count, kind));
        assert_eq!((batch.lost_batches, batch.restarted), (0, false));
        assert!((began_ns..=monotonic_ns()).contains(&batch.sent_ns()));
        for read in batch.samples() {
            assert_eq!(read.written_ns, began_ns + sequence);
            assert_eq!(read.joint_sample(), sample(sequence));
            assert_eq!(read.queue_drops, sequence / 10);
            sequence += 1;
        }
    }
    assert!(reader.receive().unwrap().is_none());
}

#[test]
fn a_slow_reader_loses_the_oldest_batches_and_knows_how_many() {
    let network = Network::new();
    let options = network.options();
    let mut writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    let mut reader = StreamNode::join(&options).unwrap().sample_reader().unwrap();
    let capacity = options.buffer_batches() as u64;
    let batches = capacity + 7;
    let now = Instant::now();
    for sequence in 0..(1 + batches) * FULL {
        writer.write(&sample(sequence), 0, now, 0).unwrap();
        if sequence == FULL - 1 {
            assert_eq!(reader.receive().unwrap().unwrap().number(), 0);
        }
    }
    let first = reader.receive().unwrap().unwrap();
    Expectation::of("estimator-slow").assert_eq("lost_batches", &first.lost_batches);
    assert_eq!(first.samples()[0].sequence, 8 * FULL);
    drop(first);
    let mut batches_left = 1;
    while let Some(batch) = reader.receive().unwrap() {
        assert_eq!(batch.lost_batches, 0);
        batches_left += 1;
    }
    assert_eq!(batches_left, capacity);
}

#[test]
fn the_buffer_holds_what_the_options_promise() {
    let network = Network::new();
    let mut options = network.options();
    options.sample_rate_hz = 500.0;
    options.buffer_s = 20.0;
    assert!(options.buffer_batches() as f64 >= 20.0 * (500.0 / 64.0 + 1.0 / 0.05));
    let writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    // The pages are there before the first sample, and no more than was announced.
    let occupied = network.occupied_bytes();
    println!("{occupied} B occupied, {} B announced", options.shared_memory_bytes());
    let payload =
        (2 * options.buffer_batches() * size_of::<didim::live::stream::SampleBatch>()) as u64;
    assert!(occupied >= payload, "{occupied} B occupied, {payload} B of payload");
    assert!(occupied <= options.shared_memory_bytes(), "{occupied} B occupied");
    drop(writer);
    // What stays is the library's own bookkeeping of the root, one small file.
    assert!(network.occupied_bytes() < 1 << 20, "{} B left", network.occupied_bytes());
}

#[test]
fn ports_come_and_go_in_one_thread_while_another_makes_its_own() {
    let network = Network::new();
    let options = network.options();
    let writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    let done = AtomicBool::new(false);
    let opened = std::thread::scope(|scope| {
        let others = scope.spawn(|| {
            let mut opened = 0;
            while !done.load(Ordering::Relaxed) {
                drop(StreamNode::join(&options).unwrap().sample_reader().unwrap());
                opened += 1;
            }
            opened
        });
        let node = StreamNode::join(&options).unwrap();
        let failure = (0..600).find_map(|_| node.document_writer(Topic::Status).err());
        done.store(true, Ordering::Relaxed);
        assert!(failure.is_none(), "{failure:?}");
        others.join().unwrap()
    });
    assert!(opened > 10, "{opened} ports opened meanwhile");
    drop(writer);
}

#[test]
fn nothing_stays_of_a_private_network() {
    let network = Network::new();
    let (root, prefix) = (network.root.clone(), network.prefix.clone());
    drop(StreamNode::join(&network.options()).unwrap().sample_writer(Pace::Live).unwrap());
    assert!(network.files().count() > 0 && root.exists());
    drop(network);
    let files = std::fs::read_dir("/dev/shm").unwrap().flatten();
    assert!(!files.into_iter().any(|file| file.file_name().to_string_lossy().starts_with(&prefix)));
    assert!(!root.exists());
}

/// The name of the counter belongs to the library: with another one, it would make a file for all.
#[test]
fn no_file_of_a_network_is_open_to_others() {
    let network = Network::new();
    let options = network.options();
    let _writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    let _reader = StreamNode::join(&options).unwrap().sample_reader().unwrap();
    let modes: Vec<u32> =
        network.files().map(|file| file.metadata().unwrap().permissions().mode() & 0o777).collect();
    assert!(modes.len() > 5 && modes.iter().all(|mode| *mode == 0o600), "{modes:?}");
}

#[test]
fn a_damaged_counter_is_made_anew_and_a_file_for_all_is_named() {
    let network = Network::new();
    let options = network.options();
    drop(StreamNode::join(&options).unwrap());
    let counter = network.files().find(|file| file.metadata().unwrap().len() == 16).unwrap();
    let counter = counter.path();
    for damaged in [b"".as_slice(), b"short", b"sixteen bytes...", b"seventeen bytes.."] {
        std::fs::write(&counter, damaged).unwrap();
        let begin = Instant::now();
        drop(StreamNode::join(&options).unwrap());
        assert!(begin.elapsed() < Duration::from_secs(5), "{:?}", begin.elapsed());
        assert_eq!(counter.metadata().unwrap().len(), 16);
    }
    std::fs::set_permissions(&counter, std::fs::Permissions::from_mode(0o606)).unwrap();
    let refused = StreamNode::join(&options).unwrap_err();
    let StreamError::Foreign { path, owner, problem } = &refused else { panic!("{refused}") };
    assert_eq!(*path, counter);
    assert_eq!(*owner, rustix::process::geteuid().as_raw());
    assert_eq!(*problem, "can be opened by other users");
}

#[test]
fn processes_of_a_service_share_a_prefix_and_the_next_start_draws_another() {
    let folder = tempfile::tempdir().unwrap();
    let join = || ServiceNetwork::join(folder.path()).unwrap();
    let count = |prefix: &str| {
        let files = std::fs::read_dir("/dev/shm").unwrap().flatten();
        files.filter(|file| file.file_name().to_str().unwrap().starts_with(prefix)).count()
    };
    let (first, second) = (join(), join());
    let prefix = first.prefix().to_owned();
    assert_eq!(second.prefix(), prefix);
    drop(first);
    assert_eq!(join().prefix(), prefix, "one of them lives");
    assert_eq!(count(&prefix), 1, "the file that keeps the prefix");
    drop(second);
    assert_eq!(count(&prefix), 0);
    let third = join();
    assert!(third.prefix() != prefix && third.prefix().starts_with("didim_"));
    // A damaged file in the runtime folder.
    drop(third);
    let file = folder.path().join("ipc.prefix");
    for damaged in ["", "didim_", "didim_../../../etc_", "didim-run-0123456789ab_"] {
        std::fs::write(&file, damaged).unwrap();
        assert!(join().prefix().len() == prefix.len(), "{damaged}");
    }
    // A process that holds it is waited for, but not for ever.
    let locked = std::fs::File::open(&file).unwrap();
    rustix::fs::flock(&locked, rustix::fs::FlockOperation::LockExclusive).unwrap();
    let begin = Instant::now();
    let refused = ServiceNetwork::join(folder.path()).unwrap_err();
    assert!(refused.to_string().contains(file.to_str().unwrap()), "{refused}");
    assert!(begin.elapsed() < Duration::from_secs(5), "{:?}", begin.elapsed());
    // A folder in its place is named.
    std::fs::remove_file(&file).unwrap();
    std::fs::create_dir(&file).unwrap();
    let refused = ServiceNetwork::join(folder.path()).unwrap_err();
    assert!(refused.to_string().contains(file.to_str().unwrap()), "{refused}");
}

#[test]
fn too_little_shared_memory_is_refused_before_anything_is_made() {
    let network = Network::new();
    let mut options = network.options();
    options.sample_rate_hz = 20_000.0;
    options.buffer_s = 600.0;
    assert!(matches!(options.validate(), Err(StreamError::Option { key: "buffer_s", .. })));
    assert!(StreamNode::join(&options).is_err());
    assert_eq!(network.files().count(), 0);
    assert!(!network.root.exists());
}

/// A shared memory of 1 MiB, in which the buffer of the cell has no room.
#[test]
#[ignore = "needs a mount of its own: tests/run"]
fn a_full_shared_memory_is_refused_with_what_is_needed() {
    const INSIDE: &str = "DIDIM_TEST_INSIDE_A_SMALL_SHARED_MEMORY";
    if std::env::var_os(INSIDE).is_some() {
        let network = Network::new();
        let refused = StreamNode::join(&network.options()).unwrap_err();
        let StreamError::SharedMemoryFull { needed_bytes, available_bytes, .. } = &refused else {
            panic!("{refused}");
        };
        assert!(available_bytes < needed_bytes && *available_bytes <= 1 << 20, "{refused}");
        Expectation::of("shared-memory-full").assert_said(
            &refused.to_string(),
            &[("needed_bytes", needed_bytes), ("available_bytes", available_bytes)],
        );
        return;
    }
    let mount = "mount -t tmpfs -o size=1m tmpfs /dev/shm && exec \"$@\"";
    let mut command = std::process::Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-euc", mount, "sh"]);
    command.arg(std::env::current_exe().unwrap());
    let test = "stream::a_full_shared_memory_is_refused_with_what_is_needed";
    command.args(["--exact", test, "--ignored", "--nocapture"]).env(INSIDE, "1");
    let ended = command.output().unwrap();
    let output = String::from_utf8_lossy(&ended.stdout);
    assert!(ended.status.success() && output.contains("1 passed"), "{ended:#?}");
}

#[test]
fn a_cell_has_one_acquisition() {
    let network = Network::new();
    let options = network.options();
    let _first = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    let second = StreamNode::join(&options).unwrap().sample_writer(Pace::Live);
    assert!(matches!(second, Err(StreamError::Port { port: "publisher", .. })), "{second:?}");
}

#[test]
fn a_reader_with_another_cell_file_is_reported() {
    let network = Network::new();
    let options = network.options();
    let mut writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    let mut other = options.clone();
    other.joints = 5;
    let mut reader = StreamNode::join(&other).unwrap().sample_reader().unwrap();
    writer.finish().unwrap();
    assert!(matches!(reader.receive(), Err(StreamError::OtherCell { their_joints: 6, .. })));
    // A rate that sizes the buffer differently is refused by the service itself.
    other.sample_rate_hz = 5000.0;
    let refused = StreamNode::join(&other).unwrap().sample_reader();
    assert!(matches!(refused, Err(StreamError::Service { .. })), "{refused:?}");
}

#[test]
fn a_restarted_acquisition_is_noticed() {
    let network = Network::new();
    let options = network.options();
    let mut reader = StreamNode::join(&options).unwrap().sample_reader().unwrap();
    for run in 0..3 {
        let mut writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
        writer.write(&sample(run), 0, Instant::now(), 0).unwrap();
        writer.send_if_due(Instant::now() + Duration::from_secs(1)).unwrap();
        let batch = reader.receive().unwrap().unwrap();
        assert_eq!(batch.restarted, run > 0);
        assert_eq!(batch.samples()[0].sequence, run);
    }
}

#[test]
fn a_replay_waits_for_its_reader_and_loses_nothing() {
    let network = Network::new();
    let options = network.options();
    let total = 40 * options.buffer_batches() as u64 * FULL;
    let writer_options = options.clone();
    let (alone, was_alone) = std::sync::mpsc::channel();
    let writer = std::thread::spawn(move || {
        let mut writer =
            StreamNode::join(&writer_options).unwrap().sample_writer(Pace::Replay).unwrap();
        alone.send(writer.has_room().unwrap()).unwrap();
        for sequence in 0..total {
            while !writer.has_room().unwrap() {
                std::thread::sleep(Duration::from_micros(100));
            }
            writer.write(&sample(sequence), 0, Instant::now(), 0).unwrap();
        }
        writer.finish().unwrap();
        eventually("the reader has acknowledged all", || writer.is_drained().unwrap());
    });
    assert!(!was_alone.recv().unwrap(), "nobody is there to read");
    let mut reader = StreamNode::join(&options).unwrap().sample_reader().unwrap();
    let mut next = 0;
    let start = Instant::now();
    'stream: loop {
        assert!(start.elapsed() < Duration::from_secs(60), "stuck at sample {next} of {total}");
        reader.wait_for_batch(Duration::from_millis(100)).unwrap();
        while let Some(batch) = reader.receive().unwrap() {
            assert_eq!(batch.lost_batches, 0);
            for sample in batch.samples() {
                assert_eq!(sample.sequence, next);
                next += 1;
            }
            reader.acknowledge().unwrap();
            if batch.kind() == BatchKind::End {
                break 'stream;
            }
        }
    }
    assert_eq!(next, total);
    writer.join().unwrap();
}

#[test]
fn documents_wait_for_late_readers() {
    let network = Network::new();
    let node = StreamNode::join(&network.options()).unwrap();
    let mut writer = node.document_writer(Topic::Status).unwrap();
    writer.publish(b"{\"first\":1}").unwrap();
    writer.publish(b"{\"second\":2}").unwrap();
    let mut reader = node.document_reader(Topic::Status).unwrap();
    writer.publish(b"{\"third\":3}").unwrap();
    assert_eq!(reader.receive().unwrap().unwrap(), b"{\"second\":2}");
    assert_eq!(reader.receive().unwrap().unwrap(), b"{\"third\":3}");
    assert!(reader.receive().unwrap().is_none());
    let long = vec![b' '; didim::live::stream::MAX_DOCUMENT_BYTES + 1];
    assert!(matches!(writer.publish(&long), Err(StreamError::DocumentTooLong { .. })));
    let mut estimates = node.document_reader(Topic::Estimates).unwrap();
    assert!(estimates.receive().unwrap().is_none());
}

/// Run by [`two_processes_hand_over_samples`] and others as another process.
#[test]
#[ignore = "the other process of a test"]
fn child_writes_until_killed() {
    let Some(network) = Network::inherited() else { return };
    let node = StreamNode::join(&network.options()).unwrap();
    let mut writer = node.sample_writer(Pace::Live).unwrap();
    for sequence in 0.. {
        writer.write(&sample(sequence), 0, Instant::now(), 0).unwrap();
        std::thread::sleep(Duration::from_micros(200));
    }
}

#[test]
#[ignore = "the other process of a test"]
fn child_reads_until_killed() {
    let Some(network) = Network::inherited() else { return };
    let mut reader = StreamNode::join(&network.options()).unwrap().sample_reader().unwrap();
    // Holds a batch when it dies.
    let mut held_batch = None;
    loop {
        reader.wait_for_batch(Duration::from_millis(100)).unwrap();
        if let Some(batch) = reader.receive().unwrap() {
            held_batch = Some(batch);
        }
        let _ = &held_batch;
    }
}

#[test]
fn two_processes_hand_over_samples_and_a_killed_writer_can_be_restarted() {
    let network = Network::new();
    let mut reader = StreamNode::join(&network.options()).unwrap().sample_reader().unwrap();
    for run in 0..2 {
        let mut child =
            network.child("stream::child_writes_until_killed").spawn().map(Process).unwrap();
        let mut next = None;
        let mut received = 0;
        eventually("five batches from another process", || {
            reader.wait_for_batch(Duration::from_millis(100)).unwrap();
            while let Some(batch) = reader.receive().unwrap() {
                if received == 0 {
                    assert_eq!(batch.restarted, run > 0);
                }
                for read in batch.samples() {
                    assert_eq!(read.joint_sample(), sample(read.sequence));
                    assert!(next.is_none_or(|next| next == read.sequence));
                    next = Some(read.sequence + 1);
                }
                received += 1;
            }
            received >= 5
        });
        // SIGKILL: nothing is cleaned up by the child.
        child.0.kill().unwrap();
        child.0.wait().unwrap();
        while reader.receive().unwrap().is_some() {}
    }
    // Nobody starts it again: the reader itself cleans up after the dead.
    assert!(network.occupied_bytes() > network.options().samples_bytes() / 2);
    eventually("the dead process's memory is free", || {
        reader.wait_for_batch(Duration::from_millis(100)).unwrap();
        let _ = reader.receive().unwrap();
        network.occupied_bytes() < network.options().samples_bytes() / 2
    });
}

#[test]
fn a_killed_reader_blocks_nobody_and_its_place_is_freed() {
    let network = Network::new();
    let options = network.options();
    let mut writer = StreamNode::join(&options).unwrap().sample_writer(Pace::Live).unwrap();
    let mut child = network.child("stream::child_reads_until_killed").spawn().map(Process).unwrap();
    eventually("the other process reads", || writer.readers() == 1);
    let mut write = |batches: u64| {
        let mut longest = Duration::ZERO;
        for sequence in 0..batches * FULL {
            let start = Instant::now();
            writer.write(&sample(sequence), 0, start, 0).unwrap();
            longest = longest.max(start.elapsed());
        }
        longest
    };
    write(3);
    std::thread::sleep(Duration::from_millis(50));
    child.0.kill().unwrap();
    child.0.wait().unwrap();
    // Ten buffers' worth into a dead reader's queue.
    let longest = write(10 * options.buffer_batches() as u64);
    assert!(longest < Duration::from_millis(500), "a write took {longest:?}");
    // A new process joins, cleans up, and both places can be taken.
    let first = StreamNode::join(&options).unwrap().sample_reader().unwrap();
    let second = StreamNode::join(&options).unwrap().sample_reader().unwrap();
    drop((first, second));
}
