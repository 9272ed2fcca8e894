//! The complete protection of a listener of a companion.

use std::{any::Any, net::SocketAddr, num::NonZeroUsize, sync::Arc};

use axum::{
    Router,
    extract::{Request, State},
    middleware::{Next, from_fn, from_fn_with_state},
    response::{IntoResponse, Response},
};
use prometheus::IntGauge;
use secrecy::SecretString;
use tokio::net::TcpListener;
use tower::ServiceBuilder;
use tower_http::catch_panic::CatchPanicLayer;

use crate::{
    Shutdown,
    csrf::{self, AllowedOrigins, Remedies},
    header_limits, host, keys,
    problem::{self, Problem},
    server::{self, ConnectionLimits, Plain},
    unread_responses::{self, UnreadResponses},
};

/// Most connections of a companion at a time.
const MAX_CONNECTIONS: usize = 64;
/// Memory of responses that clients have not read, KiB.
const UNREAD_KIB: u32 = 64 << 10;

/// The clients that may read.
#[derive(Debug, Clone)]
pub enum Access {
    /// Clients with this key.
    Key(SecretString),
    /// Clients of the own machine: the address is a loopback address.
    OwnMachine,
    /// Every client that reaches the address, under local names and these public ones.
    Everyone(Arc<[String]>),
}

impl Access {
    /// Returns the access of an address without a key.
    pub fn without_key(listen: SocketAddr) -> Self {
        if listen.ip().is_loopback() {
            Self::OwnMachine
        } else {
            Self::Everyone(Arc::default())
        }
    }
}

/// The routes of a listener.
pub struct Routes {
    /// Routes for clients with access.
    pub protected: Router,
    /// Health checks, which need no key.
    pub probes: Router,
}

/// Serves the routes until the task ends. `keys_setting` names the setting of the key in remedies.
pub async fn serve(
    listener: TcpListener,
    routes: Routes,
    access: Access,
    keys_setting: &'static str,
    open: &IntGauge,
) {
    let limits = ConnectionLimits {
        max_connections: NonZeroUsize::new(MAX_CONNECTIONS).unwrap_or(NonZeroUsize::MIN),
        ..ConnectionLimits::default()
    };
    let origins = AllowedOrigins {
        own_machine_only: matches!(access, Access::OwnMachine),
        allowed: Arc::default(),
        hosts: match &access {
            Access::Everyone(hosts) => Arc::clone(hosts),
            Access::Key(_) | Access::OwnMachine => Arc::default(),
        },
        remedies: Remedies {
            keys: keys_setting,
            hosts: "protect it with a key",
            origins: "protect it with a key",
        },
    };
    let protected = match access {
        Access::Key(key) => routes
            .protected
            .layer(from_fn_with_state(Arc::new(key), check_key)),
        Access::OwnMachine | Access::Everyone(_) => routes
            .protected
            .layer(csrf::layer(&origins))
            .layer(from_fn_with_state(origins, csrf::require_host)),
    };
    let unread = from_fn_with_state(UnreadResponses::new(UNREAD_KIB), unread_responses::bound);
    let service = surrounded(protected.layer(unread).merge(routes.probes), &limits);
    let shutdown = Shutdown::default();
    server::serve::<Plain, _, _>(listener, None, service, &limits, open, &shutdown).await;
}

/// Adds the layers of every route, the outermost first.
fn surrounded(router: Router, limits: &ConnectionLimits) -> Router {
    let limits = limits.clone();
    let layers = ServiceBuilder::new()
        .layer(from_fn(problem::write))
        .layer(CatchPanicLayer::custom(panic_response))
        .layer(from_fn_with_state(limits, header_limits::within_bounds))
        .layer(from_fn(host::require));
    router.layer(layers)
}

/// Returns the response to a request whose handler panicked. The panic hook logs the cause.
fn panic_response(_: Box<dyn Any + Send>) -> Response {
    Problem::internal().into_response()
}

async fn check_key(
    State(key): State<Arc<SecretString>>,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    keys::check(request.headers(), &key)?;
    Ok(next.run(request).await)
}
