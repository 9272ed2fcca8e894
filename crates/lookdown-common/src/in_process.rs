//! A server in the same process.

use std::{fmt, future::Future, pin::Pin, sync::Arc};

use http::{Request, Response};
use reqwest::Body;

use crate::OwnCameras;

type Answer = Pin<Box<dyn Future<Output = Response<Body>> + Send>>;

/// The requests to a server in the same process. They use no socket and no TLS.
#[derive(Clone)]
pub struct InProcess {
    pub(crate) answer: Arc<dyn Fn(Request<Body>) -> Answer + Send + Sync>,
    /// The cameras of the process.
    pub own_cameras: OwnCameras,
    /// Returns the most bytes of a frame that this camera of the process should send as pixels; 0
    /// for a camera whose image files the server keeps.
    pub most_pixel_bytes: Arc<dyn Fn(&str) -> usize + Send + Sync>,
}

impl InProcess {
    /// Creates a connection to the server that answers with this function.
    pub fn new<A>(
        own_cameras: OwnCameras,
        most_pixel_bytes: impl Fn(&str) -> usize + Send + Sync + 'static,
        answer: impl Fn(Request<Body>) -> A + Send + Sync + 'static,
    ) -> Self
    where
        A: Future<Output = Response<Body>> + Send + 'static,
    {
        Self {
            answer: Arc::new(move |request| Box::pin(answer(request))),
            own_cameras,
            most_pixel_bytes: Arc::new(most_pixel_bytes),
        }
    }
}

impl PartialEq for InProcess {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.answer, &other.answer)
    }
}

impl fmt::Debug for InProcess {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("InProcess")
    }
}
