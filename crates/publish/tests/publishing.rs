//! Every result arrives by its identity, whatever breaks in between, and nothing comes twice but by
//! its identity.

use std::collections::BTreeSet;

use crate::plant::broker::Broker;
use crate::plant::cabinet::Cabinet;
use crate::plant::consumer::Consumer;
use crate::plant::program::Program;
use crate::plant::wait_for;
use crate::plant::wire::Wire;

const ANYBODY: &str = "allow_anonymous true";

fn cabinets(folder: &tempfile::TempDir) -> Vec<Cabinet> {
    (1..=3).map(|number| Cabinet::new(folder.path(), number)).collect()
}

fn address(port: u16) -> String {
    format!("address = \"127.0.0.1:{port}\"")
}

/// The program knows that the broker has all that was stored: nothing is on its way any more.
fn all_acknowledged(folder: &tempfile::TempDir, cabinets: &[Cabinet]) {
    for Cabinet { name, stored, .. } in cabinets {
        let (ledger, last) =
            (folder.path().join(format!("sent/{name}.json")), stored.last().unwrap());
        wait_for("the ledger", || {
            std::fs::read_to_string(&ledger).ok()?.contains(last).then_some(())
        });
    }
}

/// All that was stored is there; and how many came more than once.
fn all_there(consumer: &Consumer, cabinets: &[Cabinet]) -> usize {
    let mut again = 0;
    for cabinet in cabinets {
        consumer.has(&cabinet.name, &cabinet.stored);
        let came = consumer.identities(&cabinet.name);
        let different: BTreeSet<_> = came.iter().collect();
        assert_eq!(different, cabinet.stored.iter().collect(), "{}", cabinet.name);
        again += came.len() - different.len();
        // In the order in which they were stored, but for what came again.
        let mut seen = BTreeSet::new();
        let first: Vec<_> = came.iter().filter(|one| seen.insert(*one)).collect();
        assert_eq!(first, cabinet.stored.iter().collect::<Vec<_>>(), "{}", cabinet.name);
    }
    again
}

#[test]
#[ignore = "needs mosquitto (Debian: mosquitto): tests/run"]
fn results_and_alarms_outlast_a_broker_that_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let mut broker = Broker::start(ANYBODY);
    let consumer = Consumer::new(broker.port);
    let mut cabinets = cabinets(&folder);
    cabinets.iter_mut().for_each(|cabinet| cabinet.store(3));
    let program = Program::start(folder.path(), &address(broker.port), &cabinets);
    assert_eq!(all_there(&consumer, &cabinets), 0, "nothing comes twice where nothing breaks");
    let message = &consumer.heard_on("/cabinet-1/result")[2];
    assert_eq!(message.topic, "didim/cabinet-1/result");
    assert_eq!(
        (&message.json["schema"], &message.json["version"]),
        (&"didim.result".into(), &1.into())
    );
    assert_eq!(message.json["line"]["result"], 2);
    assert_eq!(message.json["line"]["parameters"][0]["unit"], "N·m");
    consumer.is_online("cabinet-2", true);

    broker.kill();
    cabinets.iter_mut().for_each(|cabinet| cabinet.store(3));
    cabinets[1].alarm(Some("fc3"));
    wait_for("the outage", || program.log().contains("cabinet-2: nothing is sent").then_some(()));
    // Kept by the program's own memory of what is to be sent, and by its disk.
    let ledger = folder.path().join("sent/cabinet-2.json");
    wait_for("the alarm", || std::fs::read_to_string(&ledger).ok()?.contains("fc3").then_some(()));
    broker.start_again();
    all_there(&consumer, &cabinets);
    wait_for("the alarm", || consumer.heard_on("/cabinet-2/alarm").pop());
    cabinets[1].alarm(None);
    let turns = wait_for("its end", || {
        let alarms = consumer.heard_on("/alarm");
        (alarms.len() > 1).then_some(alarms)
    });
    let turns: Vec<_> =
        turns.iter().map(|of| (of.json["event"].as_str(), &of.json["alarm"])).collect();
    assert_eq!((turns[0].0, turns[1].0), (Some("raised"), Some("cleared")));
    assert_eq!(turns[0].1["parameter"], "fc3");
    let drift = consumer.heard_on("/cabinet-2/drift").pop().unwrap();
    assert_eq!(
        (&drift.json["schema"], &drift.json["drift"]["compared"]),
        (&"didim.drift".into(), &true.into())
    );

    // The broker itself reports that nobody is there, also to clients that come later.
    program.kill();
    cabinets.iter().for_each(|cabinet| consumer.is_online(&cabinet.name, false));
    assert!(consumer.heard_on("/state").iter().all(|of| of.json["schema"] == "didim.state"));
}

/// A program whose answers pass a wire, and what it has to do with; bound in this order, it ends
/// first.
struct Sending {
    folder: tempfile::TempDir,
    _broker: Broker,
    wire: Wire,
    consumer: Consumer,
    cabinets: Vec<Cabinet>,
    program: Program,
}

/// Two results of each cabinet are acknowledged.
fn sending() -> Sending {
    let folder = tempfile::tempdir().unwrap();
    let broker = Broker::start(ANYBODY);
    let wire = Wire::start(broker.port);
    let consumer = Consumer::new(broker.port);
    let mut cabinets = cabinets(&folder);
    cabinets.iter_mut().for_each(|cabinet| cabinet.store(2));
    let program = Program::start(folder.path(), &address(wire.port), &cabinets);
    all_there(&consumer, &cabinets);
    all_acknowledged(&folder, &cabinets);
    Sending { folder, _broker: broker, wire, consumer, cabinets, program }
}

#[test]
#[ignore = "needs mosquitto (Debian: mosquitto): tests/run"]
fn a_message_whose_acknowledgement_is_lost_with_the_connection_comes_again() {
    let Sending { folder: _folder, _broker, wire, consumer, mut cabinets, program: _program } =
        sending();

    wire.lose_answers(true);
    cabinets.iter_mut().for_each(|cabinet| cabinet.store(3));
    // The broker has the first of them, and nobody knows.
    cabinets.iter().for_each(|cabinet| consumer.has(&cabinet.name, &cabinet.stored[..3]));
    wire.lose_answers(false);
    wire.cut();
    assert_eq!(all_there(&consumer, &cabinets), 3, "that one of each comes again, and no other");
}

#[test]
#[ignore = "needs mosquitto (Debian: mosquitto): tests/run"]
fn a_program_that_is_killed_before_the_acknowledgement_sends_again() {
    let Sending { folder, _broker, wire, consumer, mut cabinets, program } = sending();

    wire.lose_answers(true);
    cabinets.iter_mut().for_each(|cabinet| cabinet.store(1));
    cabinets.iter().for_each(|cabinet| consumer.has(&cabinet.name, &cabinet.stored));
    program.kill();
    wire.lose_answers(false);
    cabinets.iter_mut().for_each(|cabinet| cabinet.store(2));
    let program = Program::start(folder.path(), &address(wire.port), &cabinets);
    assert_eq!(all_there(&consumer, &cabinets), 3, "that one of each comes again, and no other");

    // What is acknowledged does not come again.
    all_acknowledged(&folder, &cabinets);
    program.kill();
    cabinets[0].store(1);
    let _program = Program::start(folder.path(), &address(wire.port), &cabinets[..1]);
    consumer.has("cabinet-1", &cabinets[0].stored);
    assert_eq!(consumer.identities("cabinet-1").len(), cabinets[0].stored.len() + 1);
}

/// A broker of MQTT 5 says so; what it does not take is not taken for sent.
#[test]
#[ignore = "needs mosquitto (Debian: mosquitto): tests/run"]
fn a_topic_that_the_broker_refuses_is_reported_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let rights = |topics: &str| format!("topic read #\nuser plant\ntopic write {topics}\n");
    let accounts = "acl_file FOLDER/rights\npassword_file FOLDER/passwords\nallow_anonymous true";
    let mut broker = Broker::start_with(accounts, |folder| {
        std::fs::write(folder.join("rights"), rights("didim/+/state")).unwrap();
        let mut made = std::process::Command::new("mosquitto_passwd");
        made.arg("-b").arg("-c").arg(folder.join("passwords")).args(["plant", "secret"]);
        assert!(made.status().unwrap().success());
    });
    let consumer = Consumer::new(broker.port);
    let mut cabinet = Cabinet::new(folder.path(), 1);
    cabinet.store(2);
    let password = folder.path().join("password");
    std::fs::write(&password, "secret\n").unwrap();
    let mode = <std::fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o600);
    std::fs::set_permissions(&password, mode).unwrap();
    let lines = format!(
        "{}\nuser = \"plant\"\npassword_file = \"{}\"",
        address(broker.port),
        password.display()
    );
    let program = Program::start(folder.path(), &lines, std::slice::from_ref(&cabinet));
    wait_for("the refusal", || {
        program
            .log()
            .contains("the broker does not take didim/cabinet-1/drift: NotAuthorized")
            .then_some(())
    });
    assert!(!program.log().contains("secret"));
    consumer.is_online("cabinet-1", true);
    // Some refusals later it still is, and has never been away.
    std::thread::sleep(std::time::Duration::from_secs(2));
    let states = consumer.heard_on("/state");
    assert!(states.iter().all(|of| of.json["online"] == true), "{states:?}");
    assert_eq!(consumer.heard_on("/result").len(), 0);

    broker.kill();
    std::fs::write(broker.file("rights"), rights("didim/#")).unwrap();
    broker.start_again();
    assert_eq!(all_there(&consumer, std::slice::from_ref(&cabinet)), 0);
}
