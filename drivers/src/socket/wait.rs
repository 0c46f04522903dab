//! Wait for any of several sockets.

#![allow(unsafe_code, reason = "ppoll: std has no wait for several descriptors")]

use core::time::Duration;
use std::io;

use super::Socket;
use crate::frame::interface::MAX_INTERFACES;

/// Waits until a socket has a frame or an error, or until the time is up; without sockets it
/// sleeps. An interruption by a signal ends the wait.
pub(crate) fn wait_readable<'a>(
    sockets: impl Iterator<Item = &'a Socket>,
    timeout: Duration,
) -> io::Result<()> {
    let unused = libc::pollfd { fd: -1, events: libc::POLLIN, revents: 0 };
    let mut waiting = [unused; MAX_INTERFACES];
    for (place, socket) in waiting.iter_mut().zip(sockets) {
        place.fd = socket.raw_descriptor();
    }
    let time = libc::timespec {
        tv_sec: timeout.as_secs().try_into().unwrap_or(libc::time_t::MAX),
        tv_nsec: timeout.subsec_nanos() as _,
    };
    // SAFETY: `waiting` holds the passed number of entries (negative descriptors are skipped) and
    // outlives the call, like `time`; a null signal mask leaves the mask unchanged.
    let result = unsafe {
        libc::ppoll(
            waiting.as_mut_ptr(),
            MAX_INTERFACES as libc::nfds_t,
            &raw const time,
            core::ptr::null(),
        )
    };
    match result {
        0.. => Ok(()),
        _ => match io::Error::last_os_error() {
            error if error.kind() == io::ErrorKind::Interrupted => Ok(()),
            error => Err(error),
        },
    }
}
