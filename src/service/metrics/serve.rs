//! A small HTTP server for `GET /metrics`.

use core::convert::Infallible;
use core::net::{IpAddr, SocketAddr};
use core::time::Duration;
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;

use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{ALLOW, CONTENT_TYPE, HOST, HeaderMap};
use hyper::http::uri::Authority;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Mutex;
use tokio::task::AbortHandle;

/// Content type of the exposition format.
const EXPOSITION_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";
/// Maximum length of the request line and the headers \[bytes\]. hyper accepts no smaller maximum.
const MAX_HEAD: usize = 8192;
/// Maximum number of headers of a request.
const MAX_HEADERS: usize = 64;
/// Pause after a failed accept. If descriptors are missing, an immediate retry would fail as well.
const ACCEPT_PAUSE: Duration = Duration::from_millis(200);

/// Limits for clients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Maximum number of simultaneous clients. A further client takes the place of the oldest one.
    pub clients: usize,
    /// Maximum time per client, from its connection to the end of the answer.
    pub time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self { clients: 8, time: Duration::from_secs(15) }
    }
}

/// Reason why metrics cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address is not available, possibly because another program uses it. Name another one
    /// with `--listen`.
    #[error("cannot listen at {address}: {cause}; name another address with --listen")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's error.
        cause: io::Error,
    },
}

/// Answers scrapes at `address` with the text from `metrics`, until the future is dropped. `ready`
/// is called with the address once the server listens. `metrics` may block, and is called for one
/// client at a time.
///
/// # Errors
/// [`ServeError::Listen`].
pub async fn serve(
    address: SocketAddr,
    limits: Limits,
    ready: impl FnOnce(SocketAddr),
    metrics: impl Fn() -> String + Send + Sync + 'static,
) -> Result<Infallible, ServeError> {
    let failed = |cause| ServeError::Listen { address, cause };
    let listener = TcpListener::bind(address).await.map_err(failed)?;
    ready(listener.local_addr().map_err(failed)?);
    let is_local = address.ip().is_loopback();
    let mut clients: VecDeque<AbortHandle> = VecDeque::with_capacity(limits.clients);
    let metrics = Arc::new(Mutex::new(Arc::new(metrics)));
    loop {
        let client = match listener.accept().await {
            Ok((client, _)) => client,
            Err(cause) => {
                tracing::debug!("a client could not be accepted: {cause}");
                tokio::time::sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        // A client that has its answer within milliseconds is never the oldest of many. Slow ones
        // must not keep it out.
        clients.retain(|client| !client.is_finished());
        if clients.len() >= limits.clients {
            clients.pop_front().iter().for_each(AbortHandle::abort);
        }
        let metrics = Arc::clone(&metrics);
        let task = tokio::spawn(async move {
            let answered = answer(client, limits, is_local, metrics);
            let _ = tokio::time::timeout(limits.time, answered).await;
        });
        clients.push_back(task.abort_handle());
    }
}

/// Handles one request of one client, and closes the connection.
async fn answer<F>(client: TcpStream, limits: Limits, is_local: bool, metrics: Arc<Mutex<Arc<F>>>)
where
    F: Fn() -> String + Send + Sync + 'static,
{
    let service = service_fn(|request: Request<Incoming>| {
        let metrics = Arc::clone(&metrics);
        async move { Ok::<_, Infallible>(respond(&request, is_local, metrics).await) }
    });
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.time)
        .max_buf_size(MAX_HEAD)
        .max_headers(MAX_HEADERS)
        .keep_alive(false)
        .serve_connection(TokioIo::new(client), service)
        .await;
    if let Err(cause) = served {
        tracing::debug!("a client was not served: {cause}");
    }
}

/// Returns true if the `Host` of a request is an address, `localhost`, or missing. A page in a
/// browser reaches a local server by a name of its own that leads to this machine. The name is then
/// in the request.
fn names_this_machine(headers: &HeaderMap) -> bool {
    let Some(host) = headers.get(HOST) else { return true };
    let authority = host.to_str().ok().and_then(|host| host.parse::<Authority>().ok());
    authority.is_some_and(|authority| {
        let host = authority.host();
        let address = host.trim_start_matches('[').trim_end_matches(']');
        address.parse::<IpAddr>().is_ok() || host.eq_ignore_ascii_case("localhost")
    })
}

async fn respond<F>(
    request: &Request<Incoming>,
    is_local: bool,
    metrics: Arc<Mutex<Arc<F>>>,
) -> Response<Full<Bytes>>
where
    F: Fn() -> String + Send + Sync + 'static,
{
    let plain = |status: StatusCode, text: &'static str| {
        let mut response = Response::new(Full::new(Bytes::from_static(text.as_bytes())));
        *response.status_mut() = status;
        response
    };
    if is_local && !names_this_machine(request.headers()) {
        let text = "ask by an address, or by the name localhost\n";
        return plain(StatusCode::MISDIRECTED_REQUEST, text);
    }
    if request.uri().path() != "/metrics" {
        return plain(StatusCode::NOT_FOUND, "the metrics are at /metrics\n");
    }
    if !matches!(*request.method(), Method::GET | Method::HEAD) {
        let mut response = plain(StatusCode::METHOD_NOT_ALLOWED, "only GET\n");
        response.headers_mut().insert(ALLOW, hyper::header::HeaderValue::from_static("GET, HEAD"));
        return response;
    }
    // The text is requested for one scrape at a time, so that many scrapes do not become many
    // clients of the service.
    let metrics = metrics.lock().await;
    let ask = Arc::clone(&metrics);
    match tokio::task::spawn_blocking(move || ask()).await {
        Ok(text) => {
            let mut response = Response::new(Full::new(Bytes::from(text)));
            let kind = hyper::header::HeaderValue::from_static(EXPOSITION_TYPE);
            response.headers_mut().insert(CONTENT_TYPE, kind);
            response
        }
        Err(_) => plain(StatusCode::INTERNAL_SERVER_ERROR, "the status could not be read\n"),
    }
}
