//! The HTTP server, its connections and its end.

use std::{net::SocketAddr, time::Duration};

use lookdown_http::server::ConnectionLimits;

use super::{
    declare::settings,
    form::{MAX_TIMEOUT_MILLIS, address, count, millis, optional, whole, zero_is_none},
};

settings! {
    /// The HTTP server.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ServerSettings in "server" {
        /// The IP address and port to listen on. `[::]:8080` is every address of the machine.
        listen: SocketAddr = SocketAddr::from(([127, 0, 0, 1], 8080)) => address();
        /// The IP address and port for `/metrics` and the health checks alone; `/metrics` is then
        /// not served elsewhere. Empty: `/metrics` is served with all other routes.
        metrics_listen: Option<SocketAddr> = None => optional(address());
        /// The largest request body in bytes. A larger one is answered with 413. The smallest
        /// setting still holds an image, and the largest, 2 GiB, is more than any image within the
        /// pixel limits.
        max_body_bytes: usize = 32 << 20 => whole(1024..=2 << 30);
        /// The longest time for a request. A slower upload is answered with 408, a slower detection
        /// with 504.
        request_timeout as "request_timeout_millis": Duration = Duration::from_secs(30)
            => millis(1..=MAX_TIMEOUT_MILLIS);
    }
}

settings! {
    in "server" fill ConnectionLimits {
        /// The largest number of open connections. Further ones wait until one is closed. Health
        /// checks that must not wait need `metrics_listen`.
        max_connections => count();
        /// The longest time for the path and the headers of a request to arrive.
        header_timeout as "header_timeout_millis" => millis(1..=MAX_TIMEOUT_MILLIS);
        /// The longest time that a connection stays open between two requests, or while its client
        /// reads less than 64 KiB of a response. A proxy that keeps connections should close its
        /// own earlier.
        idle_timeout as "idle_timeout_millis" => millis(1..=MAX_TIMEOUT_MILLIS);
        /// The most bytes of the path and all headers. More are answered with 431.
        max_header_bytes => whole(1024..=128 * 1024);
        /// The most headers of a request; browsers send about twenty. More are answered with 431.
        max_headers => whole(16..=1024);
    }
}

settings! {
    /// The end of the server.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ShutdownSettings in "shutdown" {
        /// The time after a termination signal (SIGTERM) during which everything is still served
        /// while `/readyz` answers 503, so that load balancers notice. Ctrl-C skips it.
        grace as "grace_millis": Duration = Duration::from_secs(5) => millis(0..=MAX_TIMEOUT_MILLIS);
        /// The longest time after that for the requests that have arrived. 0: as long as for any
        /// request.
        drain_timeout as "drain_timeout_millis": Option<Duration> = None
            => zero_is_none(millis(0..=MAX_TIMEOUT_MILLIS));
    }
}
