//! A server in the same process.

use std::{fmt, future::Future, pin::Pin, sync::Arc};

use http::{Request, Response};
use reqwest::Body;

type Answer = Pin<Box<dyn Future<Output = Response<Body>> + Send>>;

/// The requests to a server in the same process. They use no socket and no TLS.
#[derive(Clone)]
pub struct InProcess(Arc<dyn Fn(Request<Body>) -> Answer + Send + Sync>);

impl InProcess {
    /// Creates a connection to the server that answers with this function.
    pub fn new<A>(answer: impl Fn(Request<Body>) -> A + Send + Sync + 'static) -> Self
    where
        A: Future<Output = Response<Body>> + Send + 'static,
    {
        Self(Arc::new(move |request| Box::pin(answer(request))))
    }

    pub(crate) fn answer(&self, request: Request<Body>) -> Answer {
        (self.0)(request)
    }
}

impl PartialEq for InProcess {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl fmt::Debug for InProcess {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("InProcess")
    }
}
