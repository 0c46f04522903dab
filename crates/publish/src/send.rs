//! Endless loop that sends the messages of one cabinet.

use core::convert::Infallible;
use core::time::Duration;
use std::time::Instant;

use crate::cabinet::Cabinet;
use crate::configuration::Broker;
use crate::link::{BrokerAddress, Link, LinkError};

/// Time between two polls of the service.
const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// First and longest time between attempts to connect to a broker that does not answer.
const RETRY_WAITS: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(30)];

/// Polls the service and sends messages in turn. The ledger records a result or an alarm as sent
/// only after the broker has acknowledged it.
pub(crate) async fn send(mut cabinet: Cabinet, broker: &Broker, prefix: &str) -> Infallible {
    let topics = format!("{prefix}/{}", cabinet.name());
    let state = format!("{topics}/state");
    let broker_address = BrokerAddress::new(&topics, broker, &state, cabinet.last_will());
    let mut link = None;
    let mut outage = Outage::new(cabinet.name());
    loop {
        let polled = Instant::now();
        cabinet.poll();
        let tried = match &mut link {
            _ if polled < outage.retry_at => Err(None),
            Some(link) => Ok(link),
            None => match Link::open(&broker_address).await {
                Err(why) => Err(Some(why)),
                Ok(new) => {
                    cabinet.handle_connection();
                    Ok(link.insert(new))
                }
            },
        };
        let sent = match tried {
            Err(why) => Err(why),
            Ok(link) => match send_all(&mut cabinet, link, &topics, polled).await {
                Ok(()) => {
                    outage.end();
                    let wait = POLL_INTERVAL.saturating_sub(polled.elapsed());
                    tokio::select! {
                        () = tokio::time::sleep(wait) => Ok(()),
                        why = link.wait_until_broken() => Err(Some(why)),
                    }
                }
                Err(why) => Err(Some(why)),
            },
        };
        if let Err(why) = sent {
            if let Some(why) = why {
                // Keep the connection if the broker refused a topic. If the connection ended, the
                // broker would report the cabinet as offline.
                if !matches!(why, LinkError::Refused { .. }) {
                    link = None;
                }
                outage.begin(&why);
            }
            let wait = outage.retry_at.saturating_duration_since(Instant::now()).min(POLL_INTERVAL);
            let broken = async {
                match &mut link {
                    Some(link) => link.wait_until_broken().await,
                    None => core::future::pending().await,
                }
            };
            let is_broken = tokio::select! {
                () = tokio::time::sleep(wait) => false,
                _ = broken => true,
            };
            if is_broken {
                link = None;
            }
        }
    }
}

/// Sends messages until none remains, or until the next poll is due.
async fn send_all(
    cabinet: &mut Cabinet,
    link: &mut Link,
    topics: &str,
    polled: Instant,
) -> Result<(), LinkError> {
    while polled.elapsed() < POLL_INTERVAL
        && let Some(message) = cabinet.next(Instant::now())
    {
        let kind = message.kind;
        let topic = format!("{topics}/{}", kind.topic_level());
        link.publish(&topic, kind.is_retained(), message.payload).await?;
        cabinet.handle_acknowledgement(kind, Instant::now());
    }
    Ok(())
}

/// Time without a connection to the broker. Its beginning and its end are logged. The waiting times
/// between attempts increase.
struct Outage {
    cabinet: String,
    /// Share of each waiting time that this cabinet waits. It differs between cabinets, so that
    /// they do not all reconnect at the same time.
    wait_fraction: f64,
    wait: Option<Duration>,
    retry_at: Instant,
}

impl Outage {
    fn new(cabinet: &str) -> Self {
        let digest = cabinet.bytes().fold(0_u32, |sum, byte| {
            sum.wrapping_mul(31).wrapping_add(u32::from(byte)).wrapping_mul(2_654_435_761)
        });
        let share = 0.5 + 0.5 * f64::from(digest) / f64::from(u32::MAX);
        Self {
            cabinet: cabinet.to_owned(),
            wait_fraction: share,
            wait: None,
            retry_at: Instant::now(),
        }
    }

    fn begin(&mut self, why: &LinkError) {
        if self.wait.is_none() {
            tracing::warn!("{}: nothing is sent: {why}", self.cabinet);
        }
        let wait = self.wait.map_or(RETRY_WAITS[0], |wait| (2 * wait).min(RETRY_WAITS[1]));
        self.wait = Some(wait);
        self.retry_at = Instant::now() + wait.mul_f64(self.wait_fraction);
    }

    fn end(&mut self) {
        if self.wait.take().is_some() {
            tracing::info!("{}: the broker takes what is sent again", self.cabinet);
        }
    }
}
