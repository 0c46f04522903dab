//! The sockets of a running service. If the file of a socket is removed, usually with the runtime
//! folder, the socket is created again. Otherwise nobody could query the service.

use core::cell::RefCell;
use core::convert::Infallible;
use core::future::pending;
use core::time::Duration;
use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;

use super::SocketOptions;
use crate::files::own_folder;
use crate::service::status::Socket;

/// Interval at which the file of a socket is checked.
const CHECK_INTERVAL: Duration = Duration::from_millis(500);

/// Sockets whose files were removed and that cannot be created again, with the reasons.
#[derive(Debug, Default)]
pub(super) struct MissingSockets(RefCell<BTreeMap<PathBuf, String>>);

impl MissingSockets {
    /// Returns the reasons as text.
    pub(super) fn reasons(&self) -> Vec<String> {
        let missing = self.0.borrow();
        let words = missing.iter().map(|(path, why)| {
            format!("{} is gone and cannot be made again: {why}", path.display())
        });
        words.collect()
    }

    fn notify(&self, at: &SocketOptions, why: Option<String>) {
        let mut missing = self.0.borrow_mut();
        if missing.get(&at.path) == why.as_ref() {
            return;
        }
        match why {
            None => drop(missing.remove(&at.path)),
            Some(why) => {
                tracing::error!("{} cannot be made again: {why}", at.path.display());
                missing.insert(at.path.clone(), why);
            }
        }
    }
}

/// Serves at a socket, if there is one, like [`keep_serving`].
pub(super) async fn keep_serving_optional(
    at: Option<(&SocketOptions, Socket)>,
    missing: &MissingSockets,
    serve: impl AsyncFn(&Socket) -> io::Result<Infallible>,
) -> io::Result<Infallible> {
    match at {
        Some((at, socket)) => keep_serving(at, socket, missing, serve).await,
        None => pending().await,
    }
}

/// Serves at a socket until the future is dropped. If the file of the socket is removed, creates
/// the socket again and serves there.
///
/// Errors of `serve`.
/// Those of `serve`.
async fn keep_serving(
    at: &SocketOptions,
    mut socket: Socket,
    missing: &MissingSockets,
    serve: impl AsyncFn(&Socket) -> io::Result<Infallible>,
) -> io::Result<Infallible> {
    loop {
        tokio::select! {
            failed = serve(&socket) => return failed,
            () = is_gone(&socket) => {}
        }
        tracing::warn!("{} is gone: it is made again", at.path.display());
        socket = loop {
            match recreate(at) {
                Ok(socket) => break socket,
                Err(why) => missing.notify(at, Some(why)),
            }
            tokio::time::sleep(CHECK_INTERVAL).await;
        };
        missing.notify(at, None);
    }
}

async fn is_gone(socket: &Socket) {
    while socket.has_its_name() {
        tokio::time::sleep(CHECK_INTERVAL).await;
    }
}

/// Creates the socket and its folder again. The folder has to pass the same checks as at the start.
fn recreate(at: &SocketOptions) -> Result<Socket, String> {
    if let Some(folder) = at.path.parent() {
        own_folder(folder).map_err(|why| why.to_string())?;
    }
    at.listen().map_err(|why| why.to_string())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::expectation::Expectation;

    #[test]
    fn a_socket_that_is_gone_is_made_again_once_it_can_be() {
        let place = tempfile::tempdir_in("/tmp").unwrap();
        let folder = place.path().join("run");
        let options = SocketOptions::new(folder.join("status"), 0o660);
        let first = recreate(&options).unwrap();
        assert!(first.has_its_name());
        fs::remove_dir_all(&folder).unwrap();
        assert!(!first.has_its_name());
        // A file has taken the place of the folder.
        fs::write(&folder, "notes").unwrap();
        let missing = MissingSockets::default();
        missing.notify(&options, recreate(&options).err());
        missing.notify(&options, recreate(&options).err());
        let [reason] = missing.reasons().try_into().unwrap();
        Expectation::of("runtime-folder-in-the-way").assert_said(&reason, &[]);
        assert_eq!(fs::read_to_string(&folder).unwrap(), "notes");
        fs::remove_file(&folder).unwrap();
        let second = recreate(&options).unwrap();
        missing.notify(&options, None);
        assert!(missing.reasons().is_empty());
        // The end of the first socket does not affect the second.
        drop(first);
        assert!(second.has_its_name());
        // The name is not taken from another process either.
        fs::remove_file(&options.path).unwrap();
        let _other = recreate(&options).unwrap();
        let why = recreate(&options).unwrap_err();
        assert!(!second.has_its_name() && why.contains("in use by a running service"), "{why}");
    }
}
