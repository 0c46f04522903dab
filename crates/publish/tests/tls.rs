//! Over TLS, with certificates made here.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::plant::broker::Broker;
use crate::plant::cabinet::Cabinet;
use crate::plant::consumer::Consumer;
use crate::plant::program::Program;
use crate::plant::{free_port, wait_for};

fn openssl(folder: &Path, arguments: &str) {
    let mut command = Command::new("openssl");
    command.current_dir(folder).args(arguments.split_whitespace()).stderr(Stdio::null());
    assert!(command.status().unwrap().success(), "openssl {arguments}");
}

/// An authority, and a broker's certificate by it.
fn certificates(folder: &Path) {
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";
    openssl(folder, &format!("req -x509 {key} -keyout ca.key -out ca.pem -days 2 -subj /CN=plant"));
    openssl(folder, &format!("req {key} -keyout broker.key -out broker.csr -subj /CN=broker"));
    let names = "subjectAltName=DNS:localhost,IP:127.0.0.1\nbasicConstraints=CA:FALSE\n";
    std::fs::write(folder.join("names"), names).unwrap();
    openssl(
        folder,
        "x509 -req -in broker.csr -CA ca.pem -CAkey ca.key -CAcreateserial -out broker.pem -days 2 \
        -extfile names",
    );
}

#[test]
#[ignore = "needs mosquitto (Debian: mosquitto) and openssl (Debian: openssl): tests/run"]
fn a_broker_is_believed_by_its_certificate() {
    let folder = tempfile::tempdir().unwrap();
    let port = free_port();
    let secure = format!(
        "allow_anonymous true\nlistener {port} 127.0.0.1\ncertfile FOLDER/broker.pem\nkeyfile \
        FOLDER/broker.key"
    );
    let broker = Broker::start_with(&secure, certificates);
    let consumer = Consumer::new(broker.port);
    let mut cabinet = Cabinet::new(folder.path(), 1);
    cabinet.store(2);
    let cabinets = std::slice::from_ref(&cabinet);

    // An authority of the same name, which has not signed.
    let other = tempfile::tempdir().unwrap();
    certificates(other.path());
    let address_with =
        |ca: &Path| format!("address = \"localhost:{port}\"\nca_file = \"{}\"", ca.display());
    let program =
        Program::start(folder.path(), &address_with(&other.path().join("ca.pem")), cabinets);
    wait_for("the refusal", || program.log().contains("invalid peer certificate").then_some(()));
    program.kill();
    assert_eq!(consumer.heard_on("cabinet-1/result").len(), 0);

    let _program = Program::start(folder.path(), &address_with(&broker.file("ca.pem")), cabinets);
    consumer.has("cabinet-1", &cabinet.stored);
}
