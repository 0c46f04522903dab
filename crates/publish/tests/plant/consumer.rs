//! Who listens to the broker, and comes back when that was away.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rumqttc::{AsyncClient, Broker, BrokerSessionResumePolicy, Event, Incoming, MqttOptions, QoS};
use serde_json::Value;

use super::wait_for;

/// A message as it came.
#[derive(Clone, Debug)]
pub(crate) struct Heard {
    pub(crate) topic: String,
    pub(crate) json: Value,
}

pub(crate) struct Consumer(Arc<Mutex<Vec<Heard>>>);

impl Consumer {
    /// Listens to all that comes, in a session that the broker keeps.
    pub(crate) fn new(port: u16) -> Self {
        let mut options = MqttOptions::new("consumer", Broker::tcp("127.0.0.1", port));
        options.set_clean_start(false).set_session_expiry_interval(Some(3600));
        options.set_broker_session_resume_policy(BrokerSessionResumePolicy::AllowBrokerOnly);
        options.set_max_packet_size(Some(1 << 20));
        let heard = Arc::new(Mutex::new(Vec::new()));
        let (into, (ready, subscribed)) = (Arc::clone(&heard), std::sync::mpsc::channel());
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            runtime.unwrap().block_on(listen(options, &into, &ready));
        });
        subscribed.recv().unwrap();
        Self(heard)
    }

    /// What came on topics with this end.
    pub(crate) fn heard_on(&self, end: &str) -> Vec<Heard> {
        let heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        heard.iter().filter(|heard| heard.topic.ends_with(end)).cloned().collect()
    }

    /// The identities of the results of a cabinet, as often as they came.
    pub(crate) fn identities(&self, cabinet: &str) -> Vec<String> {
        let results = self.heard_on(&format!("/{cabinet}/result"));
        results.iter().map(|of| of.json["identity"].as_str().unwrap().to_owned()).collect()
    }

    /// Waits until all of them are there.
    pub(crate) fn has(&self, cabinet: &str, identities: &[String]) {
        wait_for("a result", || {
            let seen = self.identities(cabinet);
            identities.iter().all(|one| seen.contains(one)).then_some(())
        });
    }

    /// Waits for a state of a cabinet, the last that came.
    pub(crate) fn is_online(&self, cabinet: &str, online: bool) {
        wait_for("the state", || {
            let last = self.heard_on(&format!("/{cabinet}/state")).pop()?;
            (last.json["online"] == online).then_some(())
        });
    }
}

async fn listen(
    options: MqttOptions,
    into: &Mutex<Vec<Heard>>,
    ready: &std::sync::mpsc::Sender<()>,
) {
    let (client, mut events) = AsyncClient::builder(options).capacity(10).build();
    loop {
        match events.poll().await {
            Ok(Event::Incoming(Incoming::ConnAck(_))) => {
                client.subscribe("#", QoS::AtLeastOnce).await.unwrap();
            }
            Ok(Event::Incoming(Incoming::SubAck(_))) => drop(ready.send(())),
            Ok(Event::Incoming(Incoming::Publish(of))) => {
                let topic = String::from_utf8(of.topic.to_vec()).unwrap();
                let json = serde_json::from_slice(&of.payload).unwrap();
                into.lock().unwrap().push(Heard { topic, json });
            }
            Ok(_) => {}
            Err(_) => tokio::time::sleep(Duration::from_millis(20)).await,
        }
    }
}
