//! The status socket. Each client gets one JSON object.

use core::time::Duration;
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::io::AsyncWriteExt;
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::watch;
use tokio::task::AbortHandle;

use super::listen::Socket;

/// Maximum number of simultaneous clients. The oldest one gives its place to the next.
const MAX_CLIENTS: usize = 8;
/// Maximum time per client.
const CLIENT_TIMEOUT: Duration = Duration::from_secs(2);
/// Pause after a failed accept. If descriptors are missing, an immediate retry would fail as well.
const ACCEPT_PAUSE: Duration = Duration::from_millis(200);

/// Sends the latest document to each client, and reads nothing from the client. Runs until the
/// future is dropped.
///
/// # Errors
/// Only at the start, if the runtime cannot use the socket.
pub async fn serve_status(
    socket: &Socket,
    latest: watch::Receiver<Arc<[u8]>>,
) -> io::Result<core::convert::Infallible> {
    let listener = socket.to_tokio()?;
    let mut clients = Clients::new(MAX_CLIENTS);
    loop {
        let client = accept(&listener).await;
        let document = Arc::clone(&latest.borrow());
        clients.serve(async move |_| {
            let _ = tokio::time::timeout(CLIENT_TIMEOUT, answer(client, &document)).await;
        });
    }
}

async fn answer(mut client: UnixStream, document: &[u8]) -> io::Result<()> {
    client.write_all(document).await?;
    client.shutdown().await
}

/// Accepts the next client.
pub(crate) async fn accept(listener: &UnixListener) -> UnixStream {
    loop {
        match listener.accept().await {
            Ok((client, _)) => return client,
            Err(cause) => {
                tracing::debug!("a client could not be accepted: {cause}");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// The clients of a socket that are being served, the oldest first. A client that has its answer
/// within milliseconds is never the oldest of many, and slow ones do not keep it out.
pub(super) struct Clients {
    limit: usize,
    served: VecDeque<(AbortHandle, Arc<AtomicBool>)>,
}

impl Clients {
    pub(super) fn new(limit: usize) -> Self {
        Self { limit, served: VecDeque::with_capacity(limit) }
    }

    /// Serves a client in a task of its own. The service gets a mark that it sets while the client
    /// must not lose its place. The client is dropped if all places are kept.
    pub(super) fn serve<F>(&mut self, service: impl FnOnce(Arc<AtomicBool>) -> F)
    where
        F: Future<Output = ()> + Send + 'static,
    {
        self.served.retain(|(task, _)| !task.is_finished());
        if self.served.len() >= self.limit {
            let mut served = self.served.iter();
            let slow = served.position(|(_, is_kept)| !is_kept.load(Ordering::Relaxed));
            let Some((task, _)) = slow.and_then(|index| self.served.remove(index)) else { return };
            task.abort();
        }
        let is_kept = Arc::new(AtomicBool::new(false));
        let task = tokio::spawn(service(Arc::clone(&is_kept)));
        self.served.push_back((task.abort_handle(), is_kept));
    }
}
