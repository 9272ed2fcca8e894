//! HTTP/1.1 requests to cameras, webhooks and servers: without redirections, proxies and cookies.
//! The number of provisional responses (`100 Continue`) before a response is bounded, as a peer
//! that never ends them would keep a core busy until the deadline of the request.

mod body;

pub use body::{ClientError, HttpError};

use std::{
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use hyper::{ext::on_informational, http::Uri};
use hyper_rustls::{HttpsConnectorBuilder, MaybeHttpsStream};
use hyper_util::{
    client::legacy::{self, connect::HttpConnector},
    rt::{TokioExecutor, TokioIo, TokioTimer},
};
use reqwest::{
    Body, Client, Method, RequestBuilder, Response, Url,
    header::{ACCEPT, HeaderValue},
};
use rustls::{
    ClientConfig, RootCertStore,
    pki_types::{CertificateDer, pem::PemObject},
};
use tokio::{
    net::TcpStream,
    sync::Notify,
    time::{Instant, timeout_at},
};
use tower::{BoxError, timeout::Timeout, util::BoxCloneSyncService};

use crate::text::with_causes;
use body::MAX_PROVISIONAL;
use body::UntilDeadline;

/// Longest time for a connection, with the look-up of the name and the handshake of TLS.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// Idle time after which a connection is closed: less than the keep-alive of common servers.
const IDLE_TIMEOUT: Duration = Duration::from_secs(20);
/// Interval of the probes of TCP that find a peer which is gone.
const KEEPALIVE: Duration = Duration::from_secs(15);
/// Most bytes that are read at once, and of the head of a response.
const MAX_BUFFER_BYTES: usize = 64 << 10;

type Connector = BoxCloneSyncService<Uri, MaybeHttpsStream<TokioIo<TcpStream>>, BoxError>;

/// A client without redirections and proxies.
#[derive(Debug, Clone)]
pub struct HttpClient {
    /// Only writes requests: it trusts no authority.
    requests: Client,
    transport: legacy::Client<Connector, Body>,
}

/// The provisional responses to a request.
#[derive(Default)]
struct Provisional {
    received: AtomicUsize,
    exceeded: Notify,
}

impl HttpClient {
    /// Creates a client that trusts these authorities, PEM, or those of the system. On a system
    /// without any, plain HTTP works.
    ///
    /// # Errors
    /// [`ClientError`] if the authorities cannot be used.
    pub fn new(authorities: Option<&[u8]>) -> Result<Self, ClientError> {
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        // Fails when a provider is already installed, which has the same effect.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let requests = Client::builder().tls_certs_only([]).no_proxy().build();
        let tls = ClientConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .map_err(|error| ClientError(with_causes(&error)))?
            .with_root_certificates(trusted(authorities)?)
            .with_no_client_auth();
        let mut tcp = HttpConnector::new();
        tcp.enforce_http(false);
        tcp.set_nodelay(true);
        tcp.set_keepalive(Some(KEEPALIVE));
        tcp.set_keepalive_interval(Some(KEEPALIVE));
        let connector = HttpsConnectorBuilder::new()
            .with_tls_config(tls)
            .https_or_http()
            .enable_http1()
            .wrap_connector(tcp);
        let connector = BoxCloneSyncService::new(Timeout::new(connector, CONNECT_TIMEOUT));
        let transport = legacy::Client::builder(TokioExecutor::new())
            .pool_idle_timeout(IDLE_TIMEOUT)
            .pool_timer(TokioTimer::new())
            .http1_max_buf_size(MAX_BUFFER_BYTES)
            .build(connector);
        Ok(Self {
            requests: requests.map_err(|error| ClientError(with_causes(&error)))?,
            transport,
        })
    }

    /// Starts a GET request.
    pub fn get(&self, url: Url) -> RequestBuilder {
        self.requests.get(url)
    }

    /// Starts a request.
    pub fn request(&self, method: Method, url: Url) -> RequestBuilder {
        self.requests.request(method, url)
    }

    /// Sends a request of this client. Its timeout includes the body of the response.
    ///
    /// # Errors
    /// [`HttpError`].
    pub async fn send(&self, request: RequestBuilder) -> Result<Response, HttpError> {
        let request = request.build()?;
        let limit = request.timeout().copied();
        let mut request: http::Request<Body> = request.try_into()?;
        let accept = request.headers_mut().entry(ACCEPT);
        accept.or_insert(HeaderValue::from_static("*/*"));
        let provisional = Arc::new(Provisional::default());
        on_informational(&mut request, {
            let provisional = Arc::clone(&provisional);
            move |_| provisional.count()
        });
        let response = async {
            tokio::select! {
                () = provisional.exceeded.notified() => Err(HttpError::Provisional),
                response = self.transport.request(request) => Ok(response?),
            }
        };
        let Some(limit) = limit else {
            return Ok(Response::from(response.await?.map(Body::wrap)));
        };
        let deadline = Instant::now() + limit;
        let response = timeout_at(deadline, response).await;
        let response = response.map_err(|_| HttpError::Timeout(limit))??;
        Ok(Response::from(response.map(|body| {
            Body::wrap(UntilDeadline::new(body, deadline, limit))
        })))
    }
}

impl Provisional {
    fn count(&self) {
        if self.received.fetch_add(1, Ordering::Relaxed) == MAX_PROVISIONAL {
            self.exceeded.notify_one();
        }
    }
}

/// Returns the trusted authorities. A certificate of the system that cannot be parsed is not
/// trusted.
fn trusted(authorities: Option<&[u8]>) -> Result<RootCertStore, ClientError> {
    let mut roots = RootCertStore::empty();
    let Some(pem) = authorities else {
        roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
        return Ok(roots);
    };
    for certificate in CertificateDer::pem_slice_iter(pem) {
        let certificate = certificate.map_err(|error| ClientError(with_causes(&error)))?;
        let added = roots.add(certificate);
        added.map_err(|error| ClientError(with_causes(&error)))?;
    }
    if roots.is_empty() {
        return Err(ClientError("it has no certificate".to_owned()));
    }
    Ok(roots)
}

#[cfg(test)]
mod tests;
