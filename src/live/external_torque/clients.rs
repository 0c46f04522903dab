//! Clients of the socket. A slow client loses messages and holds nobody up.

use std::os::fd::OwnedFd;

use rtrb::{Consumer, Producer, RingBuffer};
use rustix::io::Errno;
use rustix::net::{SendFlags, send};

use super::status::SharedExternalTorque;

/// Maximum number of clients. Another one is disconnected at once.
pub const MAX_CLIENTS: usize = 8;

/// End of the task that accepts clients.
#[derive(Debug)]
pub struct ClientSender(Producer<OwnedFd>);

impl ClientSender {
    /// Passes on a connected packet socket. It is closed if too many clients wait.
    pub fn pass_on(&mut self, client: OwnedFd) {
        // A client that is refused is dropped with the error, which closes it.
        let _ = self.0.push(client);
    }
}

/// The connected clients, at the observer thread.
#[derive(Debug)]
pub struct Clients {
    new: Consumer<OwnedFd>,
    connected: Vec<OwnedFd>,
}

/// Creates the queue of new clients.
pub fn clients() -> (ClientSender, Clients) {
    let (sender, new) = RingBuffer::new(MAX_CLIENTS);
    (ClientSender(sender), Clients { new, connected: Vec::with_capacity(MAX_CLIENTS) })
}

impl Clients {
    /// Takes over new clients, up to [`MAX_CLIENTS`].
    pub(super) fn welcome(&mut self, shared: &SharedExternalTorque) {
        while let Ok(client) = self.new.pop() {
            if self.connected.len() < MAX_CLIENTS {
                self.connected.push(client);
            }
            shared.set_clients(self.connected.len());
        }
    }

    /// Returns true if nobody is connected.
    pub(super) fn is_empty(&self) -> bool {
        self.connected.is_empty()
    }

    /// Sends a message to every client without waiting. A client whose buffer is full loses it; one
    /// that has gone is forgotten.
    pub(super) fn send(&mut self, bytes: &[u8], shared: &SharedExternalTorque) {
        let before = self.connected.len();
        self.connected.retain(|client| {
            match send(client, bytes, SendFlags::DONTWAIT | SendFlags::NOSIGNAL) {
                Ok(_) | Err(Errno::INTR) => true,
                Err(Errno::AGAIN | Errno::NOBUFS) => {
                    shared.count_lost();
                    true
                }
                Err(_) => false,
            }
        });
        if self.connected.len() != before {
            shared.set_clients(self.connected.len());
        }
    }
}
