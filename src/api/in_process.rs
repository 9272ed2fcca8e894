//! The connection of parts of this process to the server: requests call its routes without a
//! socket.

use std::{
    pin::Pin,
    task::{Context, Poll},
};

use axum::{Router, body::Body};
use bytes::Bytes;
use http_body::{Body as HttpBody, Frame, SizeHint};
use lookdown_common::{InProcess, OwnCameras};
use parking_lot::Mutex;
use tower::ServiceExt;

use super::http::context::OwnRequest;

/// Returns the connection of parts of this process to the server with these routes.
pub fn in_process(
    router: Router,
    own_cameras: OwnCameras,
    most_pixel_bytes: impl Fn(&str) -> usize + Send + Sync + 'static,
) -> InProcess {
    InProcess::new(own_cameras, most_pixel_bytes, move |request| {
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(OwnRequest);
        let answered = router.clone().oneshot(request);
        async {
            let response = match answered.await {
                Ok(response) => response,
                Err(never) => match never {},
            };
            response.map(|body| reqwest::Body::wrap(Exclusive(Mutex::new(body))))
        }
    })
}

/// A body in a mutex, which makes it `Sync`.
struct Exclusive(Mutex<Body>);

impl HttpBody for Exclusive {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(self.0.get_mut()).poll_frame(context)
    }

    fn size_hint(&self) -> SizeHint {
        self.0.lock().size_hint()
    }
}
