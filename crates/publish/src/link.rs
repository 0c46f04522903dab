//! Connection to the broker. It sends one message at a time and waits for the acknowledgement.

use core::time::Duration;

use rumqttc::{
    AsyncClient, Broker as BrokerTarget, ConnectionError, Event, Incoming, LastWill, MqttOptions,
    NetworkOptions, PubAckReason, PublishOptions, QoS, Transport,
};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

use crate::configuration::Broker;

/// Keep-alive interval \[s\]. If the broker receives nothing for one and a half intervals, it
/// reports the cabinet as offline (MQTT 5, 3.1.2.10).
const KEEP_ALIVE_S: u16 = 30;
/// Maximum time for an acknowledgement by the broker.
const ACKNOWLEDGE_TIMEOUT: Duration = Duration::from_secs(20);

/// Reason why a message cannot be sent.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LinkError {
    /// There is no connection, or it has ended.
    #[error(
        "{address}: {cause}; see that the broker runs, is reached, and takes this client's name, \
        user and certificate"
    )]
    Broker {
        /// Address of the broker.
        address: String,
        /// Error of the MQTT library.
        cause: Box<ConnectionError>,
    },
    /// The broker refuses a topic.
    #[error(
        "the broker does not take {topic}: {reason:?}; allow this client's user to write there"
    )]
    Refused {
        /// Topic of the message.
        topic: String,
        /// Reason code of the broker.
        reason: PubAckReason,
    },
    /// The broker did not acknowledge a message in time.
    #[error(
        "the broker has not acknowledged {topic} for {} s; see how busy it is",
        ACKNOWLEDGE_TIMEOUT.as_secs()
    )]
    Silent {
        /// Topic of the message.
        topic: String,
    },
}

/// Settings of a connection: the name of the client, the address of the broker, and the message
/// that the broker publishes when the connection ends.
#[derive(Clone, Debug)]
pub(crate) struct BrokerAddress {
    options: MqttOptions,
}

impl BrokerAddress {
    /// Creates the settings for a broker. The last will is retained.
    pub(crate) fn new(client: &str, broker: &Broker, topic: &str, will: Vec<u8>) -> Self {
        let target = BrokerTarget::tcp(&broker.address.host, broker.address.port);
        let mut options = MqttOptions::new(client, target);
        let mut network = NetworkOptions::new();
        network.set_tcp_nodelay(true);
        options
            .set_keep_alive(KEEP_ALIVE_S)
            .set_clean_start(true)
            // The library reserves capacity for each message that is not acknowledged.
            .set_outgoing_inflight_upper_limit(1)
            .set_last_will(LastWill::new(topic, will, QoS::AtLeastOnce, true, None));
        options.set_network_options(network);
        if let Some(user) = &broker.user {
            options.set_credentials(user, broker.secrets.password.clone().unwrap_or_default());
        }
        if let Some(ca) = &broker.secrets.ca {
            options.set_transport(tls_transport(ca));
        }
        Self { options }
    }

    fn address(&self) -> String {
        let address = self.options.broker().tcp_address();
        address.map(|(host, port)| format!("{host}:{port}")).unwrap_or_default()
    }
}

#[cfg(feature = "tls")]
fn tls_transport(ca: &str) -> Transport {
    // Fails if a provider is installed already, as for an earlier cabinet.
    let _ = rustls::crypto::ring::default_provider().install_default();
    Transport::tls(ca.as_bytes().to_vec(), None, None)
}

/// Is never called: a configuration with encryption was refused before.
#[cfg(not(feature = "tls"))]
fn tls_transport(_: &str) -> Transport {
    Transport::tcp()
}

/// Connection to the broker. It ends without a disconnect message, so that the broker publishes the
/// last will of the cabinet.
#[derive(Debug)]
pub(crate) struct Link {
    address: String,
    client: AsyncClient,
    answers: mpsc::Receiver<Result<PubAckReason, ConnectionError>>,
    /// Task that drives the connection.
    connection_task: JoinHandle<()>,
}

impl Link {
    /// Connects to the broker. A broken connection is never repaired. The next connection sends
    /// unacknowledged messages again, from the records on disk and not from the memory of the
    /// library.
    ///
    /// # Errors
    /// [`LinkError::Broker`] if there is no connection.
    pub(crate) async fn open(broker_address: &BrokerAddress) -> Result<Self, LinkError> {
        let builder = AsyncClient::builder(broker_address.options.clone()).capacity(1);
        // The options are valid: TCP with or without TLS, and one message in flight.
        let (client, mut events) = builder.build();
        let broken =
            |cause| LinkError::Broker { address: broker_address.address(), cause: Box::new(cause) };
        while !matches!(events.poll().await.map_err(broken)?, Event::Incoming(Incoming::ConnAck(_)))
        {
        }
        let (sender, heard) = mpsc::channel(2);
        let driver = tokio::spawn(async move {
            loop {
                let acknowledged = match events.poll().await {
                    Ok(Event::Incoming(Incoming::PubAck(of))) => sender.send(Ok(of.reason)).await,
                    Ok(_) => Ok(()),
                    Err(cause) => {
                        let _ = sender.send(Err(cause)).await;
                        return;
                    }
                };
                if acknowledged.is_err() {
                    return;
                }
            }
        });
        Ok(Self {
            address: broker_address.address(),
            client,
            answers: heard,
            connection_task: driver,
        })
    }

    /// Sends a message at least once and waits for its acknowledgement.
    ///
    /// # Errors
    /// [`LinkError`]. After an error it is unknown if the broker has received the message.
    pub(crate) async fn publish(
        &mut self,
        topic: &str,
        retain: bool,
        payload: Vec<u8>,
    ) -> Result<(), LinkError> {
        let options = PublishOptions::at_least_once().retain(retain);
        let sent = self.client.publish(topic, payload, options).await;
        if sent.is_err() {
            return Err(self.wait_until_broken().await);
        }
        match tokio::time::timeout(ACKNOWLEDGE_TIMEOUT, self.answers.recv()).await {
            Err(_) => Err(LinkError::Silent { topic: topic.to_owned() }),
            Ok(Some(Ok(PubAckReason::Success | PubAckReason::NoMatchingSubscribers))) => Ok(()),
            Ok(Some(Ok(reason))) => Err(LinkError::Refused { topic: topic.to_owned(), reason }),
            Ok(Some(Err(cause))) => Err(self.error(cause)),
            Ok(None) => Err(self.error(ConnectionError::RequestsDone)),
        }
    }

    /// Waits until the connection ends.
    pub(crate) async fn wait_until_broken(&mut self) -> LinkError {
        loop {
            match self.answers.recv().await {
                // This acknowledges a message for which `publish` no longer waits.
                Some(Ok(_)) => {}
                Some(Err(cause)) => return self.error(cause),
                None => return self.error(ConnectionError::RequestsDone),
            }
        }
    }

    fn error(&self, cause: ConnectionError) -> LinkError {
        LinkError::Broker { address: self.address.clone(), cause: Box::new(cause) }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.connection_task.abort();
    }
}
