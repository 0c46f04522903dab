//! The status socket. Each client gets one JSON object.

use core::time::Duration;
use std::io;
use std::sync::Arc;

use tokio::io::AsyncWriteExt;
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use super::listen::Socket;

/// Maximum number of simultaneous clients. Further clients are disconnected.
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
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    loop {
        let (client, place) = accept(&listener, &places).await;
        let document = Arc::clone(&latest.borrow());
        tokio::spawn(async move {
            let _place = place;
            let _ = tokio::time::timeout(CLIENT_TIMEOUT, answer(client, &document)).await;
        });
    }
}

async fn answer(mut client: UnixStream, document: &[u8]) -> io::Result<()> {
    client.write_all(document).await?;
    client.shutdown().await
}

/// Accepts the next client for which there is a place.
pub(super) async fn accept(
    listener: &UnixListener,
    places: &Arc<Semaphore>,
) -> (UnixStream, OwnedSemaphorePermit) {
    loop {
        match listener.accept().await {
            Ok((client, _)) => {
                // If the maximum number of clients is connected, the new client is dropped and sees
                // the end of the connection.
                if let Ok(place) = Arc::clone(places).try_acquire_owned() {
                    return (client, place);
                }
            }
            Err(cause) => {
                tracing::debug!("a client could not be accepted: {cause}");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}
